"""Choose how many pixels frames have while the viewer moves, so that none of them takes long."""

STEP = 0.8  # ratio of each scale to the next larger one
LEAST = 5  # most steps down: 0.33 of the scale
_SPARE = 0.8  # part of the limit within which the next larger frame must be expected to stay


class FrameScale:
    """Give frames fewer pixels if they take too long, and more again once there is time.

    A reprojected picture gets worse the older it is: in the garden, 0.2 s of walking and turning make it worse than
    losing a third of its pixels does (docs/experiments.md, "Age or pixels"). The time of a frame is expected to grow at
    most in proportion to its pixels, that is to the square of its scale.

    Attributes
    ----------
    factor
        Factor on the scale of the settings.
    """

    def __init__(self) -> None:
        self._steps = 0

    @property
    def factor(self) -> float:
        """Return the factor on the scale of the settings, `STEP` ** `LEAST` to 1."""
        return float(STEP**self._steps)

    def note(self, seconds: float, limit: float) -> None:
        """Record how long a frame of this scale took.

        Parameters
        ----------
        seconds
            From its beginning to its end, including everything shown meanwhile.
        limit
            Time that it may take, seconds.
        """
        if seconds > limit:
            self._steps = min(self._steps + (2 if seconds > 2 * limit else 1), LEAST)
        elif self._steps and seconds < _SPARE * STEP**2 * limit:
            self._steps -= 1
