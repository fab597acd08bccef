"""Time per pass: timer queries on a GPU, `finish` and the clock on a software rasteriser, where queries lie."""

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl

from depthwalk.gpu.device import Device

_FRAMES_IN_FLIGHT = 4  # a query is read this many frames after it was issued, when its result no longer blocks


class PassTimers:
    """Milliseconds per named pass of the newest frame whose times are known; of what a frame does repeatedly, the sum.

    kind: "gpu" (timer queries) or "finish" (the pipeline is drained around each pass, so the sum is the frame).
    """

    def __init__(self, device: Device) -> None:
        self._context = device.context
        self.kind = "finish" if device.software else "gpu"
        self.milliseconds: dict[str, float] = {}
        self._frame: list[tuple[str, float | moderngl.Query]] = []
        self._pending: deque[list[tuple[str, float | moderngl.Query]]] = deque()
        self._spare: list[moderngl.Query] = []  # queries are used again: moderngl cannot release one

    @contextmanager
    def measure_cpu(self, name: str) -> Iterator[None]:
        """Time of work that issues no GL commands, by the clock."""
        start = time.perf_counter()
        yield
        self._frame.append((name, (time.perf_counter() - start) * 1e3))

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Time of work that is GL commands, as `kind` says."""
        if self.kind == "gpu":
            query = self._spare.pop() if self._spare else self._context.query(time=True)
            with query:
                yield
            self._frame.append((name, query))
        else:
            start = time.perf_counter()
            yield
            self._context.finish()
            self._frame.append((name, (time.perf_counter() - start) * 1e3))

    @property
    def pending(self) -> int:
        """Frames that were drawn and whose times are not known yet."""
        return len(self._pending)

    def end_frame(self) -> None:
        """Publishes the times of this frame, or on a GPU of one a few frames ago."""
        self._pending.append(self._frame)
        self._frame = []
        if self.kind == "finish" or len(self._pending) > _FRAMES_IN_FLIGHT:
            self._publish()

    def _publish(self) -> None:
        times: dict[str, float] = {}
        for name, value in self._pending.popleft():
            if isinstance(value, float):
                spent = value
            else:
                spent = value.elapsed / 1e6
                self._spare.append(value)
            times[name] = times.get(name, 0.0) + spent
        self.milliseconds = times
