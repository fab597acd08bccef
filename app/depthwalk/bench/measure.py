"""Measure how long the frames of a scene and their passes take along a camera path."""

import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.pixel_shares import KINDS, shares
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.path import CameraPath


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Summarise many measured times, milliseconds.

    Attributes
    ----------
    p50, p95, p99
        The median, the 95th and the 99th percentile.
    max, mean
        The longest time, and the mean.
    """

    p50: float
    p95: float
    p99: float
    max: float
    mean: float


@dataclass(frozen=True, kw_only=True)
class Run:
    """Hold the measured frames of one representation.

    Attributes
    ----------
    representation
        How objects were drawn.
    frames
        Number of measured frames.
    frame_ms
        Time from the call to the finished picture, by the clock, milliseconds.
    passes_ms
        Time of each pass by its name, milliseconds, in those frames whose passes were timed, see `Report.timer`.
    counts
        What was drawn, by name, as means over all frames. The shares of pixels are taken of the pixels of all frames
        together.
    frame_times
        The times that `frame_ms` summarises, one for each frame, milliseconds.
    """

    representation: str
    frames: int
    frame_ms: Spread
    passes_ms: dict[str, Spread]
    counts: dict[str, float]
    frame_times: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Report:
    """Hold a benchmark as `bench --json` stores it, without `frame_times`.

    Attributes
    ----------
    version
        Version of the package.
    commit
        Commit of the checkout that ran; None where the package is installed.
    renderer
        Name of the GL driver.
    timer
        "gpu" where timer queries measure all frames; "finish" where every eighth frame waits for every pass.
    planning
        "compiled" where `render.kernels` computed what a frame decides per object, "numpy" where numba is missing.
    resolution
        Width and height of the pictures, pixels.
    scene
        The scene file.
    path
        The camera path's file; None for a still camera.
    runs
        The measured frames of each representation.
    """

    version: str
    commit: str | None
    renderer: str
    timer: str
    planning: str
    resolution: tuple[int, int]
    scene: str
    path: str | None
    runs: tuple[Run, ...]


def sample_path(path: CameraPath, frames: int | None) -> list[Camera]:
    """Return the cameras along a camera path.

    Parameters
    ----------
    path
        The camera path.
    frames
        Number of cameras, spread evenly from the path's start to its end; None takes every frame of the path.

    Returns
    -------
    list[Camera]
        The cameras, in the order of time.
    """
    times = path.frames() if frames is None else np.linspace(0, path.frames()[-1], frames).tolist()
    return [path.sample(time) for time in times]


def measure(
    headless: HeadlessRenderer, name: str, cameras: Sequence[Camera], warmup: int, advance: Callable[[], None]
) -> Run:
    """Draw frames, and measure how long they and their passes take.

    Parameters
    ----------
    headless
        The renderer that draws the frames.
    name
        Name of the representation that `headless` draws, for the report.
    cameras
        The camera of each measured frame.
    warmup
        Number of frames that are drawn with the first camera before any is measured.
    advance
        Called after each measured frame.

    Returns
    -------
    Run
        The times, and what was drawn.
    """
    finish = headless.device.context.finish
    timers = headless.renderer.timers
    frame_times: list[float] = []
    counts: list[dict[str, int | float]] = []
    pixels = np.zeros(len(KINDS), np.int64)
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
        pixels += headless.pixel_counts()
        advance()
    while timers.awaited(end - 1):
        draw(cameras[-1])
    means = {key: float(np.mean(column)) for key, column in _columns(counts).items()}
    timed = [passes[number] for number in range(first, end) if number in passes]
    return Run(
        representation=name,
        frames=len(cameras),
        frame_ms=spread(frame_times),
        passes_ms={key: spread(column) for key, column in _columns(timed).items()},
        counts={key: round(value, 3) for key, value in (means | shares(pixels)).items()},
        frame_times=tuple(frame_times),
    )


def spread(milliseconds: Sequence[float]) -> Spread:
    """Summarise n ≥ 1 times in `milliseconds`, rounded to a microsecond."""
    p50, p95, p99 = np.percentile(milliseconds, (50, 95, 99))
    values = {"p50": p50, "p95": p95, "p99": p99, "max": np.max(milliseconds), "mean": np.mean(milliseconds)}
    return Spread(**{name: round(float(value), 3) for name, value in values.items()})


def _columns(rows: Sequence[dict[str, float]]) -> dict[str, list[float]]:
    """Return the values of each key over all rows; a key that a row lacks counts as 0 there."""
    columns: dict[str, list[float]] = defaultdict(lambda: [0.0] * len(rows))
    for i, row in enumerate(rows):
        for key, value in row.items():
            columns[key][i] = value
    return dict(columns)
