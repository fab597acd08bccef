"""Hold what `depthwalk quality` finds: values, their goals, and pictures."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from operator import ge, le

from depthwalk.pictures import png_bytes
from depthwalk.quality.metrics import flip_colours
from depthwalk.types import Picture


@dataclass(frozen=True, kw_only=True)
class Row:
    """Hold a value.

    Attributes
    ----------
    subject
        What was looked at.
    name
        What was measured of it.
    digits
        Shown after the decimal point.
    goal
        What it must reach; None where nothing is asked.
    details
        Other values of the same pictures, by name.
    pictures
        PNG files, by caption.
    """

    subject: str
    name: str
    measured: float
    goal: float | None = None
    more_is_better: bool = True
    digits: int = 1
    details: Mapping[str, float] = field(default_factory=dict)
    pictures: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def reached(self) -> bool | None:
        """Whether the goal is reached; None where there is none. What is not a number reaches none."""
        return None if self.goal is None else bool((ge if self.more_is_better else le)(self.measured, self.goal))


def side_by_side(name: str, shown: Picture, truth: Picture) -> dict[str, bytes]:
    """Return PNG files of a picture (H, W, 3), of the truth, and of their difference, by caption."""
    pictures = {name: shown, "truth": truth, "difference (FLIP, dark is equal)": flip_colours(truth, shown)}
    return {caption: png_bytes(picture) for caption, picture in pictures.items()}
