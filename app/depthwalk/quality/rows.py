"""Define the results of the parts of `depthwalk quality`: values, goals and pictures; `overview` shows them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from operator import ge, le
from typing import Protocol

from depthwalk.assets.mesh_library import Report
from depthwalk.pictures import png_bytes
from depthwalk.quality.metrics import flip_colours
from depthwalk.scene.scene import Scene
from depthwalk.types import Picture


@dataclass(frozen=True, kw_only=True)
class Row:
    """Hold one measured value.

    Attributes
    ----------
    subject
        Name of the scene or asset that was examined.
    name
        Name of the measured quantity.
    measured
        The value.
    goal
        Value that it must reach; None if there is no goal.
    more_is_better
        Whether larger values are better.
    digits
        Number of digits that are shown after the decimal point.
    details
        Other values of the same pictures, by name.
    pictures
        Contents of PNG files, by caption.
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
        """Return whether the goal is reached, None if there is none; a value that is not a number never reaches one."""
        return None if self.goal is None else bool((ge if self.more_is_better else le)(self.measured, self.goal))


class Examine(Protocol):
    """Measure scenes for one part of `depthwalk quality`."""

    def __call__(self, scenes: Sequence[Scene], size: tuple[int, int], report: Report) -> Iterator[Row]:
        """Measure, and yield one value after the other.

        Parameters
        ----------
        scenes
            The scenes, each seen by its own camera, or only their assets; settings may be changed.
        size
            Width and height of the pictures, pixels.
        report
            Called with the name of a scene or asset and the stage that begins.

        Yields
        ------
        Row
            One measured value.

        Raises
        ------
        InputError
            For assets that cannot be used.
        GpuError
            If no OpenGL 3.3 context can be created.
        """
        ...


def side_by_side(name: str, shown: Picture, truth: Picture) -> dict[str, bytes]:
    """Return PNG files of a picture, of the reference, and of their difference.

    Parameters
    ----------
    name
        Caption of the picture.
    shown
        The picture, (H, W, 3) uint8, sRGB.
    truth
        The reference picture, (H, W, 3) uint8, sRGB.

    Returns
    -------
    dict[str, bytes]
        Contents of three PNG files, by caption.
    """
    pictures = {name: shown, "truth": truth, "difference (FLIP, dark is equal)": flip_colours(truth, shown)}
    return {caption: png_bytes(picture) for caption, picture in pictures.items()}
