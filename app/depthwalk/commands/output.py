"""Draw frames headless and write them to picture files, to a video or to stdout."""

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from depthwalk.assets.library import SceneLibrary
from depthwalk.cluster.store import check_url, is_url, read_head, write_url
from depthwalk.commands.progress import asset_progress, frame_progress, log
from depthwalk.cook.cook import Prefetcher
from depthwalk.errors import InputError
from depthwalk.files import check_folder, temporary_folder, write_bytes
from depthwalk.gpu.failures import GPU_FAILURES, GpuError
from depthwalk.limits import MAX_FRAMES
from depthwalk.pictures import KEY_BYTES, LinearImage, jpeg_bytes, png_bytes, stored_key, write_exr
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene
from depthwalk.types import Picture
from depthwalk.video import video

JPEG = (".jpg", ".jpeg")
MOST_SUPERSAMPLED = 4096 * 2304  # pixels of pictures that are supersampled by default
SUFFIXES = (".png", *JPEG, ".exr", ".mp4")
_FRAME = re.compile(r"\{frame(?::(\d{1,2}))?\}")

_ATTEMPTS = 3  # to draw a frame, where the GPU fails

WriteFrame = Callable[[Any, int], None]  # stores a frame, a Picture or LinearImage, by its index


@dataclass(frozen=True)
class Output:
    """Say where frames are written.

    Attributes
    ----------
    name
        The option OUT as the user gave it: a file, a series of files with `{frame}`, or `-` for stdout.
    transparent
        Whether pixels that show nothing have alpha 0.
    """

    name: str
    transparent: bool = False

    @property
    def to_stdout(self) -> bool:
        """Return whether the picture goes to stdout."""
        return self.name == "-"

    @property
    def suffix(self) -> str:
        """Return the suffix that names the format, in lower case."""
        return ".png" if self.to_stdout else Path(self.name).suffix.lower()

    @property
    def is_series(self) -> bool:
        """Return whether each frame has a file of its own."""
        return _FRAME.search(self.name) is not None

    @property
    def is_remote(self) -> bool:
        """Return whether the name is a URL."""
        return is_url(self.name)

    def target(self, frame: int) -> str:
        """Return the name, a file's or a URL, of frame number `frame`."""
        return _FRAME.sub(lambda match: str(frame).zfill(int(match[1] or 0)), self.name)

    def file(self, frame: int) -> Path:
        """Return the file of frame number `frame`, where it is one of this machine."""
        return Path(self.target(frame))


def check_output(output: Output, frames: Sequence[int], has_path: bool, inputs: Sequence[Path]) -> None:
    """Check that frames can be written, before anything is rendered.

    Parameters
    ----------
    output
        Where the frames go.
    frames
        The numbers of the frames.
    has_path
        Whether a camera path was given, which a video needs.
    inputs
        Files that must stay as they are.

    Raises
    ------
    InputError
        Where the output does not suit the frames, cannot be written, or would overwrite an input.
    """
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
        if output.is_remote:
            raise InputError(f"{name}: a video is encoded into a file of this machine; URLs are for pictures")
    elif (count := len(frames)) > 1 and not output.is_series:
        raise InputError(f"{name}: the path has {count} frames; put {{frame:4}} into the name, or give --frames 1")
    if output.is_remote:
        check_url(output.target(0))
    elif not output.to_stdout:
        _check_files(output, frames, inputs)


def _check_files(output: Output, frames: Sequence[int], inputs: Sequence[Path]) -> None:
    check_folder(output.file(0))
    resolve = cache(Path.resolve)  # a series of a million files has one folder
    files = [output.file(frame) for frame in (frames if output.is_series else [0])]
    taken = {path.resolve() for path in inputs} | {path.parent.resolve() / path.name for path in inputs}
    if hit := next((file for file in files if resolve(file.parent) / file.name in taken), None):
        raise InputError(f"{hit}: would overwrite what is rendered; choose another name")


def path_cameras(path: CameraPath, frames: int | None) -> list[Camera]:
    """Return the cameras of the first `frames` frames of the camera path `path`; None for all of its frames."""
    return [path.sample(time) for time in path.frames()[:frames]]


def parse_frames(text: str | None, path: CameraPath) -> range:
    """Read which frames of a path to draw.

    Parameters
    ----------
    text
        The option --frames: N for the first N frames, A-B for those numbered A to B; None for all.
    path
        The camera path.

    Returns
    -------
    range
        The numbers of the frames, from 0.

    Raises
    ------
    InputError
        Where the text is neither, or the path does not have the frames A to B.
    """
    count = len(path.frames())
    if text is None:
        return range(count)
    match = re.fullmatch(r"([0-9]{1,7})(?:-([0-9]{1,7}))?", text.strip())
    if not match or not 0 <= int(match[1]) <= MAX_FRAMES or (match[2] is None and not int(match[1])):
        raise InputError(f"--frames {text}: must be N, a number of frames from 1 to {MAX_FRAMES}, or A-B")
    if match[2] is None:
        return range(min(int(match[1]), count))
    first, last = int(match[1]), int(match[2])
    if not first <= last < count:
        raise InputError(f"--frames {text}: the path has the frames 0-{count - 1}")
    return range(first, last + 1)


def smooth(scene: Scene, size: tuple[int, int]) -> None:
    """Anti-alias pictures of a scene that says nothing of `render.aa`: nobody waits for a frame as in a window.

    They are supersampled; larger ones than 4K, for whose samples memory may not suffice, are smoothed by SMAA. The
    `preset: paper` is left as it was published, and so are pictures that are blended of many frames.

    Parameters
    ----------
    scene
        The scene, whose settings are changed.
    size
        (width, height) of the pictures, pixels.
    """
    settings = scene.render
    if "aa" in settings.model_fields_set or settings.preset == "paper" or settings.dof.mode == "accumulate":
        return
    settings.aa = "ssaa" if size[0] * size[1] <= MOST_SUPERSAMPLED else "smaa"


@contextmanager
def open_headless(
    scene: Scene, size: tuple[int, int], representation: Representation | None, library: SceneLibrary | None = None
) -> Iterator[HeadlessRenderer]:
    """Make a renderer without a window, with the assets of a scene loaded, while stderr shows the progress.

    Parameters
    ----------
    scene
        The scene to draw.
    size
        (width, height) of the pictures, pixels.
    representation
        How to draw every object; None leaves it to the scene.
    library
        The assets, of which some may have been read; None reads them all.

    Yields
    ------
    HeadlessRenderer
        The renderer, which is released at the end of the `with` block.

    Raises
    ------
    InputError
        Where an asset cannot be used.
    GpuError
        Where no OpenGL 3.3 context can be created.
    """
    threads = ThreadPoolExecutor(1, "read-ahead")
    try:
        with asset_progress() as report:
            if library is None:
                library = SceneLibrary(scene.assets, processes=None, ahead=Prefetcher(threads))
            library.report = report
            headless = HeadlessRenderer(scene, library, size, representation)
        with headless:
            yield headless
    finally:
        threads.shutdown(wait=False, cancel_futures=True)  # nobody needs the rest


def draw_frames(
    headless: HeadlessRenderer,
    cameras: Sequence[Camera],
    output: Output,
    fps: float,
    keys: Sequence[str] = (),
    first: int = 0,
    resume: bool = False,
) -> None:
    """Draw a frame for each camera, write it, and print the name of each file.

    Parameters
    ----------
    headless
        The renderer that draws.
    cameras
        The camera of each frame.
    output
        Where the frames go, as `check_output` has accepted it.
    fps
        Frames per second of a video; pictures ignore it.
    keys
        What names each frame, to be stored in its picture; none where nothing does.
    first
        The number of the first frame.
    resume
        Whether to leave pictures that hold their keys already.

    Raises
    ------
    OSError
        Where a file cannot be written, or the video encoder fails.
    GpuError
        Where the GPU fails again and again.
    """
    size = headless.size
    with frame_progress("rendering", len(cameras)) as advance, _writer(output, size, fps, keys, first) as write_frame:
        for number, camera in enumerate(cameras):
            if not (resume and has_frame(output, first + number, keys[number])):
                write_frame(draw_frame(headless, View(camera, size), output, first + number), number)
            advance()


def draw_frame(headless: HeadlessRenderer, view: View, output: Output, frame: int) -> Picture | LinearImage:
    """Return the picture of a frame as `output` wants it; where the GPU fails, once more with everything made anew.

    A picture does not depend on earlier ones, so that it is the same. Raises GpuError after _ATTEMPTS failures.
    """
    linear, failure = output.suffix == ".exr", ""
    for _ in range(_ATTEMPTS):
        try:
            if failure:
                headless.make_anew()
            headless.draw(view, output.transparent, linear=linear)
            if linear:
                return headless.linear_image()
            return headless.pixels()[..., : 4 if output.transparent else 3].copy()
        except GPU_FAILURES as error:
            failure = f"frame {frame}: {error}"
            log.warning("%s; context and objects are made anew", failure)
    raise GpuError(failure)


@contextmanager
def _writer(output: Output, size: tuple[int, int], fps: float, keys: Sequence[str], first: int) -> Iterator[WriteFrame]:
    """Yield what stores the frames, to be called for each in their order, with its index."""
    if output.suffix == ".mp4":
        with video(output.file(0), size, fps) as encoder:
            yield lambda picture, number: encoder.send(picture)
        print(output.file(0))
        return

    def write_frame(picture: Any, number: int) -> None:
        write_still(picture, output, first + number, keys[number] if keys else "")
        if not output.to_stdout:
            print(output.target(first + number))

    yield write_frame


def has_frame(output: Output, frame: int, key: str) -> bool:
    """Return whether the picture of a frame is there: its file is, which is never half written, and holds its key.

    Parameters
    ----------
    output
        Where the frames go.
    frame
        The number of the frame.
    key
        What names the frame, 64 hex digits.

    Returns
    -------
    bool
        True where there is nothing to draw.

    Raises
    ------
    OSError
        Where a file exists but cannot be read.
    """
    if output.is_remote:
        return stored_key(read_head(output.target(frame), KEY_BYTES)) == key
    try:
        with output.file(frame).open("rb") as file:
            return stored_key(file.read(KEY_BYTES)) == key
    except FileNotFoundError:
        return False


def write_still(picture: Picture | LinearImage, output: Output, frame: int, key: str = "") -> None:
    """Write a picture.

    Parameters
    ----------
    picture
        The picture, as `draw_frame` returns it.
    output
        Where the frames go.
    frame
        The number of the frame.
    key
        What names the frame, to be stored in the file; "" for nothing.

    Raises
    ------
    OSError
        Where the file cannot be written.
    """
    if isinstance(picture, LinearImage):
        _write_linear(picture, output, frame, key)
        return
    encoded = (jpeg_bytes if output.suffix in JPEG else png_bytes)(picture, key)
    if output.to_stdout:
        sys.stdout.buffer.write(encoded)
    elif output.is_remote:
        write_url(output.target(frame), encoded)
    else:
        write_bytes(output.file(frame), encoded)


def _write_linear(picture: LinearImage, output: Output, frame: int, key: str) -> None:
    if not output.is_remote:
        write_exr(output.file(frame), picture, key)
        return
    with temporary_folder() as folder:  # OpenEXR writes files only
        file = Path(folder) / "frame.exr"
        write_exr(file, picture, key)
        write_url(output.target(frame), file.read_bytes())
