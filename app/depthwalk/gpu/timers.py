"""Time per pass: timer queries on a GPU, `finish` and the clock on a software rasteriser, where queries lie."""

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl

from depthwalk.gpu.device import Device

_FRAMES_IN_FLIGHT = 4  # a query is read this many frames after it was issued, when its result no longer blocks
_EVERY = 8  # frames, of which one is drained: its passes cannot share the cores, which makes it a tenth longer


class PassTimers:
    """Milliseconds per named pass of the newest frame whose times are known; of what a frame does repeatedly, the sum.

    kind: "gpu" (timer queries in every frame) or "finish" (the pipeline is drained around each pass of every eighth
    frame, so the sum is the frame); frame: the number of the one under way; of_frame: of that whose times these are.
    """

    def __init__(self, device: Device) -> None:
        self._context = device.context
        self.kind = "finish" if device.software else "gpu"
        self.milliseconds: dict[str, float] = {}
        self.frame, self.of_frame = 0, -1
        self._next = 0  # frame to be drained
        self._measured: list[tuple[str, float | moderngl.Query]] = []
        self._pending: deque[tuple[int, list[tuple[str, float | moderngl.Query]]]] = deque()
        self._spare: list[moderngl.Query] = []  # queries are used again: moderngl cannot release one

    def time_next(self) -> None:
        """The next frame is one of those whose passes are timed."""
        self._next = self.frame

    @contextmanager
    def measure_cpu(self, name: str) -> Iterator[None]:
        """Time of work that issues no GL commands, by the clock."""
        start = time.perf_counter()
        yield
        self._measured.append((name, (time.perf_counter() - start) * 1e3))

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Time of work that is GL commands, as `kind` says."""
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
        return self.kind == "finish" and self.frame >= self._next

    def awaited(self, frame: int) -> bool:
        """Whether times of frames up to that one are still to come: a few frames later, for queries."""
        return bool(self._pending) and self._pending[0][0] <= frame

    def end_frame(self) -> None:
        """Publishes the times of this frame, or on a GPU of one a few frames ago."""
        if self.kind == "gpu" or self._drains:
            self._pending.append((self.frame, self._measured))
            self._next = self.frame + _EVERY
        self._measured = []
        self.frame += 1
        if self._pending and (self.kind == "finish" or len(self._pending) > _FRAMES_IN_FLIGHT):
            self._publish()

    def _publish(self) -> None:
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
