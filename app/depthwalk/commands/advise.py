"""Declare `depthwalk advise`, which measures how each asset of a scene is drawn quickest on this machine."""

from pathlib import Path
from typing import Annotated

import typer

from depthwalk.commands.option_values import open_scene, parse_resolution
from depthwalk.commands.options import AssetRoots, Quiet, Resolution, SceneArgument, Settings, Verbose, own_file
from depthwalk.commands.program import guarded
from depthwalk.errors import InputError
from depthwalk.resources import given_or_shipped

_SUFFIX = ".advice.json"
_MOST_PIXELS = 4096


@guarded
def main(
    scene: SceneArgument,
    want_flip: Annotated[
        float,
        typer.Option(
            metavar="FLIP", min=0, max=1, help="Greatest mean FLIP, over the pixels of an object, that is good enough."
        ),
    ] = 0.12,
    seconds: Annotated[
        float,
        typer.Option(
            metavar="S", min=0, max=86_400, help="Begin no measurement after this many seconds; baking does not count."
        ),
    ] = 60.0,
    json: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the advice to this file; by default SCENE.advice.json, beside SCENE."),
    ] = None,
    resolution: Resolution = "640,480",
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Find the quickest way to draw each asset of a scene on this machine, within an error limit.

    The advice is written to a file, which the scene names by the key `advice`; `representation: auto` follows it.
    """
    size = parse_resolution(resolution)
    if max(size) > _MOST_PIXELS:
        why = "since pictures are compared with ones of four times the width and height"
        raise InputError(f"--resolution {resolution}: each side must be at most {_MOST_PIXELS} pixels, {why}")
    from depthwalk.assets.library import SceneLibrary
    from depthwalk.bench.advise import SIZES, advise, fields, to_table
    from depthwalk.bench.tables.table import to_text
    from depthwalk.commands.progress import asset_progress
    from depthwalk.commands.reports import check_report_files, input_files, write_report
    from depthwalk.gpu.headless_device import headless_device
    from depthwalk.scene.advice import advice_text

    if max(size) < min(SIZES):
        raise InputError(f"--resolution {resolution}: must be at least {min(SIZES)} pixels wide or high")
    found = given_or_shipped(scene) if json is not None else own_file(scene, "--json")
    opened = open_scene(found, asset_root, settings)
    out = json or opened.path.with_suffix(_SUFFIX)
    inputs = [file for file in input_files(opened, None) if file != opened.advice_file]  # former advice makes way
    check_report_files([out], inputs, "measured")
    device = headless_device()
    renderer = device.renderer
    device.context.release()
    with asset_progress() as report:
        library = SceneLibrary(opened.assets, report, processes=None)
        advised = advise(opened, library, size, want_flip, seconds, report)
    table = to_table(advised, want_flip)
    if not advised.sizes:
        why = (
            "there was no time for a measurement"
            if advised.unfinished
            else "no asset has both a mesh and depth images made from it"
        )
        raise InputError(f"{scene}: nothing to advise: {why}")
    write_report(out, advice_text(renderer, want_flip, fields(advised.sizes)))
    print(to_text(table))
    print(f"\nwritten to {out}; to use it, add this line to the scene file:  advice: {out.name}")
