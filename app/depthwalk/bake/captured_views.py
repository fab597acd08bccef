"""Hold pictures of a mesh from many directions, which octahedral impostors and billboards are drawn from."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.view_directions import azimuth_directions, octahedral_directions

CAPTURE_VERSION = 1
"""What capturing yields for the same parameters: to be raised where it changes."""


Directions = Literal["sphere", "hemisphere", "azimuths"]


@dataclass(frozen=True, kw_only=True)
class CaptureParams:
    """Say from where an object is captured, and how finely.

    Attributes
    ----------
    directions
        Whether from a grid over the sphere, over its upper half, or from all around at the height of the middle.
    count
        Directions along a side of that grid; all around, how many there are.
    resolution
        Width and height of each picture, texels.
    """

    directions: Directions
    count: int
    resolution: int

    def unit_vectors(self) -> NDArray[np.float64]:
        """Return the directions (n, 3) from the object to the viewer, asset frame."""
        if self.directions == "azimuths":
            return azimuth_directions(self.count)
        return octahedral_directions(self.count, self.directions == "hemisphere")

    @property
    def views(self) -> int:
        """Return how many pictures there are."""
        return self.count if self.directions == "azimuths" else self.count**2


@dataclass(frozen=True, kw_only=True)
class CapturedViews:
    """Hold n square pictures of an object, orthographic, of `resolution` texels a side, lower row first.

    Attributes
    ----------
    centre
        (3,) float32, metres, asset frame: middle of the bounding box, and of all pictures.
    half_size
        (3,) float32, half the edges of that box, metres.
    radius
        Of the sphere about the centre that encloses the object, metres: half the width of each picture.
    colour
        (n, resolution, resolution, 4) uint8: square root of the linear colour, and 255 where the object is.
    surface
        (n, resolution, resolution, 4) uint8: unit normal from −1 to 1, asset frame, and depth, 0 at the near end of the
        sphere and 255 at its far end.
    specular
        Strength of highlights, mean over what the pictures show.
    shininess
        Phong exponent, mean over the mesh.
    """

    centre: NDArray[np.float32]
    half_size: NDArray[np.float32]
    radius: float
    colour: NDArray[np.uint8]
    surface: NDArray[np.uint8]
    specular: float
    shininess: float
