"""Measure how fluid the window is: `python -m tools.fluidity SCENE...` prints a row per scene for docs/walking.md.

A viewer walks at 1.4 m/s and turns by 45° a second, that is along a circle of 1.8 m, for some seconds of real time. The
pictures are those that the window shows (`walk.shown_frames`), without a window and its widgets. Measured are the time
from one to the next, how long it takes until a picture shows what the user did, the part of them that no frame held,
and afterwards, at some moments, their FLIP against the truth of 16 samples a pixel, over that of a whole frame of the
same camera. Then the viewer stands still, until nothing is drawn any more.
"""

import math
import time
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.assets.library import SceneLibrary
from depthwalk.colour import linear_from_srgb8, srgb8_from_linear
from depthwalk.quality.metrics import flip_map
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.renderer import read_pixels
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene
from depthwalk.walk.shown_frames import ShownFrames

SIZE = 1024, 768
SPEED, TURN = 1.4, math.radians(45)  # m/s, rad/s
WARM = 4.0  # s of walking before anything is measured: shaders are compiled, and frames are known to be slow
KEPT = 6  # pictures that are compared with the truth
SAMPLES = 4  # of the truth, per pixel along either axis
UPLOAD_SECONDS = 0.008  # as in the window


class Shown(NamedTuple):
    """Hold a picture that was shown: (H, W, 3) uint8, sRGB, top row first, and the camera that it was shown for."""

    picture: NDArray[np.uint8]
    camera: Camera


class Walked(NamedTuple):
    """Hold what was measured on a walk.

    Attributes
    ----------
    intervals
        (n,) seconds from one picture to the next.
    delays
        (n,) seconds from an input, at any moment, to the end of the first picture that follows it.
    scene
        Seconds of work for a frame of the scene, the median.
    unseen
        The part of the pictures that lay beyond the edges of the frame, the mean, 0 to 1.
    kept
        Some of the pictures.
    idle
        Seconds of processor time per second, standing still, after the picture was finished.
    """

    intervals: NDArray[np.float64]
    delays: NDArray[np.float64]
    scene: float
    unseen: float
    kept: list[Shown]
    idle: float


def camera_at(start: Camera, seconds: float) -> Camera:
    """Return the camera of a viewer who walks ahead from `start` and turns to the left all the time."""
    up, angle = glm.dvec3(0, 1, 0), TURN * seconds
    ahead = glm.normalize(glm.dvec3(start.look.x, 0, start.look.z))
    radius = SPEED / TURN
    way = radius * (math.sin(angle) * ahead + (1 - math.cos(angle)) * glm.cross(up, ahead))
    position = glm.dvec3(*start.position) + way
    look = glm.angleAxis(angle, up) * start.look
    return Camera(position.to_tuple(), (position + look).to_tuple(), start.fov)


def walk(scene: Scene, start: Camera, seconds: float) -> Walked:
    """Walk through a scene as `camera_at` does, for some seconds, and stand still afterwards."""
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), SIZE) as headless, headless.device.context:
        renderer, context = headless.renderer, headless.device.context
        scope = headless.device.scope("fluidity")
        screen = scope.framebuffer([scope.texture(SIZE, 4)])
        frames = ShownFrames(renderer)
        renderer.remembers = True
        shown: list[float] = []  # when

        def show(camera: Camera, dt: float) -> None:
            frames.note(camera, dt, renderer.settings)
            frames.draw(View(camera, SIZE), screen)
            context.finish()
            shown.append(time.perf_counter())
            frames.work()
            renderer.upload_seconds = UPLOAD_SECONDS

        try:
            intervals, drawing, scene_seconds, unseen = [], [], [], []
            kept: list[Shown] = []
            begin = before = time.perf_counter()
            while (now := time.perf_counter()) < begin + WARM + seconds:
                camera = camera_at(start, now - begin)
                show(camera, now - before)
                spent, before = now - before, now
                if now < begin + WARM:
                    continue
                intervals.append(spent)
                drawing.append(shown[-1] - now)
                scene_seconds.append(frames.scene_seconds)
                unseen.append(frames.unseen)
                if len(kept) < KEPT * (now - begin - WARM) / seconds:
                    assert frames.view is not None  # `show` has drawn a picture
                    kept.append(Shown(read_pixels(screen)[..., :3].copy(), frames.view.camera))
                    before += time.perf_counter() - now  # reading is no part of showing
            while not frames.is_current:
                show(camera, 0.02)
            at, used = time.perf_counter(), time.process_time()
            while time.perf_counter() < at + 2:
                frames.note(camera, 0.5, renderer.settings)
                time.sleep(0.1 if frames.is_current else 0)
            idle = (time.process_time() - used) / (time.perf_counter() - at)
        finally:
            frames.release()
            scope.release()
    delays = input_delays(np.array(intervals), np.array(drawing))
    return Walked(np.array(intervals), delays, float(np.median(scene_seconds)), float(np.mean(unseen)), kept, idle)


def input_delays(intervals: NDArray[np.float64], drawing: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how long inputs, one each millisecond, wait for the end of the first picture that is begun after them.

    Parameters
    ----------
    intervals
        (n,) seconds from the beginning of the picture before to that of each.
    drawing
        (n,) seconds that it took to draw each of them.
    """
    begun = np.cumsum(intervals)
    moments = np.arange(begun[0], begun[-1], 0.001)
    following = np.searchsorted(begun, moments)
    return np.asarray(begun[following] + drawing[following] - moments)


def pictures(scene: Scene, cameras: list[Camera], size: tuple[int, int]) -> list[NDArray[np.uint8]]:
    """Return whole frames of a scene, each as if it were the first."""
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), size) as headless:
        found = []
        for camera in cameras:
            headless.draw(View(camera, size))
            found.append(headless.pixels()[..., :3].copy())
    return found


def averaged(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the picture (h, w, 3) of the means of `SAMPLES` × `SAMPLES` pixels each, taken of linear light."""
    height, width, _ = picture.shape
    linear = linear_from_srgb8(picture)
    return srgb8_from_linear(linear.reshape(height // SAMPLES, SAMPLES, width // SAMPLES, SAMPLES, 3).mean((1, 3)))


def main(
    scenes: Annotated[list[Path], typer.Argument(help="Scene files, each with a camera.")],
    seconds: Annotated[float, typer.Option(help="How long to walk.")] = 10.0,
    mode: Annotated[str, typer.Option(help="render.reprojection.mode: auto, on, or off for whole frames.")] = "auto",
) -> None:
    """Print a row per scene: pictures a second, how long from one to the next, what they lack, and their likeness."""
    print(
        "| scene | pictures/s | median · p95 · p99 · max, ms | input to picture, p95, ms | frame, ms | unseen, % "
        "| FLIP, shown ÷ whole | idle, % |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for file in scenes:
        scene = load_scene(file, overrides={"render.reprojection.mode": mode})
        if scene.camera is None:
            raise typer.BadParameter(f"{file}: a scene without a camera")
        walked = walk(scene, scene.camera, seconds)
        cameras = [shown.camera for shown in walked.kept]
        truth = [averaged(picture) for picture in pictures(scene, cameras, (SAMPLES * SIZE[0], SAMPLES * SIZE[1]))]
        whole = pictures(scene, cameras, SIZE)
        flips = [
            (flip_map(true, shown.picture).mean(), flip_map(true, frame).mean())
            for true, shown, frame in zip(truth, walked.kept, whole, strict=True)
        ]
        shown_flip, whole_flip = np.mean(flips, axis=0)
        ms = 1e3 * walked.intervals
        spread = " · ".join(f"{value:.0f}" for value in (*np.percentile(ms, (50, 95, 99)), ms.max()))
        print(
            f"| {file.stem} | {1e3 / ms.mean():.1f} | {spread} | {1e3 * np.percentile(walked.delays, 95):.0f} "
            f"| {1e3 * walked.scene:.0f} | {100 * walked.unseen:.1f} "
            f"| {shown_flip:.4f} ÷ {whole_flip:.4f} = {shown_flip / whole_flip:.2f} | {100 * walked.idle:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    typer.run(main)
