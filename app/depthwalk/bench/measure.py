"""Measure how long the frames of a scene and their passes take along a camera path.

Several ways to draw the scene alternate frame by frame, each in a GL context of its own, so that other load on the
machine and its temperature affect all of them alike.
"""

import gc
import time
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthwalk.bench.slow_frames import SlowFrame, slowest_frames
from depthwalk.pictures import png_bytes
from depthwalk.provenance import Machine
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.pixel_shares import shares
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
class Trace:
    """Hold the records of each measured frame, for the page and the CSV file.

    Attributes
    ----------
    work
        Work done in each of the n frames, by name, (n,) each: the counts of `FrameDrawLists.counts`; steps on the CPU,
        in milliseconds (`plan_ms`, `upload_ms` …), and `garbage_ms`, the time of Python's garbage collector;
        `processor_ms`, processor time of all threads; and `programs`, the number of shader programs compiled.
    passes
        Milliseconds of each pass by its name, by the number of each frame whose passes were timed.
    pixels
        (n, 5) how many of the counted pixels each kind of `pixel_shares.KINDS` drew.
    pictures
        Some of the frames, by number, as the contents of PNG files.
    """

    work: dict[str, list[float]]
    passes: dict[int, dict[str, float]]
    pixels: list[list[int]]
    pictures: dict[int, bytes]


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
        Wall-clock time from the call to the finished picture, milliseconds. Frames that took longer because their
        passes were timed one by one do not count, unless there are no others.
    passes_ms
        Time of each pass by its name, milliseconds, in the frames whose passes were timed, see `Report.timer`.
    counts
        What was drawn, by name, as means over all frames. Shares of pixels refer to the pixels of all frames together.
    slowest
        The slowest frames, the slowest first, and why they took longer.
    frame_times
        The time of each frame, milliseconds.
    trace
        Records of each frame; None for a run that was read from a file.
    """

    representation: str
    frames: int
    frame_ms: Spread
    passes_ms: dict[str, Spread]
    counts: dict[str, float]
    slowest: tuple[SlowFrame, ...]
    frame_times: tuple[float, ...]
    trace: Trace | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True, kw_only=True)
class Report:
    """Hold a benchmark as `bench --json` stores it, without the traces.

    Attributes
    ----------
    version
        Version of the package.
    commit
        Commit of the checkout that ran; None if the package is installed.
    date
        Date and time of the measurement with its zone, ISO 8601.
    machine
        The machine that it ran on.
    renderer, driver
        The GL driver's name for the hardware, and its own version.
    timer
        "gpu" if timer queries measure all frames; "finish" if every eighth frame waits for every pass.
    planning
        "compiled" if `render.kernels` computed the per-object decisions of a frame, "numpy" if numba is missing.
    resolution
        Width and height of the pictures, pixels.
    scene
        The scene file.
    path
        The camera path's file; None for a fixed camera.
    stride
        Frames of the camera path from one measured frame to the next: 1 for a walk, more if `--frames` skips some; None
        for a fixed camera.
    runs
        The measured frames of each representation.
    """

    version: str
    commit: str | None
    date: str
    machine: Machine
    renderer: str
    driver: str
    timer: str
    planning: str
    resolution: tuple[int, int]
    scene: str
    path: str | None
    stride: float | None
    runs: tuple[Run, ...]


def sample_path(path: CameraPath, frames: int | None) -> list[Camera]:
    """Return the cameras along a camera path.

    Parameters
    ----------
    path
        The camera path.
    frames
        Number of cameras, spread evenly from the path's start to its end; None: every frame of the path.

    Returns
    -------
    list[Camera]
        The cameras, in the order of time.
    """
    times = path.frames() if frames is None else np.linspace(0, path.frames()[-1], frames).tolist()
    return [path.sample(time) for time in times]


def measure(
    drawn: Mapping[str, HeadlessRenderer],
    cameras: Sequence[Camera],
    warmup: int,
    advance: Callable[[], None],
    pictured: Collection[int] = (),
) -> list[Run]:
    """Draw frames, and measure how long they and their passes take.

    Parameters
    ----------
    drawn
        The renderers that alternate, by the names of what they draw.
    cameras
        The camera of each measured frame.
    warmup
        Number of frames that each draws with the first camera before measuring begins.
    advance
        Called after each measured frame.
    pictured
        Numbers of the frames whose pictures are kept.

    Returns
    -------
    list[Run]
        The times, and what was drawn, of each renderer.
    """
    timed = [_TimedRenderer(name, headless) for name, headless in drawn.items()]
    for renderer in timed:
        for _ in range(warmup):
            renderer.draw(cameras[0])
        renderer.begin()
    for number, camera in enumerate(cameras):
        first = number % len(timed)  # rotate the order, so that none always follows the same one
        for renderer in timed[first:] + timed[:first]:
            renderer.note(camera, number in pictured)
            advance()
    for renderer in timed:
        renderer.await_times(cameras[-1])
    return [renderer.run() for renderer in timed]


class _TimedRenderer:
    """Draw the frames of one renderer, and record their times."""

    def __init__(self, name: str, headless: HeadlessRenderer) -> None:
        self._name, self._headless = name, headless
        self._timers = headless.renderer.timers
        self._passes: dict[int, dict[str, float]] = {}  # by the number of the frame, as the timers count
        self._first = 0  # the timers' number of the first measured frame
        self._times: list[float] = []
        self._counts: list[dict[str, int | float]] = []
        self._work: list[dict[str, float]] = []
        self._pixels: list[NDArray[np.int64]] = []
        self._pictures: dict[int, bytes] = {}

    def draw(self, camera: Camera) -> float:
        """Draw a frame, and return its time, milliseconds."""
        start = time.perf_counter()
        self._headless.draw(View(camera, self._headless.size))
        self._headless.finish()
        elapsed = (time.perf_counter() - start) * 1e3
        self._passes[self._timers.of_frame] = self._timers.milliseconds
        return elapsed

    def begin(self) -> None:
        """Start measuring with the next frame."""
        self._first = self._timers.frame
        self._timers.time_next()

    def note(self, camera: Camera, pictured: bool) -> None:
        """Draw a frame and record its time and work; keep its picture if it is `pictured`."""
        live = self._headless.device.live
        programs = live["program"]
        with _garbage_clock() as collected:
            began = time.process_time()
            self._times.append(self.draw(camera))
            busy = (time.process_time() - began) * 1e3
        plan = self._headless.renderer.plan
        assert plan is not None  # `draw` made it
        self._counts.append(plan.counts)
        self._pixels.append(self._headless.pixel_counts())
        steps = {f"{name}_ms": spent for name, spent in self._timers.by_clock.items()}
        done = {"garbage_ms": sum(collected), "processor_ms": busy, "programs": live["program"] - programs}
        self._work.append(plan.counts | steps | done)
        if pictured:
            picture = np.ascontiguousarray(self._headless.pixels()[..., :3])
            self._pictures[len(self._times) - 1] = png_bytes(picture)

    def await_times(self, camera: Camera) -> None:
        """Draw until the times of all measured frames are known."""
        while self._timers.awaited(self._first + len(self._times) - 1):
            self.draw(camera)

    def run(self) -> Run:
        """Return the measurements."""
        frames, pixels = len(self._times), np.array(self._pixels)
        work = _columns(self._work)
        passes = {
            number: self._passes[self._first + number]
            for number in range(frames)
            if self._first + number in self._passes
        }
        drained = self._timers.kind == "finish"
        undisturbed = [n for n in range(frames) if not (drained and n in passes)] or list(range(frames))
        means = {key: float(np.mean(column)) for key, column in _columns(self._counts).items()}
        return Run(
            representation=self._name,
            frames=frames,
            frame_ms=spread([self._times[n] for n in undisturbed]),
            passes_ms={key: spread(column) for key, column in _columns(list(passes.values())).items()},
            counts={key: round(value, 3) for key, value in (means | shares(pixels.sum(0))).items()},
            slowest=slowest_frames(self._times, work, undisturbed),
            frame_times=tuple(round(spent, 3) for spent in self._times),
            trace=Trace(work=work, passes=passes, pixels=pixels.tolist(), pictures=self._pictures),
        )


@contextmanager
def _garbage_clock() -> Iterator[list[float]]:
    """Yield a list of the durations of Python's garbage collections within the `with` block, milliseconds."""
    spent: list[float] = []
    began = 0.0

    def watch(phase: str, info: dict[str, int]) -> None:
        nonlocal began
        if phase == "start":
            began = time.perf_counter()
        else:
            spent.append((time.perf_counter() - began) * 1e3)

    gc.callbacks.append(watch)
    try:
        yield spent
    finally:
        gc.callbacks.remove(watch)


def spread(milliseconds: Sequence[float]) -> Spread:
    """Summarise n ≥ 1 times in `milliseconds`, rounded to a microsecond."""
    p50, p95, p99 = np.percentile(milliseconds, (50, 95, 99))
    values = {"p50": p50, "p95": p95, "p99": p99, "max": np.max(milliseconds), "mean": np.mean(milliseconds)}
    return Spread(**{name: round(float(value), 3) for name, value in values.items()})


def _columns(rows: Sequence[dict[str, float]]) -> dict[str, list[float]]:
    """Return the values of each key over all rows; a missing key counts as 0."""
    columns: dict[str, list[float]] = defaultdict(lambda: [0.0] * len(rows))
    for i, row in enumerate(rows):
        for key, value in row.items():
            columns[key][i] = value
    return dict(columns)
