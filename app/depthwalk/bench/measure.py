"""What a scene costs per frame along a camera path."""

import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.path import CameraPath


@dataclass(frozen=True)
class Spread:
    """Percentiles, maximum and mean of times in milliseconds."""

    p50: float
    p95: float
    p99: float
    max: float
    mean: float


@dataclass(frozen=True)
class Run:
    """The measured frames of one representation.

    frame_ms: from the call to the finished picture, by the clock; frame_times: the same, frame by frame.
    passes_ms: each pass by name, in frames whose passes were timed, as `Report.timer` says; counts: what was drawn,
    mean over all frames.
    """

    representation: str
    frames: int
    frame_ms: Spread
    passes_ms: dict[str, Spread]
    counts: dict[str, float]
    frame_times: tuple[float, ...]


@dataclass(frozen=True)
class Report:
    """A benchmark as `bench --json` stores it (without `frame_times`).

    commit: of the checkout that ran, else None; renderer: the GL driver's name; timer: "finish" where each pass of
    every eighth frame is drained and clocked, "gpu" where timer queries measure all; resolution: width, height; path:
    None for a still camera.
    """

    version: str
    commit: str | None
    renderer: str
    timer: str
    resolution: tuple[int, int]
    scene: str
    path: str | None
    runs: tuple[Run, ...]


def sample_path(path: CameraPath, frames: int | None) -> list[Camera]:
    """The cameras of the path's frames, or of `frames` moments spread evenly over it, both ends included."""
    times = path.frames() if frames is None else np.linspace(0, path.frames()[-1], frames).tolist()
    return [path.sample(time) for time in times]


def measure(
    headless: HeadlessRenderer, name: str, cameras: Sequence[Camera], warmup: int, advance: Callable[[], None]
) -> Run:
    """Draws `warmup` frames with the first camera, then one per camera; `advance` is called after each of these."""
    finish = headless.device.context.finish
    timers = headless.renderer.timers
    frame_times: list[float] = []
    counts: list[dict[str, int | float]] = []
    passes: dict[int, dict[str, float]] = {}  # by the number of the frame

    def draw(camera: Camera) -> float:
        start = time.perf_counter()
        headless.draw(View(camera, headless.size))
        finish()
        elapsed = (time.perf_counter() - start) * 1e3
        passes[timers.of_frame] = timers.milliseconds
        return elapsed

    for _ in range(warmup):
        draw(cameras[0])
    first, end = timers.frame, timers.frame + len(cameras)
    timers.time_next()
    for camera in cameras:
        frame_times.append(draw(camera))
        assert headless.renderer.plan is not None  # `draw` made it
        counts.append(headless.renderer.plan.counts)
        advance()
    while timers.awaited(end - 1):
        draw(cameras[-1])
    timed = [passes[number] for number in range(first, end) if number in passes]
    return Run(
        name,
        len(cameras),
        spread(frame_times),
        {key: spread(column) for key, column in _columns(timed).items()},
        {key: round(float(np.mean(column)), 3) for key, column in _columns(counts).items()},
        tuple(frame_times),
    )


def spread(milliseconds: Sequence[float]) -> Spread:
    """The statistics of n times, rounded to a microsecond."""
    p50, p95, p99 = np.percentile(milliseconds, (50, 95, 99))
    values = p50, p95, p99, np.max(milliseconds), np.mean(milliseconds)
    return Spread(*(round(float(value), 3) for value in values))


def _columns(rows: Sequence[dict[str, float]]) -> dict[str, list[float]]:
    """Values by key over all rows; a key that a row lacks counts as 0 there."""
    columns: dict[str, list[float]] = defaultdict(lambda: [0.0] * len(rows))
    for i, row in enumerate(rows):
        for key, value in row.items():
            columns[key][i] = value
    return dict(columns)
