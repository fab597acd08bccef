"""Draw in slices: a few steps of the work at a time, between which the window shows something."""

import time
from collections.abc import Iterator

from depthwalk.gpu.device import Device

_LONGEST = 2  # times as long as in the settings


class Slices:
    """Draw one thing at a time in slices, waiting for the GPU after each step.

    Parameters
    ----------
    device
        The GPU that draws.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._steps: Iterator[str] | None = None

    @property
    def is_drawing(self) -> bool:
        """Return whether something is in progress."""
        return self._steps is not None

    def begin(self, steps: Iterator[str]) -> None:
        """Begin a sequence of steps, executed by advancing `steps`; discard one in progress."""
        self._steps = steps

    def drop(self) -> None:
        """Discard what is in progress."""
        self._steps = None

    def advance(self, seconds: float) -> bool:
        """Continue for about `seconds`, until the first step that ends later; return whether all are finished."""
        assert self._steps is not None
        end = time.perf_counter() + seconds
        while next(self._steps, None) is not None:
            self._device.context.finish()
            if time.perf_counter() > end:
                return False
        self._steps = None
        return True


class FrameSlices(Slices):
    """Draw frame after frame in slices, and learn from each how long the steps of the next will take.

    Attributes
    ----------
    delay
        Seconds from beginning to end of the last frame, including everything shown meanwhile; 0 before the first.
    """

    def __init__(self, device: Device) -> None:
        super().__init__(device)
        self.delay = 0.0
        self._spent = 0.0  # s of work for this frame, in earlier slices
        self._began = 0.0  # time at which it began
        self._slice_began = 0.0  # time at which the slice began
        self._costs: list[float] = []  # s of each step of the last frame
        self._step = 0  # number of steps of this frame

    def begin(self, steps: Iterator[str]) -> None:
        """Begin a frame; discard one in progress."""
        super().begin(steps)
        self._spent, self._step, self._began = 0.0, 0, time.perf_counter()

    def advance(self, seconds: float) -> bool:
        """Continue with the frame for about `seconds`; return whether its last step is done. Then call `end`.

        The slice ends when the next step, judged by the previous frame, would end too late. If that frame had no such
        step, the next step is assumed to take as long as the last one.
        """
        assert self._steps is not None
        self._slice_began = last = time.perf_counter()
        while next(self._steps, None) is not None:
            self._device.context.finish()
            now = time.perf_counter()
            spent = now - last
            self._costs[self._step : self._step + 1] = [spent]
            self._step, last = self._step + 1, now
            coming = self._costs[self._step] if self._step < len(self._costs) else spent
            if now - self._slice_began + coming > seconds:
                self._spent += now - self._slice_began
                return False
        self._steps = None
        return True

    def end(self) -> float:
        """Record that the frame, and everything done for it, is finished; return the seconds of work for it."""
        now = time.perf_counter()
        self.delay = now - self._began
        return self._spent + now - self._slice_began


def longest(least: float) -> float:
    """Return how long slices may take when nothing moves, seconds, if the settings say `least`."""
    return _LONGEST * least
