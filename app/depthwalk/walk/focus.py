"""Pull focus: change the focus distance of the lens smoothly."""

import math

from depthwalk.scene.effect_settings import FARTHEST_FOCUS, NEAREST_FOCUS, DofParams

_SETTLING = 0.2  # s in which the remaining change falls to 1/e
_ARRIVED = 1e-3  # of the distance


class FocusPull:
    """Move a lens to a new focus distance over several frames, as a camera operator does.

    Attributes
    ----------
    target
        The focus distance that the lens is moving to, metres along the view axis; None while the lens rests.
    """

    def __init__(self) -> None:
        self.target: float | None = None

    def start(self, distance: float) -> None:
        """Begin to move to `distance`, metres along the view axis, clamped to the lens's range; +inf is allowed."""
        self.target = min(max(distance, NEAREST_FOCUS), FARTHEST_FOCUS)

    def advance(self, lens: DofParams, dt: float) -> None:
        """Set the focus distance of `lens` to its value after `dt` more seconds; do nothing while it rests.

        The reciprocal of the distance approaches that of the target exponentially, because blur changes linearly with
        the reciprocal.
        """
        if self.target is None:
            return
        left = (1 / lens.focus_distance - 1 / self.target) * math.exp(-dt / _SETTLING)
        if abs(left) * self.target < _ARRIVED:
            lens.focus_distance, self.target = self.target, None
        else:
            lens.focus_distance = 1 / (1 / self.target + left)
