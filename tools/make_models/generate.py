"""Write models, textures, specimens, the market and the crowd to a folder, models in two processes."""

from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from rich.progress import track
from tools.make_models.catalogue import MODELS, TEXTURES
from tools.make_models.crowd import write_crowd
from tools.make_models.market import write_market
from tools.make_models.model import write_ply
from tools.make_models.specimens import SPECIMENS
from tools.make_models.textures import write_png

from depthwalk.errors import InputError, suggest

OUT = Path("out/models")  # not tracked by git
_PROCESSES = 2  # each needs up to 3 GB


def write_models(folder: Path, names: list[str]) -> None:
    """Write the models called `names` to `folder`, two at a time.

    A model has the same bytes whichever others are made with it.
    """
    if len(names) < 2:
        for name in names:
            _write_model(name, folder)
        return
    with ProcessPoolExecutor(_PROCESSES, mp_context=get_context("spawn")) as pool:
        made = pool.map(partial(_write_model, folder=folder), names)
        for _ in track(made, "models", total=len(names), console=Console(stderr=True)):
            pass


def _write_model(name: str, folder: Path) -> None:
    write_ply(folder / f"{name}.ply", (MODELS[name].make if name in MODELS else SPECIMENS[name])())


def write_textures(folder: Path, names: list[str]) -> None:
    """Write the textures called `names` to `folder`, as PNG files."""
    for name in names:
        write_png(folder / f"{name}.png", TEXTURES[name][0]())


def generate(folder: Path, names: list[str], assets: int = 300) -> None:
    """Write the named files, or all models and textures of the demo where no name is given.

    Parameters
    ----------
    folder
        The folder to write to; it is made where it is missing.
    names
        Names of models, textures and specimens, and "market" and "crowd" for the scenes of these names.
    assets
        Number of assets of the market.

    Raises
    ------
    InputError
        For an unknown name, and where the folder cannot be made.
    """
    known = [*MODELS, *TEXTURES, *SPECIMENS, "market", "crowd"]
    for name in names:
        if name not in known:
            raise InputError(f"no demo file is called {name!r}{suggest(name, known)}")
    make_folder(folder)
    wanted = names or [*MODELS, *TEXTURES]
    write_models(folder, [n for n in wanted if n in MODELS or n in SPECIMENS])
    write_textures(folder, [n for n in wanted if n in TEXTURES])
    if "market" in wanted:
        write_market(folder, assets)
    if "crowd" in wanted:
        write_crowd(folder)


def make_folder(folder: Path) -> None:
    """Make `folder` where it is missing. Raises InputError where it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None
