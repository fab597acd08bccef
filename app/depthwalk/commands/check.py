"""Declare `depthwalk check`, which reports mistakes in scene files, path files and the files that scenes name."""

from pathlib import Path
from typing import Annotated

import typer

from depthwalk.commands.exit_codes import BAD_INPUT
from depthwalk.commands.failures import tell_mistakes
from depthwalk.commands.option_values import parse_settings
from depthwalk.commands.options import AssetRoots, Quiet, Settings, Verbose, named_files
from depthwalk.commands.program import guarded
from depthwalk.errors import InputError, printable


@guarded
def main(
    scenes: Annotated[
        list[Path], typer.Argument(metavar="FILE", help="Scene files, path files and meshes.", callback=named_files)
    ],
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Check scene files, path files and meshes without rendering anything.

    Reads every mesh and picture that a scene names, bakes nothing, and reports each mistake with file, line and column.
    """
    overrides = parse_settings(settings)
    from depthwalk.commands.scene_check import check_file

    is_bad = False
    for scene in scenes:
        try:
            print(printable(check_file(scene, asset_root or [], overrides)))
        except InputError as error:
            is_bad = True
            tell_mistakes(error)
    if is_bad:
        raise typer.Exit(BAD_INPUT)
