"""Define pictures of a mesh from many directions, from which octahedral impostors and billboards are drawn."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.view_directions import azimuth_directions, octahedral_directions
from depthwalk.ingest.mesh import Reflection

CAPTURE_VERSION = 1
"""Version of the capture's results: raise it when they change for the same parameters."""


Directions = Literal["sphere", "hemisphere", "azimuths"]


@dataclass(frozen=True, kw_only=True)
class CaptureParams:
    """Set the directions from which an object is captured, and the resolution.

    Attributes
    ----------
    directions
        A grid over the sphere, a grid over its upper half, or a circle around the object at half its height.
    count
        Directions along a side of the grid, or on the circle.
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
        """Return the number of pictures."""
        return self.count if self.directions == "azimuths" else self.count**2


@dataclass(frozen=True, kw_only=True)
class CapturedViews:
    """Hold n square pictures of an object, orthographic, of `resolution` texels a side, lower row first.

    Attributes
    ----------
    centre
        (3,) float32, metres, asset frame: centre of the bounding box and of every picture.
    half_size
        (3,) float32, half the edges of that box, metres.
    radius
        Radius of the sphere about the centre that encloses the object, metres: half the width of each picture.
    colour
        (n, resolution, resolution, 4) uint8: square root of the linear colour; 255 in alpha where the object is.
    surface
        (n, resolution, resolution, 4) uint8: unit normal from −1 to 1, asset frame, and depth, 0 at the near end of the
        sphere and 255 at its far end.
    specular
        Strength of highlights, averaged over the pictures.
    shininess
        Phong exponent, averaged over the mesh; 0 for a mesh that is shown without light.
    reflection
        How the mesh reflects the sky, on average; None: not at all.
    """

    centre: NDArray[np.float32]
    half_size: NDArray[np.float32]
    radius: float
    colour: NDArray[np.uint8]
    surface: NDArray[np.uint8]
    specular: float
    shininess: float
    reflection: Reflection | None = None

    @property
    def is_unlit(self) -> bool:
        """Return whether the object is shown without light."""
        return self.shininess == 0
