"""Draw the frames of a scene without a window, and pass each on to be written."""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from pyglm import glm

from depthwalk.assets.library import SceneLibrary
from depthwalk.commands.output import Output, has_frame, write_still
from depthwalk.commands.progress import asset_progress, frame_progress, log
from depthwalk.cook.cook import Prefetcher
from depthwalk.errors import InputError
from depthwalk.geometry.vectors import components
from depthwalk.gpu.failures import GPU_FAILURES, GpuError
from depthwalk.limits import MAX_FRAMES
from depthwalk.pictures import LinearImage
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene
from depthwalk.types import Picture
from depthwalk.video import video

MOST_SUPERSAMPLED = 4096 * 2304  # pixels up to which pictures are supersampled by default
_ATTEMPTS = 3  # to draw a frame, if the GPU fails
WriteFrame = Callable[[Any, int], None]  # stores a frame, a Picture or LinearImage, by its index


def path_cameras(path: CameraPath, frames: int | None) -> list[Camera]:
    """Return the cameras of the first `frames` frames of the camera path `path`; None for all of its frames."""
    return [path.sample(time) for time in path.frames()[:frames]]


def turntable_cameras(camera: Camera, count: int, fps: float) -> list[Camera]:
    """Return `count` cameras that go around the target of `camera` once, upright, the way the key N turns in a window.

    The first is `camera`; the one after the last would be it again, so that a video can be repeated. The scene's
    animations go on meanwhile, by `fps` pictures a second. Raises InputError for a camera that looks straight up or
    down, which would stay where it is.
    """
    target = glm.dvec3(*camera.target)
    away = glm.dvec3(*camera.position) - target
    if math.hypot(away.x, away.z) < 1e-6 * glm.length(away):
        raise InputError("--turntable: the camera looks straight up or down; choose another --camera-direction")
    turns = (glm.angleAxis(-math.tau * number / count, glm.dvec3(0, 1, 0)) for number in range(count))
    return [
        replace(camera, position=components(target + turn * away), time=camera.time + number / fps)
        for number, turn in enumerate(turns)
    ]


def parse_frames(text: str | None, count: int) -> range:
    """Parse which frames of a path to draw.

    Parameters
    ----------
    text
        The option --frames: N for the first N frames, A-B for those numbered A to B; None for all.
    count
        How many frames the path has.

    Returns
    -------
    range
        The numbers of the frames, from 0.

    Raises
    ------
    InputError
        If the text is neither, A comes after B, or the path does not have the frames A to B.
    """
    if text is None:
        return range(count)
    match = re.fullmatch(r"([0-9]{1,7})(?:-([0-9]{1,7}))?", text.strip())
    if not match or not 0 <= int(match[1]) <= MAX_FRAMES or (match[2] is None and not int(match[1])):
        raise InputError(f"--frames {text}: must be N, a number of frames from 1 to {MAX_FRAMES}, or A-B")
    if match[2] is None:
        return range(min(int(match[1]), count))
    first, last = int(match[1]), int(match[2])
    if last < first:
        raise InputError(f"--frames {text}: the first frame comes after the last")
    if last >= count:
        raise InputError(f"--frames {text}: the path has the frames 0-{count - 1}")
    return range(first, last + 1)


def smooth(scene: Scene, size: tuple[int, int]) -> None:
    """Anti-alias pictures of a scene that does not set `render.aa`, since time matters less than in a window.

    They are supersampled; those larger than 4K, whose samples may not fit into memory, use SMAA. `preset: paper` stays
    as published, and so do pictures that are blended from many frames.

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
    """Create a renderer without a window, with the assets of a scene loaded, while stderr shows the progress.

    Parameters
    ----------
    scene
        The scene to draw.
    size
        (width, height) of the pictures, pixels.
    representation
        How to draw every object; None follows the scene.
    library
        The assets, some of which may have been read; None reads them all.

    Yields
    ------
    HeadlessRenderer
        The renderer, which is released at the end of the `with` block.

    Raises
    ------
    InputError
        If an asset cannot be used.
    GpuError
        If no OpenGL 3.3 context can be created.
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
        threads.shutdown(wait=False, cancel_futures=True)  # the rest is not needed


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
        Where the frames are written, as accepted by `check_output`.
    fps
        Frames per second of a video; pictures ignore it.
    keys
        The key of each frame, to be stored in its picture; empty for none.
    first
        The number of the first frame.
    resume
        Whether to skip pictures that already hold their keys.

    Raises
    ------
    OSError
        If a file cannot be written, or the video encoder fails.
    GpuError
        If the GPU fails repeatedly.
    """
    size = headless.size
    writer = _video_writer(output, size, fps) if output.is_video(len(cameras)) else _still_writer(output, keys, first)
    with frame_progress("rendering", len(cameras)) as advance, writer as write_frame:
        for number, camera in enumerate(cameras):
            if not (resume and has_frame(output, first + number, keys[number])):
                write_frame(draw_frame(headless, View(camera, size), output, first + number), number)
            advance()


def draw_frame(headless: HeadlessRenderer, view: View, output: Output, frame: int) -> Picture | LinearImage:
    """Return the picture of a frame as `output` needs it; if the GPU fails, recreate everything on it and try again.

    A picture does not depend on earlier ones, so the result is the same. Raises GpuError after _ATTEMPTS failures.
    """
    linear, failure = output.suffix == ".exr", ""
    for _ in range(_ATTEMPTS):
        try:
            if failure:
                headless.recreate()
            headless.draw(view, output.transparent, linear=linear)
            if linear:
                return headless.linear_image()
            return headless.pixels()[..., : 4 if output.transparent else 3].copy()
        except GPU_FAILURES as error:
            failure = f"frame {frame}: {error}"
            log.warning("%s; recreating everything on the GPU", failure)
    raise GpuError(failure)


@contextmanager
def _video_writer(output: Output, size: tuple[int, int], fps: float) -> Iterator[WriteFrame]:
    """Yield a function that adds the frames to a video, to be called for each in order, with its index."""
    with video(output.file(0), size, fps, transparent=output.transparent) as encoder:
        yield lambda picture, number: encoder.send(picture)
    print(output.file(0))


@contextmanager
def _still_writer(output: Output, keys: Sequence[str], first: int) -> Iterator[WriteFrame]:
    """Yield a function that writes a picture for each frame, to be called with the index of the frame."""

    def write_frame(picture: Any, number: int) -> None:
        write_still(picture, output, first + number, keys[number] if keys else "")
        if not output.to_stdout:
            print(output.target(first + number))

    yield write_frame
