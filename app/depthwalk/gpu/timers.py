"""Measure the time of each pass.

A GPU works behind the CPU: its time is measured by timer queries, whose results come some frames later. On a software
rasteriser queries tell nothing true, so the pipeline is drained before the clock is read; and since that costs time, it
is done in few frames. The first frames are none of them: there the pipeline is busy while shaders are compiled.
"""

import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import moderngl

from depthwalk.gpu.device import Device

LONGEST_SUBMISSION = 250.0  # ms; the watchdog of Windows ends what takes 2 s, and other programs wait meanwhile
_FRAMES_IN_FLIGHT = 4  # a query is read this many frames after it was issued, when its result no longer blocks
_FIRST_DRAINED = 3  # those before compile shaders, which tells of no other frame; a window at rest draws few more
_DRAINED_EVERY = 8  # frames, one of which is drained: its passes cannot share the cores, which makes it a tenth longer


def frame_clock(device: Device) -> Callable[[], float]:
    """Return the clock, seconds, by which whole frames of `device` are compared.

    That is the processor time of all threads where a software rasteriser draws, since other programs do not lengthen
    it.
    """
    return time.process_time if device.software else time.perf_counter


class PassTimers:
    """Measure how long the passes of a frame take.

    Attributes
    ----------
    kind
        "gpu": timer queries in every frame; "finish": the pipeline is drained around each pass of every eighth frame,
        but not of the first, so that the times of its passes add up to that of the frame.
    milliseconds
        How long each pass took, by its name, in the newest frame whose times are known; the sum where a frame does a
        pass repeatedly.
    by_clock
        How long each step of `measure_cpu` took in the frame that ended last; unlike `milliseconds`, of every frame.
    frame
        The number of the frame under way, counted from 0.
    of_frame
        The number of the frame that `milliseconds` belongs to; −1 before any frame's times are known.
    """

    def __init__(self, device: Device) -> None:
        """Choose the kind of measurement that suits `device`: "finish" where the CPU does the drawing, else "gpu"."""
        self._context = device.context
        self.kind = "finish" if device.software else "gpu"
        self.milliseconds: dict[str, float] = {}
        self.by_clock: dict[str, float] = {}
        self.frame, self.of_frame = 0, -1
        self._next = _FIRST_DRAINED  # frame to be drained
        self._measured: list[tuple[str, float | moderngl.Query]] = []
        self._clocked: dict[str, float] = defaultdict(float)
        self._pending: deque[tuple[int, list[tuple[str, float | moderngl.Query]]]] = deque()
        self._spare: list[moderngl.Query] = []  # queries are used again: moderngl cannot release one

    def time_next(self) -> None:
        """Make the next frame one of those whose passes are timed."""
        self._next = self.frame

    @contextmanager
    def measure_cpu(self, name: str) -> Iterator[None]:
        """Measure a `with` block that issues no GL commands, by the clock; `name` is its key in `milliseconds`."""
        start = time.perf_counter()
        yield
        milliseconds = (time.perf_counter() - start) * 1e3
        self._measured.append((name, milliseconds))
        self._clocked[name] += milliseconds

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Measure a `with` block of GL commands, as `kind` says; `name` is its key in `milliseconds`."""
        if self.kind == "gpu":
            query = self._spare.pop() if self._spare else self._context.query(time=True)
            with query:
                yield
            self._measured.append((name, query))
            return
        start = time.perf_counter()
        yield
        if self._drains:
            self._context.finish()
            self._measured.append((name, (time.perf_counter() - start) * 1e3))

    @property
    def _drains(self) -> bool:
        """Return whether this frame is one of those in which the pipeline is drained."""
        return self.kind == "finish" and self.frame >= self._next

    @property
    def may_be_long(self) -> bool:
        """Return whether a frame must be expected to keep a GPU busy for longer than LONGEST_SUBMISSION.

        That is so before the times of any frame are known, and never where the CPU does the drawing: nothing is killed
        there.
        """
        return self.kind == "gpu" and (self.of_frame < 0 or sum(self.milliseconds.values()) > LONGEST_SUBMISSION)

    def awaited(self, frame: int) -> bool:
        """Return whether times of the frame with the number `frame`, or of an earlier one, are still to come."""
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
        """Forget what was measured since the last frame ended: it belongs to no frame."""
        self._spare += [value for _, value in self._measured if not isinstance(value, float)]
        self._measured = []
        self._clocked.clear()

    def _publish(self) -> None:
        """Add up the times of the oldest frame that waits, which become `milliseconds`."""
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
