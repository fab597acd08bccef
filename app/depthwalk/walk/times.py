"""Record how long the last frames took, for the HUD."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

_AVERAGED = 0.5  # s over which the time of a frame is averaged


class FrameTimes:
    """Hold the durations of the last `length` frames."""

    def __init__(self, length: int = 120) -> None:
        self._seconds: deque[float] = deque(maxlen=length)

    def add(self, seconds: float) -> None:
        """Add the duration of a frame in `seconds`."""
        self._seconds.append(seconds)

    @property
    def milliseconds(self) -> NDArray[np.float32]:
        """Return the durations (n,) of the last frames, milliseconds, oldest first."""
        return np.array(self._seconds, np.float32) * 1e3

    @property
    def smoothed(self) -> float:
        """Return the mean duration of frames over about the last half second, seconds; 0 before the first frame."""
        total, count = 0.0, 0
        for seconds in reversed(self._seconds):
            total, count = total + seconds, count + 1
            if total >= _AVERAGED:
                break
        return total / count if count else 0.0


class PictureTimes(FrameTimes):
    """Hold the time from each of the last pictures to the next.

    A picture counts only if the previous iteration of the frame loop showed one too; the first one, and one after a
    rest, do not.
    """

    def __init__(self) -> None:
        super().__init__()
        self._follows = False

    def note(self, seconds: float, *, shows: bool) -> None:
        """Record an iteration of the frame loop.

        Parameters
        ----------
        seconds
            From the beginning of the previous iteration to that of this one.
        shows
            Whether it shows a picture.
        """
        if shows and self._follows:
            self.add(seconds)
        self._follows = shows
