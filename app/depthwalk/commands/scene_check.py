"""Read every file that a scene names, and report what is wrong with it, for `depthwalk check`."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from depthwalk.errors import InputError
from depthwalk.ingest.formats import is_cooked_file, is_model_file
from depthwalk.ingest.image import load_texture
from depthwalk.ingest.loader import check_mesh
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import is_path_file, load_path
from depthwalk.scene.scene import Asset, BakedAsset, DepthImageAsset, Scene
from depthwalk.scene.schema import MesoParams


def check_file(path: Path, asset_roots: Sequence[Path], overrides: Mapping[str, str]) -> str:
    """Check a scene file, a path file or a mesh, without rendering anything.

    Parameters
    ----------
    path
        A scene file, a path file or a mesh.
    asset_roots
        Folders, besides the scene's own, in which to look for its files.
    overrides
        Values that replace those of the scene file, YAML texts by dotted key.

    Returns
    -------
    str
        A line that describes the file's contents.

    Raises
    ------
    InputError
        If something is wrong, with a line per mistake.
    """
    if not is_model_file(path) and is_path_file(path):
        walk = load_path(path)
        return f"{path}: ok, {len(walk.times)} keyframes, {len(walk.frames())} frames"
    scene = load_scene(path, asset_roots, overrides)
    check_assets(scene)
    return f"{path}: ok, {_counted(len(scene.objects), 'object')}, {_counted(len(scene.assets), 'asset')}"


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def check_assets(scene: Scene) -> None:
    """Read every file that a scene names, one after the other, without keeping any in memory.

    Parameters
    ----------
    scene
        The scene whose assets are read.

    Raises
    ------
    InputError
        With a line for each file that cannot be used.
    """
    complaints: dict[str, str] = {}  # with the first of the places that name the file, which assets may share
    for place, read in _readers(scene):
        try:
            read()
        except InputError as error:
            for line in error.lines:
                complaints.setdefault(line, place)
    if complaints:
        raise InputError(*(str(InputError(line).at(place)) for line, place in complaints.items()))


def _readers(scene: Scene) -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield, for each file of the scene, where the scene names it, and a function that reads it as drawing would."""
    for asset in scene.assets:
        for read in _asset_readers(asset):
            yield asset.place, read
    ground, sky = scene.environment.ground, scene.environment.sky
    if ground is not None and ground.texture is not None:
        yield scene.picture_places.get(ground.texture, ""), partial(load_texture, ground.texture)
    if sky is not None and sky.image is not None:
        yield scene.picture_places.get(sky.image, ""), partial(_read_sky, sky.image)


def _asset_readers(asset: Asset) -> Iterator[Callable[[], object]]:
    """Yield a function for each file of an asset that reads it as drawing would."""
    if isinstance(asset, DepthImageAsset):
        yield partial(_read_depth_image, asset)
        return
    if isinstance(asset, BakedAsset):
        yield partial(_read_baked, asset.baked)
        if asset.source is None:
            return
        asset = asset.source
    yield partial(
        check_mesh,
        asset.mesh,
        texture=asset.texture,
        up=asset.up,
        height=asset.height,
        upright=asset.dpci is not None,
    )
    if asset.dpci is not None and asset.dpci.meso is not None:
        yield partial(_read_meso, asset.dpci.meso)


def _read_sky(path: Path) -> None:
    from depthwalk.ingest.sky_image import load_sky_image  # here, since few scenes have any

    load_sky_image(path)


def _read_meso(params: MesoParams) -> None:
    from depthwalk.assets.asset_files import read_meso  # imports the baker, which few scenes need here

    read_meso(params)


def _read_baked(path: Path) -> None:
    from depthwalk.bake.file import read_baked
    from depthwalk.cook.cooked_file import read_cooked

    if is_cooked_file(path):
        for cooked in read_cooked(path):
            cooked.load()
    else:
        read_baked(path)


def _read_depth_image(asset: DepthImageAsset) -> None:
    from depthwalk.assets.asset_files import complaints_about, read_range_image, read_relief
    from depthwalk.bake.planar import range_mesh

    if asset.size is not None:
        read_relief(asset)
        return
    image = read_range_image(asset)
    with complaints_about(asset.depth):
        range_mesh(image, cut=asset.method == "cut")  # an image may be readable but hold no surface
