"""`depthwalk check`: everything wrong with scene and path files, and with what scenes name."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from depthwalk.errors import InputError
from depthwalk.library import SceneLibrary
from depthwalk.scene.document import read_document
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.scene.scene import DepthImageAsset, Scene


def check_file(path: Path, asset_roots: Sequence[Path], overrides: Mapping[str, str]) -> str:
    """A line about a good scene or path file. Raises InputError with a line per mistake."""
    if is_path_file(path):
        walk = load_path(path)
        return f"{path}: ok, {len(walk.times)} keyframes, {len(walk.frames())} frames"
    scene = load_scene(path, asset_roots, overrides)
    check_assets(scene)
    return f"{path}: ok, {len(scene.objects)} objects, {len(scene.assets)} assets"


def is_path_file(path: Path) -> bool:
    """Whether the YAML file is a camera path: only those have keyframes. Raises InputError."""
    value = read_document(path).value
    return isinstance(value, dict) and "keyframes" in value


def check_assets(scene: Scene) -> None:
    """Reads every file that the scene names. Raises InputError with a line for each that cannot be used."""
    library = SceneLibrary(scene.assets)
    reads: list[Callable[[], object]] = []
    for number, asset in enumerate(scene.assets):
        read = library.baked if isinstance(asset, DepthImageAsset) else library.mesh
        reads.append(lambda read=read, number=number: read(number))  # type: ignore[misc]
    ground = scene.environment.ground
    if ground is not None and ground.texture is not None:
        texture = ground.texture
        reads.append(lambda: library.texture(texture))
    complaints = []
    for attempt in reads:
        try:
            attempt()
        except InputError as error:
            complaints.append(str(error))
    if complaints:
        raise InputError("\n".join(complaints))
