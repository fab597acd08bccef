"""`depthwalk check`: everything wrong with scene and path files, and with what scenes name."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from depthwalk.errors import InputError
from depthwalk.ingest.formats import is_mesh_file
from depthwalk.ingest.image import load_texture
from depthwalk.ingest.loader import check_mesh
from depthwalk.scene.document import read_document
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.scene.scene import DepthImageAsset, Scene
from depthwalk.scene.schema import MesoParams


def check_file(path: Path, asset_roots: Sequence[Path], overrides: Mapping[str, str]) -> str:
    """A line about a good scene or path file. Raises InputError with a line per mistake."""
    if is_path_file(path):
        walk = load_path(path)
        return f"{path}: ok, {len(walk.times)} keyframes, {len(walk.frames())} frames"
    scene = load_scene(path, asset_roots, overrides)
    check_assets(scene)
    return f"{path}: ok, {len(scene.objects)} objects, {len(scene.assets)} assets"


def is_path_file(path: Path) -> bool:
    """Whether the file is a camera path: only those have keyframes. Raises InputError."""
    return not is_mesh_file(path) and read_document(path).holds(("keyframes",))


def check_assets(scene: Scene) -> None:
    """Reads every file that the scene names, one after the other, and keeps none. Bakes nothing.

    Raises InputError with a line for each that cannot be used.
    """
    complaints = []
    for read in _reads(scene):
        try:
            read()
        except InputError as error:
            complaints.append(str(error))
    if complaints:
        raise InputError("\n".join(dict.fromkeys(complaints)))  # assets may share a file


def _reads(scene: Scene) -> Iterator[Callable[[], object]]:
    """Yield what reads the scene's files, each as drawing it would."""
    for asset in scene.assets:
        if isinstance(asset, DepthImageAsset):
            yield partial(_read_depth_image, asset)
            continue
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
    ground = scene.environment.ground
    if ground is not None and ground.texture is not None:
        yield partial(load_texture, ground.texture)


def _read_meso(params: MesoParams) -> None:
    from depthwalk.assets.library import read_meso  # brings the baker, for scenes with such files only

    read_meso(params)


def _read_depth_image(asset: DepthImageAsset) -> None:
    from depthwalk.assets.library import complaints_about, read_range_image, read_relief
    from depthwalk.bake.planar import range_mesh

    if asset.intrinsics is None:
        read_relief(asset)
        return
    image = read_range_image(asset)
    with complaints_about(asset.depth):
        range_mesh(image)  # an image may be read well and hold no surface
