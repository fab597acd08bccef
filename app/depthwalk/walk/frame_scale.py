"""Choose how many pixels frames have while the viewer moves, so that none of them takes long."""

STEP = 0.8  # of the scale, from one to the next
LEAST = 5  # steps down at most: 0.33 of the scale
_SPARE = 0.8  # part of the limit that the next larger frame must be expected to stay within


class FrameScale:
    """Make frames that took too long smaller, and larger again once there is time.

    A picture that is moved to the viewer is the worse the older it is: in the garden, 0.2 s of walking and turning cost
    more than a third of the pixels do (docs/walking.md, "Age or pixels"). What a frame takes is expected to
    grow with its pixels, that is with the square of its scale, at most.

    Attributes
    ----------
    factor
        What the scale of the settings is multiplied by.
    """

    def __init__(self) -> None:
        self._steps = 0

    @property
    def factor(self) -> float:
        """Return what the scale of the settings is to be multiplied by, `STEP` ** `LEAST` to 1."""
        return float(STEP**self._steps)

    def note(self, seconds: float, limit: float) -> None:
        """Note how long a frame of this scale took.

        Parameters
        ----------
        seconds
            From its beginning to its end, with all that was shown meanwhile.
        limit
            Seconds that it may take.
        """
        if seconds > limit:
            self._steps = min(self._steps + (2 if seconds > 2 * limit else 1), LEAST)
        elif self._steps and seconds < _SPARE * STEP**2 * limit:
            self._steps -= 1
