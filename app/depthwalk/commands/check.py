"""`depthwalk check`: everything that is wrong with scene files, path files and the files that scenes name."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from depthwalk.assets.library import complaints_about, read_meso, read_range_image, read_relief
from depthwalk.bake.planar import range_mesh
from depthwalk.commands.options import AssetRoots, Quiet, Settings, Verbose, parse_settings
from depthwalk.commands.program import BAD_INPUT, guarded
from depthwalk.errors import InputError
from depthwalk.ingest.image import load_texture
from depthwalk.ingest.loader import check_mesh
from depthwalk.scene.loader import load_scene
from depthwalk.scene.lone_mesh import is_mesh_file
from depthwalk.scene.path import is_path_file, load_path
from depthwalk.scene.scene import DepthImageAsset, MeshAsset, Scene


@guarded
def main(
    scenes: Annotated[list[Path], typer.Argument(metavar="FILE", help="Scene files, path files and meshes.")],
    asset_root: AssetRoots = None,
    settings: Settings = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Check scene files, path files and meshes without rendering anything.

    Reads every mesh and picture that a scene names, bakes nothing, and reports each mistake with file, line and column.
    """
    overrides = parse_settings(settings)
    is_bad = False
    for scene in scenes:
        try:
            print(check_file(scene, asset_root or [], overrides))
        except InputError as error:
            is_bad = True
            typer.echo(str(error), err=True)
    if is_bad:
        raise typer.Exit(BAD_INPUT)


def check_file(path: Path, asset_roots: Sequence[Path], overrides: Mapping[str, str]) -> str:
    """Return a line about a good scene or path file.

    Parameters
    ----------
    path
        A scene file, a path file or a mesh.
    asset_roots
        Folders besides the scene's in which its files may lie.
    overrides
        Values that replace those of the scene file, by their keys.

    Raises
    ------
    InputError
        Where something is wrong, with a line per mistake.
    """
    if not is_mesh_file(path) and is_path_file(path):
        walk = load_path(path)
        return f"{path}: ok, {len(walk.times)} keyframes, {len(walk.frames())} frames"
    scene = load_scene(path, asset_roots, overrides)
    check_assets(scene)
    return f"{path}: ok, {len(scene.objects)} objects, {len(scene.assets)} assets"


def check_assets(scene: Scene) -> None:
    """Read every file that a scene names, one after the other, and keep none of them in memory.

    Raises
    ------
    InputError
        With a line for each file that cannot be used.
    """
    complaints = []
    for read in _readers(scene):
        try:
            read()
        except InputError as error:
            complaints.append(str(error))
    if complaints:
        raise InputError("\n".join(dict.fromkeys(complaints)))  # assets may share a file


def _readers(scene: Scene) -> Iterator[Callable[[], object]]:
    """Yield a function per file of the scene, which reads it as drawing would."""
    for asset in scene.assets:
        if isinstance(asset, MeshAsset):
            yield partial(
                check_mesh,
                asset.mesh,
                texture=asset.texture,
                up=asset.up,
                height=asset.height,
                upright=asset.dpci is not None,
            )
            if asset.dpci is not None and asset.dpci.meso is not None:
                yield partial(read_meso, asset.dpci.meso)
        elif asset.intrinsics is None:
            yield partial(read_relief, asset)
        else:
            yield partial(_read_range_surface, asset)
    ground = scene.environment.ground
    if ground is not None and ground.texture is not None:
        yield partial(load_texture, ground.texture)


def _read_range_surface(asset: DepthImageAsset) -> None:
    image = read_range_image(asset)
    with complaints_about(asset.depth):
        range_mesh(image)  # an image may be readable and hold no surface
