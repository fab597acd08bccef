"""Pull focus: turn the lens smoothly to a new distance."""

import math

from depthwalk.scene.effect_settings import FARTHEST_FOCUS, NEAREST_FOCUS, DofParams

_SETTLING = 0.2  # s in which the rest of the turn falls to 1/e
_ARRIVED = 1e-3  # of the distance


class FocusPull:
    """Turn a lens to a new focus distance over several frames, as the hand of a camera operator does.

    Attributes
    ----------
    target
        The distance to which the lens is turning, metres along the view axis; None while the lens rests.
    """

    def __init__(self) -> None:
        self.target: float | None = None

    def start(self, distance: float) -> None:
        """Begin to turn to `distance`, metres along the view axis, limited to the lens's range; +inf is allowed."""
        self.target = min(max(distance, NEAREST_FOCUS), FARTHEST_FOCUS)

    def advance(self, lens: DofParams, dt: float) -> None:
        """Set the focus distance of `lens` to where it is after `dt` more seconds; do nothing while it rests.

        The reciprocal of the distance decays exponentially to that of the target, because the blur changes evenly with
        the reciprocal.
        """
        if self.target is None:
            return
        left = (1 / lens.focus_distance - 1 / self.target) * math.exp(-dt / _SETTLING)
        if abs(left) * self.target < _ARRIVED:
            lens.focus_distance, self.target = self.target, None
        else:
            lens.focus_distance = 1 / (1 / self.target + left)
