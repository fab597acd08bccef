"""`python -m tools.make_models.bake`: bake the depth images of the shipped scenes, which lie beside their meshes."""

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track

from depthwalk.assets.asset_files import mesh_key, model_params, read_hashed
from depthwalk.bake.cache import sidecar
from depthwalk.bake.file import write_baked
from depthwalk.bake.parts import ModelParams, bake_model
from depthwalk.commands.options import Verbose
from depthwalk.commands.program import as_program, guarded
from depthwalk.errors import InputError
from depthwalk.ingest.loader import check_height
from depthwalk.resources import scene_root
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset


def demo_scenes() -> list[Path]:
    """Return the scenes that must open at once; others bake into the cache when first opened."""
    return [scene_root() / name for name in ("garden.yaml", "room.yaml")]


def baked_assets(scenes: Iterable[Path]) -> list[MeshAsset]:
    """Return the assets with depth images of the scene files `scenes`, one per mesh, by name of the mesh.

    Raises InputError where two of them want one mesh baked differently: a mesh has one file beside it.
    """
    found: dict[Path, MeshAsset] = {}
    for file in scenes:
        for asset in load_scene(file).assets:
            if isinstance(asset, MeshAsset) and asset.dpci is not None:
                other = found.setdefault(asset.mesh, asset)
                if baked_key(other) != baked_key(asset):
                    raise InputError(f"{file}: assets.{asset.name}: another scene bakes {asset.mesh.name} differently")
    return sorted(found.values(), key=lambda asset: asset.mesh.name)


def baked_key(asset: MeshAsset) -> str:
    """Return the key under which the library looks for the depth images of `asset`, which has some."""
    return mesh_key(asset, _params(asset))


def bake_asset(asset: MeshAsset, folder: Path | None = None) -> Path:
    """Bake an asset in one thread and return the file.

    Parameters
    ----------
    asset
        A mesh asset that has depth images.
    folder
        Where to write; None is beside the mesh.

    Raises
    ------
    InputError
        Where the mesh cannot be baked.
    OSError
        Where the file cannot be written.
    """
    mesh, source = read_hashed(asset)
    check_height(mesh, asset.mesh)
    file = sidecar(asset.mesh if folder is None else folder / asset.mesh.name)
    write_baked(file, bake_model(mesh, _params(asset), mesh_key(asset, _params(asset), source), workers=1))
    return file


def _params(asset: MeshAsset) -> ModelParams:
    assert asset.dpci is not None  # callers pass assets with depth images
    return model_params(asset.dpci)


@guarded
def main(
    folder: Annotated[
        Path | None, typer.Argument(help="Existing folder to write to.", show_default="beside the meshes")
    ] = None,
    verbose: Verbose = False,
) -> None:
    """Bake the depth images of the shipped scenes, a process per core."""
    if folder is not None and not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    assets = baked_assets(demo_scenes())
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        baked = pool.map(partial(bake_asset, folder=folder), assets)
        files = list(track(baked, "baking", total=len(assets), console=Console(stderr=True)))
    for file in files:
        print(f"{file}: {file.stat().st_size / 1e6:.2f} MB")
    print(f"{len(files)} files, {sum(file.stat().st_size for file in files) / 1e6:.2f} MB")


if __name__ == "__main__":
    as_program(main)()
