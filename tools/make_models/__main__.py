"""Make the meshes and textures of the demo, always the same bytes: `python -m tools.make_models [FOLDER [NAME...]]`.

The meshes have about a million triangles each; `tools.make_models.ship` makes of them what ships. By name it also makes
the specimens (`python -m tools.make_models /tmp animal chair`), `market`, a scene of hundreds of assets, and `crowd`,
one of thousands of thin figures.
"""

from pathlib import Path
from typing import Annotated

import typer
from tools.make_models.generate import OUT, generate

from depthwalk.commands.options import Verbose
from depthwalk.commands.program import as_program, guarded
from depthwalk.limits import MAX_ASSETS


@guarded
def main(
    outdir: Annotated[Path, typer.Argument(help="Folder to write to.")] = OUT,
    names: Annotated[
        list[str] | None, typer.Argument(help="Only these files, without suffix; specimens; market; crowd.")
    ] = None,
    assets: Annotated[int, typer.Option(min=1, max=MAX_ASSETS, help="Number of assets of the market.")] = 300,
    verbose: Verbose = False,
) -> None:
    """Make the meshes and textures of the demo."""
    generate(outdir, names or [], assets)


if __name__ == "__main__":
    as_program(main)()
