"""Pulling focus: the lens turns smoothly to what is to be sharp."""

import math

from depthwalk.scene.render_settings import FARTHEST_FOCUS, NEAREST_FOCUS, DofParams

_SETTLING = 0.2  # s in which what is left to turn falls to 1/e
_ARRIVED = 1e-3  # of the distance


class FocusPull:
    """target: where the lens is turning to, metres; None while it rests."""

    def __init__(self) -> None:
        self.target: float | None = None

    def start(self, distance: float) -> None:
        """Turn to `distance`, metres, +inf allowed; as near and as far as the lens goes."""
        self.target = min(max(distance, NEAREST_FOCUS), FARTHEST_FOCUS)

    def advance(self, lens: DofParams, dt: float) -> None:
        """dt: seconds since the last frame. The blur changes evenly where 1/distance does, so that is what falls."""
        if self.target is None:
            return
        left = (1 / lens.focus_distance - 1 / self.target) * math.exp(-dt / _SETTLING)
        if abs(left) * self.target < _ARRIVED:
            lens.focus_distance, self.target = self.target, None
        else:
            lens.focus_distance = 1 / (1 / self.target + left)
