"""`python -m tools.make_models OUTDIR [NAME...]`: make the meshes and textures that ship, the same bytes every time.

By name it also makes what does not ship: the specimens (`python -m tools.make_models /tmp animal chair`), and `market`,
a scene of hundreds of assets.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import track
from tools.make_models.catalogue import MODELS, TEXTURES
from tools.make_models.market import write_market
from tools.make_models.model import write_ply
from tools.make_models.specimens import SPECIMENS
from tools.make_models.textures import write_png

from depthwalk.commands.options import Verbose
from depthwalk.commands.program import as_program, guarded
from depthwalk.errors import InputError, suggest
from depthwalk.files import write_bytes
from depthwalk.limits import MAX_ASSETS

HEADER = """# Sources of the files in this folder

Everything here is our own work, made by the code in `tools/make_models`; nothing was taken from elsewhere.
`python -m tools.make_models assets` makes all of it again, byte for byte.

Meshes are binary PLY in metres, Y up, on y = 0, with sRGB vertex colours. Size is x × y × z.

| file | triangles | size, m | what it is |
|---|---|---|---|
"""
TEXTURE_HEADER = """
| file | pixels | what it is |
|---|---|---|
"""


def write_models(folder: Path, names: list[str]) -> list[str]:
    """Write the named models to a folder and return the rows of the table that lists them."""
    rows = []
    for name in track(names, "models", console=Console(stderr=True)):
        model = MODELS[name].make()
        write_ply(folder / f"{name}.ply", model)
        size = " × ".join(f"{extent:.2f}" for extent in np.ptp(model.positions, axis=0))
        rows.append(f"| {name}.ply | {len(model.faces)} | {size} | {MODELS[name].about} |\n")
    return rows


def write_textures(folder: Path, names: list[str]) -> list[str]:
    """Write the named textures to a folder and return the rows of the table that lists them."""
    rows = []
    for name in names:
        make, about = TEXTURES[name]
        picture = make()
        write_png(folder / f"{name}.png", picture)
        rows.append(f"| {name}.png | {picture.shape[1]} × {picture.shape[0]} | {about} |\n")
    return rows


def generate(folder: Path, names: list[str], assets: int = 300) -> None:
    """Write the named files, or everything that ships and SOURCES.md where no name is given.

    Parameters
    ----------
    folder
        Where to; it is made where it is missing.
    names
        Of models, textures and specimens; `market`.
    assets
        Number of assets of the market.

    Raises
    ------
    InputError
        For an unknown name, and where the folder cannot be made.
    """
    known = [*MODELS, *TEXTURES, *SPECIMENS, "market"]
    for name in names:
        if name not in known:
            raise InputError(f"no demo file is called {name!r}{suggest(name, known)}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None
    wanted = names or [*MODELS, *TEXTURES]
    models = write_models(folder, [n for n in wanted if n in MODELS])
    textures = write_textures(folder, [n for n in wanted if n in TEXTURES])
    for name in wanted:
        if name in SPECIMENS:
            write_ply(folder / f"{name}.ply", SPECIMENS[name]())
    if "market" in wanted:
        write_market(folder, assets)
    if not names:
        text = HEADER + "".join(models) + TEXTURE_HEADER + "".join(textures)
        write_bytes(folder / "SOURCES.md", text.encode())


@guarded
def main(
    outdir: Annotated[Path, typer.Argument(help="Folder to write to.")],
    names: Annotated[
        list[str] | None, typer.Argument(help="Only these files, without suffix; specimens; market.")
    ] = None,
    assets: Annotated[int, typer.Option(min=1, max=MAX_ASSETS, help="Number of assets of the market.")] = 300,
    verbose: Verbose = False,
) -> None:
    """Make the meshes and textures that ship with the program."""
    generate(outdir, names or [], assets)


if __name__ == "__main__":
    as_program(main)()
