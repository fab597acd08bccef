"""Measure how long frames take."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

_AVERAGED = 0.5  # s, over which the time of a frame is averaged


class FrameTimes:
    """Durations of the last `length` frames."""

    def __init__(self, length: int = 120) -> None:
        self._seconds: deque[float] = deque(maxlen=length)

    def add(self, seconds: float) -> None:
        """Add the duration of a frame."""
        self._seconds.append(seconds)

    @property
    def milliseconds(self) -> NDArray[np.float32]:
        """Durations (n,), oldest first."""
        return np.array(self._seconds, np.float32) * 1e3

    @property
    def smoothed(self) -> float:
        """Mean seconds of a frame over about the last half second; 0 before the first."""
        total, count = 0.0, 0
        for seconds in reversed(self._seconds):
            total, count = total + seconds, count + 1
            if total >= _AVERAGED:
                break
        return total / count if count else 0.0
