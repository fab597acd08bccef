"""Describe the body of a viewer who walks."""

from dataclasses import dataclass

RADIUS = 0.25  # metres
STEP = 0.35  # metres
FOOT = 0.08  # metres: this far around the centre, the feet find a surface to stand on
ABOVE_EYES = 0.1  # metres


@dataclass(frozen=True, kw_only=True)
class Body:
    """Describe an upright cylinder around a viewer.

    Attributes
    ----------
    eye_height
        Height of the eyes above the feet, metres.
    radius
        Radius of the cylinder, metres.
    step
        Height of the cylinder's lower end above the feet, metres: surfaces up to this height are stepped on.
    """

    eye_height: float
    radius: float = RADIUS
    step: float = STEP

    @property
    def top(self) -> float:
        """Return the height of the cylinder's upper end above the feet, metres."""
        return max(self.eye_height + ABOVE_EYES, self.step)
