"""`depthwalk render`: a scene, or a walk along a path, to pictures."""

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from depthwalk.assets.library import SceneLibrary
from depthwalk.bake.cache import sidecar
from depthwalk.commands.console import asset_progress, frame_progress
from depthwalk.commands.options import CameraOptions
from depthwalk.errors import InputError
from depthwalk.files import check_folder, write_bytes
from depthwalk.ingest.sources import source_files
from depthwalk.pictures import jpeg_bytes, png_bytes, write_exr
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Asset, DepthImageAsset, Scene
from depthwalk.video import video

JPEG = (".jpg", ".jpeg")
SUFFIXES = (".png", *JPEG, ".exr", ".mp4")
_FRAME = re.compile(r"\{frame(?::(\d{1,2}))?\}")

Take = Callable[[HeadlessRenderer], None]  # writes the frame that the renderer drew last


@dataclass(frozen=True)
class Output:
    """Where frames go. name: OUT as the user gave it; transparent: alpha 0 where nothing is."""

    name: str
    transparent: bool = False

    @property
    def to_stdout(self) -> bool:
        return self.name == "-"

    @property
    def suffix(self) -> str:
        return ".png" if self.to_stdout else Path(self.name).suffix.lower()

    @property
    def is_series(self) -> bool:
        return _FRAME.search(self.name) is not None

    def file(self, frame: int) -> Path:
        """The file of frame number `frame`."""
        return Path(_FRAME.sub(lambda match: str(frame).zfill(int(match[1] or 0)), self.name))


def check_output(output: Output, frames: int, has_path: bool, inputs: Sequence[Path]) -> None:
    """Makes sure that `frames` frames can go to `output` without touching any of `inputs`. Raises InputError."""
    name = output.name
    if not name:
        raise InputError("-o: is empty; name a file, or - for a PNG on standard output")
    if output.suffix not in SUFFIXES:
        raise InputError(f"{name}: must end in {', '.join(SUFFIXES)}, or be - for a PNG on standard output")
    if braces := re.search(r"\{[^}]*\}", _FRAME.sub("", name)):
        raise InputError(f"{name}: {braces[0]} is unknown; {{frame}} and {{frame:4}} stand for the frame's number")
    if output.transparent and output.suffix in (*JPEG, ".mp4"):
        kind = "video" if output.suffix == ".mp4" else "JPEG"
        raise InputError(f"{name}: --no-background: a {kind} has no alpha; write .png or .exr")
    if output.suffix == ".mp4":
        if not has_path:
            raise InputError(f"{name}: a video needs --path")
        if output.is_series:
            raise InputError(f"{name}: a video is one file, without {{frame}}")
    elif frames > 1 and not output.is_series:
        raise InputError(f"{name}: the path has {frames} frames; put {{frame:4}} into the name, or give --frames 1")
    if output.to_stdout:
        return
    check_folder(output.file(0))
    folder = cache(Path.resolve)  # of a series, the same one for a million files
    files = [output.file(frame) for frame in range(frames if output.is_series else 1)]
    taken = {path.resolve() for path in inputs} | {path.parent.resolve() / path.name for path in inputs}
    if hit := next((file for file in files if folder(file.parent) / file.name in taken), None):
        raise InputError(f"{hit}: would overwrite what is rendered; choose another name")


def input_files(scene: Scene, path: Path | None) -> list[Path]:
    """Every file that the scene is made of or the user named, none of which a picture may overwrite.

    Raises InputError for meshes that cannot be looked through.
    """
    ground = scene.environment.ground
    files = [scene.path, path, ground.texture if ground else None]
    files += [file for asset in scene.assets for file in asset_files(asset)]
    return [file for file in files if file is not None]


def asset_files(asset: Asset) -> list[Path]:
    """The files an asset is made of, those that its mesh names included, and where its depth images lie or would lie.

    Raises InputError for a mesh that cannot be looked through.
    """
    if isinstance(asset, DepthImageAsset):
        files = [asset.depth, asset.colour, asset.normal, sidecar(asset.depth)]
    else:
        meso = asset.dpci.meso if asset.dpci else None
        relief = [meso.depth, meso.normal] if meso else []
        files = [*source_files(asset.mesh, asset.texture), sidecar(asset.mesh), *relief]
    return [file for file in files if file is not None]


def path_cameras(path: CameraPath, frames: int | None) -> list[Camera]:
    """The cameras of the path's frames, of the first `frames` where that is given."""
    return [path.sample(time) for time in path.frames()[:frames]]


def render_frames(
    scene: Scene,
    cameras: Sequence[Camera] | CameraOptions,
    output: Output,
    size: tuple[int, int],
    representation: Representation | None,
    fps: float,
) -> None:
    """Renders a frame per camera, or one by the scene's camera with the options' values, and says what was written.

    size: (width, height), pixels; fps: frames per second of a video.
    """
    with open_headless(scene, size, representation) as headless:
        if isinstance(cameras, CameraOptions):
            cameras = [cameras.apply(scene.camera or headless.frame_all())]
        draw_frames(headless, cameras, output, fps)


def draw_frames(headless: HeadlessRenderer, cameras: Sequence[Camera], output: Output, fps: float) -> None:
    """Draws a frame per camera, and says what was written. fps: frames per second of a video."""
    size = headless.size
    with frame_progress("rendering", len(cameras)) as advance, _writer(output, size, fps) as take:
        for camera in cameras:
            headless.draw(View(camera, size), output.transparent)
            take(headless)
            advance()


def open_headless(scene: Scene, size: tuple[int, int], representation: Representation | None) -> HeadlessRenderer:
    """A renderer with its assets loaded; progress on stderr. size: (width, height), pixels."""
    with asset_progress() as report:
        return HeadlessRenderer(scene, SceneLibrary(scene.assets, report, processes=None), size, representation)


@contextmanager
def _writer(output: Output, size: tuple[int, int], fps: float) -> Iterator[Take]:
    """What stores the frames, in order."""
    if output.suffix == ".mp4":
        with video(output.file(0), size, fps) as encoder:
            yield lambda headless: encoder.send(headless.pixels()[..., :3].copy())
        print(output.file(0))
        return
    frame = 0

    def take(headless: HeadlessRenderer) -> None:
        nonlocal frame
        _write_still(headless, output, frame)
        frame += 1

    yield take


def _write_still(headless: HeadlessRenderer, output: Output, frame: int) -> None:
    if output.suffix == ".exr":
        write_exr(output.file(frame), headless.linear_image())
    else:
        encode = jpeg_bytes if output.suffix in JPEG else png_bytes
        picture = encode(headless.pixels()[..., : 4 if output.transparent else 3])
        if output.to_stdout:
            sys.stdout.buffer.write(picture)
            return
        write_bytes(output.file(frame), picture)
    print(output.file(frame))
