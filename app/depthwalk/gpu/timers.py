"""Measure the time of each pass.

A GPU runs asynchronously: its time is measured by timer queries, whose results arrive some frames later. On a software
rasteriser queries are meaningless, so the pipeline is drained before the clock is read. As that costs time, it is done
in few frames, and not in the first ones, in which shaders are compiled.
"""

import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import cast

import moderngl

from depthwalk.gpu.device import Device

LONGEST_SUBMISSION = 250.0  # ms; the watchdog of Windows kills work of 2 s, and other programs wait until it is done
_FRAMES_IN_FLIGHT = 4  # a query is read this many frames after it was issued, when its result no longer blocks
_FIRST_DRAINED = 3  # earlier frames compile shaders, which later ones do not; a window at rest draws few more
_NOTHING = nullcontext()
_DRAINED_EVERY = 8  # frames, one of which is drained; that takes a tenth longer, as its passes cannot share the cores


def frame_clock(device: Device) -> Callable[[], float]:
    """Return the clock, seconds, for comparing whole frames of `device`.

    For a software rasteriser that is the processor time of all threads, which other programs do not affect.
    """
    return time.process_time if device.software else time.perf_counter


class PassTimers:
    """Measure how long the passes of a frame take.

    Attributes
    ----------
    kind
        "gpu": timer queries in every frame; "finish": the pipeline is drained after each pass of every eighth frame,
        except the first ones, so that the times of the passes add up to that of the frame.
    milliseconds
        Time of each pass, by its name, in the newest frame whose times are known; the sum, if it runs repeatedly.
    by_clock
        Time of each step of `measure_cpu` in the frame that ended last; unlike `milliseconds`, for every frame.
    frame
        The number of the current frame, from 0.
    of_frame
        The number of the frame that `milliseconds` belongs to; −1 before any frame's times are known.
    waited
        Seconds that a GPU was waited for so far in blocks of `waiting`; 0 with "finish".
    busy_waiting
        Seconds of processor time that the drawing thread has spent so far in blocks of `waiting`, where some drivers
        keep a core busy; 0 with "finish".
    """

    def __init__(self, device: Device) -> None:
        """Choose the kind of measurement for `device`: "finish" for a software rasteriser, else "gpu"."""
        self._context = device.context
        self.kind = "finish" if device.software else "gpu"
        self.milliseconds: dict[str, float] = {}
        self.by_clock: dict[str, float] = {}
        self.frame, self.of_frame = 0, -1
        self.busy_waiting = 0.0
        self._next = _FIRST_DRAINED  # the next frame to be drained
        self._measured: list[tuple[str, float | moderngl.Query]] = []
        self._clocked: dict[str, float] = defaultdict(float)
        self.waited = 0.0
        self._pending: deque[tuple[int, list[tuple[str, float | moderngl.Query]]]] = deque()
        self._spare: list[moderngl.Query] = []  # for reuse, as moderngl cannot release queries

    def time_next(self) -> None:
        """Time the passes of the next frame, too."""
        self._next = self.frame

    def measure_cpu(self, name: str) -> AbstractContextManager[object]:
        """Measure a `with` block by the clock; `name` is its key in `milliseconds`.

        If it has GL commands that take the GPU long, or waits for the GPU, see `measure_within` and `waiting`.
        """
        return _ClockBlock(self, name)

    def measure(self, name: str) -> AbstractContextManager[object]:
        """Measure a `with` block of GL commands, as `kind` says; `name` is its key in `milliseconds`."""
        if self.kind == "gpu":
            query = self._spare.pop() if self._spare else self._context.query(time=True)
            self._measured.append((name, query))
            return cast(AbstractContextManager[object], query)
        return self._drained(name) if self._drains else _NOTHING

    @contextmanager
    def _drained(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self._context.finish()
        self._measured.append((name, (time.perf_counter() - start) * 1e3))

    def measure_within(self, name: str) -> AbstractContextManager[object]:
        """Measure GL commands within a block of `measure_cpu` by a query; `name` is its key in `milliseconds`.

        A software rasteriser has none: its work is a part of that block.
        """
        return _NOTHING if self.kind == "finish" else self.measure(name)

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Leave out of the block of `measure_cpu` around it that this `with` block waits for a GPU.

        What that does meanwhile is in the times of the passes, which would be counted twice.
        """
        start, began = time.perf_counter(), time.thread_time()
        yield
        if self.kind == "gpu":
            self.waited += time.perf_counter() - start
            self.busy_waiting += time.thread_time() - began

    def note(self, name: str, milliseconds: float) -> None:
        """Add the time of a step on the CPU."""
        self._measured.append((name, milliseconds))
        self._clocked[name] += milliseconds

    @property
    def _drains(self) -> bool:
        """Return whether the pipeline is drained in this frame."""
        return self.kind == "finish" and self.frame >= self._next

    @property
    def may_be_long(self) -> bool:
        """Return whether a frame may keep a GPU busy for longer than LONGEST_SUBMISSION.

        True until the times of a frame are known; never for a software rasteriser, which no watchdog kills.
        """
        return self.kind == "gpu" and (self.of_frame < 0 or sum(self.milliseconds.values()) > LONGEST_SUBMISSION)

    def awaited(self, frame: int) -> bool:
        """Return whether times of the frame with the number `frame`, or of an earlier one, are still pending."""
        return bool(self._pending) and self._pending[0][0] <= frame

    def end_frame(self) -> None:
        """End the frame, and publish its times or, on a GPU, those of an earlier frame."""
        if self.kind == "gpu" or self._drains:
            self._pending.append((self.frame, self._measured))
            self._next = self.frame + _DRAINED_EVERY
        self._measured = []
        self.by_clock = dict(self._clocked)
        self._clocked.clear()
        self.frame += 1
        if self._pending and (self.kind == "finish" or len(self._pending) > _FRAMES_IN_FLIGHT):
            self._publish()

    def drop_frame(self) -> None:
        """Drop what was measured since the last frame ended, as it belongs to no frame."""
        self._spare += [value for _, value in self._measured if not isinstance(value, float)]
        self._measured = []
        self._clocked.clear()

    def _publish(self) -> None:
        """Set `milliseconds` to the summed times of the oldest pending frame."""
        times: dict[str, float] = {}
        self.of_frame, measured = self._pending.popleft()
        for name, value in measured:
            if isinstance(value, float):
                spent = value
            else:
                spent = value.elapsed / 1e6
                self._spare.append(value)
            times[name] = times.get(name, 0.0) + spent
        self.milliseconds = times


class _ClockBlock(AbstractContextManager[None]):
    """Measure a `with` block for `PassTimers.measure_cpu`. A generator would take twice as long to enter."""

    __slots__ = ("_name", "_start", "_timers", "_waited")

    def __init__(self, timers: PassTimers, name: str) -> None:
        self._timers, self._name = timers, name

    def __enter__(self) -> None:
        self._start, self._waited = time.perf_counter(), self._timers.waited

    def __exit__(self, *error: object) -> None:
        waited = self._timers.waited - self._waited
        self._timers.note(self._name, (time.perf_counter() - self._start - waited) * 1e3)
