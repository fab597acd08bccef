"""Draw in slices: some steps of the work, as long as there is time, then the window shows something."""

import time
from collections.abc import Iterator

import numpy as np

from depthwalk.gpu.device import Device

_LONGEST = 2  # times as long as the settings say
_TURNED_PAST = 0.1  # of the window, that may lie beyond the margin at the end of a steady turn


class Slices:
    """Draw one thing at a time in slices. Each step is waited for.

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
        """Return whether something has been begun that is not finished yet."""
        return self._steps is not None

    def begin(self, steps: Iterator[str]) -> None:
        """Begin with something, of which every step is what `steps` does next; forget what was begun before."""
        self._steps = steps

    def drop(self) -> None:
        """Forget what has been begun."""
        self._steps = None

    def advance(self, seconds: float) -> bool:
        """Go on for about `seconds`, until the first step that ends later; return whether it is finished."""
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
        Seconds from the beginning to the end of the last frame, with all that was shown meanwhile; 0 before the first.
    """

    def __init__(self, device: Device) -> None:
        super().__init__(device)
        self.delay = 0.0
        self._spent = 0.0  # s of work for this frame, in the slices before this one
        self._began = 0.0  # when it was begun, by the clock
        self._slice_began = 0.0  # likewise
        self._costs: list[float] = []  # s of each step of the last one
        self._step, self._slices = 0, 0  # how many of either there were of this one
        self._between = 0.0  # s from a slice of the last one to the next

    def begin(self, steps: Iterator[str]) -> None:
        """Begin a frame; forget one that was begun before."""
        super().begin(steps)
        self._spent, self._step, self._slices, self._began = 0.0, 0, 0, time.perf_counter()

    def advance(self, seconds: float) -> bool:
        """Go on with the frame for about `seconds`; return whether its last step is done. Then call `end`.

        The last step before the time is over is that after which, judged by the frame before, the next one would end
        too late. Where that frame had no such step, the next one is taken to be as long as the last.
        """
        assert self._steps is not None
        self._slices += 1
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
        """Note that the frame is finished, with all that is done for it; return the seconds of work for it."""
        now = time.perf_counter()
        self.delay = now - self._began
        work = self._spent + now - self._slice_began
        if self._slices > 1:
            self._between = (self.delay - work) / (self._slices - 1)
        return work

    def seconds(self, *, least: float, margin: float, half_width: float, turn_rate: float, work: float) -> float:
        """Return how long a slice may take: longer than the settings say where the viewer turns quickly.

        A frame is shown for as long as the next one takes. In that time the viewer must not turn past the margins, and
        the longer the slices are, the fewer pictures in between delay the frame.

        Parameters
        ----------
        least
            What the settings say, seconds.
        margin
            Part of the picture's width that frames are wider by, at either side.
        half_width
            Tangent of half the horizontal angle of view.
        turn_rate
            How quickly the viewer turns, radians per second.
        work
            Seconds of work for a frame.
        """
        spare = (2 * margin + _TURNED_PAST) * 2 * np.arctan(half_width)  # radians
        most = spare / max(turn_rate, 1e-6)
        wanted = self._between * work / (most - work) if most > work else np.inf
        return float(np.clip(wanted, least, _LONGEST * least))


def longest(least: float) -> float:
    """Return how long slices may take where nothing moves, seconds, if the settings say `least`."""
    return _LONGEST * least
