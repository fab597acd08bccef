"""Declare `depthwalk convert`, which makes a scene file of a glTF or USD scene."""

from pathlib import Path
from typing import Annotated

import typer

from depthwalk.commands.options import Quiet, Verbose, own_file
from depthwalk.commands.program import guarded
from depthwalk.errors import counted, printable


@guarded
def main(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A glTF, GLB or USD file, a scene of several objects.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FOLDER", help="Folder to make.", show_default="beside the file, with its name"
        ),
    ] = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Make a scene of a glTF or USD file, with a mesh file for each of its models.

    Copies of a model, also by EXT_mesh_gpu_instancing or a PointInstancer, become objects of one asset, which has depth
    images if it is heavy; what is light and stands still is merged. The first camera, the lights and the first
    animation are kept.
    """
    from depthwalk.commands.progress import asset_progress
    from depthwalk.conversion.gltf import convert_gltf

    found = file if out is not None else own_file(file, "-o")
    folder = out if out is not None else found.with_suffix("")
    with asset_progress() as report:
        made = convert_gltf(found, folder, report)
    for note in made.notes:
        print(printable(note))
    size = (made.models, "model"), (made.objects, "object"), (made.triangles, "triangle")
    print(printable(f"{made.scene}: {', '.join(counted(*part) for part in size)}"))
    print(printable(f"to walk through it: depthwalk view {made.scene}"))
