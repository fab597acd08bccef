"""Measure how fluid the window is: `python -m tools.fluidity SCENE...` prints a row per scene for docs/walking.md.

A viewer walks at 1.4 m/s and turns by 45° per second, that is along a circle of 1.8 m, for some seconds of real time.
The pictures are those that the window shows (`walk.shown_frames`), without a window and its widgets. Measured are the
time from each to the next, the time until a picture shows the user's input, and the part of them that was neither in
the last frame nor in any picture from within some metres. Afterwards, at some moments, their FLIP against a reference
of 16 samples per pixel is measured, relative to that of a whole frame of the same camera. Then the viewer stands still
until nothing is drawn any more. With `--wander` he walks and turns at random, by up to 90° per second, and everything
counts except the first second after the first picture.
"""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.assets.library import SceneLibrary
from depthwalk.colour import linear_from_srgb8, srgb8_from_linear
from depthwalk.geometry.vectors import components
from depthwalk.quality.metrics import flip_map
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.image import read_pixels
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene
from depthwalk.walk.shown_frames import ShownFrames

SIZE = 1024, 768
SPEED, TURN = 1.4, math.radians(45)  # m/s, rad/s
WARM = 4.0  # s of walking before measuring begins: shaders are compiled, and frames are known to be slow
KEPT = 6  # pictures that are compared with the reference
SAMPLES = 4  # of the reference, per pixel along either axis
WANDER_WARM = 1.0  # s
WANDER_TURN, WANDER_REACH = math.radians(90), 20.0  # largest rad/s, metres from the starting point
WANDER_SEED = 7
UPLOAD_SECONDS = 0.008  # as in the window


class Shown(NamedTuple):
    """Hold a picture that was shown: (H, W, 3) uint8, sRGB, top row first, and the camera that it was shown for."""

    picture: NDArray[np.uint8]
    camera: Camera


class Walked(NamedTuple):
    """Hold the measurements of a walk.

    Attributes
    ----------
    intervals
        (n,) seconds from one picture to the next.
    delays
        (n,) seconds from an input, at any moment, to the end of the first picture that follows it.
    scene
        Median time of work for a frame of the scene, seconds.
    unseen
        Mean part of the pictures that no frame covered, see `ShownFrames.unseen`, 0 to 1.
    kept
        Some of the pictures.
    idle
        Processor seconds per second at rest, after the picture was finished.
    """

    intervals: NDArray[np.float64]
    delays: NDArray[np.float64]
    scene: float
    unseen: float
    kept: list[Shown]
    idle: float


def camera_at(start: Camera, seconds: float) -> Camera:
    """Return the camera of a viewer who walks ahead from `start` while turning to the left."""
    up, angle = glm.dvec3(0, 1, 0), TURN * seconds
    ahead = glm.normalize(glm.dvec3(start.look.x, 0, start.look.z))
    radius = SPEED / TURN
    way = radius * (math.sin(angle) * ahead + (1 - math.cos(angle)) * glm.cross(up, ahead))
    position = glm.dvec3(*start.position) + way
    look = glm.angleAxis(angle, up) * start.look
    return Camera(components(position), components(position + look), start.fov)


def wandering(start: Camera, seconds: float) -> Callable[[float], Camera]:
    """Return the camera, by time, of a viewer who walks and turns at random for some seconds, beginning at `start`.

    Every second or two he chooses how fast to turn, and whether to stand still; too far from the starting point, he
    turns back.
    """
    rng, step = np.random.default_rng(WANDER_SEED), 0.02
    place, look = np.array(start.position), start.look
    yaw, pitch = math.atan2(look.x, look.z), math.asin(look.y)
    turn = speed = wanted_turn = wanted_speed = until = 0.0
    track = []
    for now in np.arange(0.0, seconds + 1.0, step):
        if now >= until:
            until = now + rng.uniform(0.8, 2.5)
            wanted_turn = rng.uniform(-WANDER_TURN, WANDER_TURN) * (rng.uniform() < 0.7)
            wanted_speed = SPEED * (rng.uniform() < 0.9)
        away = np.array(start.position) - place
        if np.hypot(away[0], away[2]) > WANDER_REACH:
            off = (math.atan2(away[0], away[2]) - yaw + math.pi) % (2 * math.pi) - math.pi
            wanted_turn, wanted_speed = float(np.clip(2 * off, -WANDER_TURN, WANDER_TURN)), SPEED
        turn += (wanted_turn - turn) * step / 0.2
        speed += (wanted_speed - speed) * step / 0.2
        yaw += turn * step
        place = place + speed * step * np.array([math.sin(yaw), 0.0, math.cos(yaw)])
        track.append((*place, yaw))
    at, columns = np.arange(len(track)) * step, np.array(track).T

    def camera(now: float) -> Camera:
        x, y, z, angle = (float(np.interp(now, at, column)) for column in columns)
        level = math.cos(pitch)
        ahead = (x + level * math.sin(angle), y + math.sin(pitch), z + level * math.cos(angle))
        return Camera((x, y, z), ahead, start.fov)

    return camera


def walk(scene: Scene, camera_of: Callable[[float], Camera], seconds: float, warm: float = WARM) -> Walked:
    """Walk through a scene for some seconds, and stand still afterwards.

    Parameters
    ----------
    scene
        The scene.
    camera_of
        Returns the camera at a time, seconds from the beginning.
    seconds
        Duration of the measurement.
    warm
        Seconds before that.
    """
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), SIZE) as headless, headless.device.context:
        renderer, context = headless.renderer, headless.device.context
        scope = headless.device.scope("fluidity")
        screen = scope.framebuffer([scope.texture(SIZE, 4)])
        frames = ShownFrames(renderer)
        renderer.remembers = True
        shown: list[float] = []  # when

        def show(camera: Camera, dt: float) -> None:
            frames.note(camera, dt, SIZE)
            frames.draw(View(camera, SIZE), screen)
            context.finish()
            shown.append(time.perf_counter())
            frames.work()
            renderer.upload_seconds = UPLOAD_SECONDS

        try:
            intervals, drawing, scene_seconds, unseen = [], [], [], []
            kept: list[Shown] = []
            show(camera_of(0.0), 0.0)  # the walk begins once there is a picture
            begin = before = time.perf_counter()
            while (now := time.perf_counter()) < begin + warm + seconds:
                camera = replace(camera_of(now - begin), time=0.0 if scene.animations is None else now - begin)
                show(camera, now - before)
                spent, began, before = now - before, before, now
                if began < begin + warm:
                    continue
                intervals.append(spent)
                drawing.append(shown[-1] - now)
                scene_seconds.append(frames.scene_seconds)
                unseen.append(frames.unseen)
                if len(kept) < KEPT * (now - begin - warm) / seconds:
                    assert frames.view is not None  # `show` has drawn a picture
                    kept.append(Shown(read_pixels(screen)[..., :3].copy(), frames.view.camera))
                    before += time.perf_counter() - now  # reading is no part of showing
            while not frames.is_current:
                show(camera, 0.02)
            at, used = time.perf_counter(), time.process_time()
            while time.perf_counter() < at + 2:
                frames.note(camera, 0.5, SIZE)
                time.sleep(0.1 if frames.is_current else 0)
            idle = (time.process_time() - used) / (time.perf_counter() - at)
        finally:
            frames.release()
            scope.release()
    delays = input_delays(np.array(intervals), np.array(drawing))
    return Walked(np.array(intervals), delays, float(np.median(scene_seconds)), float(np.mean(unseen)), kept, idle)


def input_delays(intervals: NDArray[np.float64], drawing: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how long inputs, one each millisecond, wait for the end of the first picture that begins after them.

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
    """Return whole frames of a scene, each drawn as if it were the first."""
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), size) as headless:
        found = []
        for camera in cameras:
            headless.draw(View(camera, size))
            found.append(headless.pixels()[..., :3].copy())
    return found


def averaged(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the picture (h, w, 3) of the means of `SAMPLES` × `SAMPLES` pixels each, in linear light."""
    height, width, _ = picture.shape
    linear = linear_from_srgb8(picture)
    return srgb8_from_linear(linear.reshape(height // SAMPLES, SAMPLES, width // SAMPLES, SAMPLES, 3).mean((1, 3)))


def main(
    scenes: Annotated[list[Path], typer.Argument(help="Scene files, each with a camera.")],
    seconds: Annotated[float, typer.Option(help="How long to walk.")] = 10.0,
    wander: Annotated[bool, typer.Option("--wander", help="Walk at random instead.")] = False,
    mode: Annotated[str, typer.Option(help="render.reprojection.mode: auto, on, or off for whole frames.")] = "auto",
) -> None:
    """Print a row per scene: pictures a second, how long from one to the next, what they lack, and their likeness."""
    print(
        "| scene | pictures/s | median · p95 · p99 · max, ms | max ÷ median | input to picture, p95, ms | frame, ms "
        "| unseen, % | FLIP, shown ÷ whole | idle, % |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    kernels.load()  # as the window does behind its first picture
    for file in scenes:
        scene = load_scene(file, overrides={"render.reprojection.mode": mode})
        if scene.camera is None:
            raise typer.BadParameter(f"{file}: a scene without a camera")
        start = scene.camera
        if wander:
            walked = walk(scene, wandering(start, WANDER_WARM + seconds), seconds, WANDER_WARM)
        else:
            walked = walk(scene, partial(camera_at, start), seconds)
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
            f"| {file.stem} | {1e3 / ms.mean():.1f} | {spread} | {ms.max() / np.median(ms):.1f} "
            f"| {1e3 * np.percentile(walked.delays, 95):.0f} "
            f"| {1e3 * walked.scene:.0f} | {100 * walked.unseen:.1f} "
            f"| {shown_flip:.4f} ÷ {whole_flip:.4f} = {shown_flip / whole_flip:.2f} | {100 * walked.idle:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    typer.run(main)
