"""Meso-structure: a tiling depth image that modulates the depth of an object's images (Liu et al. 2007, §3.4)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

# Relief straight below a face is taken by surfaces by the cosines of two angles: that to the face's outward direction,
# from the least on over so much, and that to the axis, up to the most.
SQUARE_LEAST, SQUARE_RANGE = 0.7, 0.25
WOUND_MOST, WOUND_RANGE = 0.7, 0.4


@dataclass(frozen=True)
class Meso:
    """One tile, row 0 at the bottom.

    relief: (H, W, 3) float32: depth below the object's surface, metres from 0 to `height`, and its slope to the right
            and upward, metres per metre.
    tile:   its width and height on the object, metres.
    """

    relief: NDArray[np.float32]
    tile: tuple[float, float]
    height: float

    def tiles_per_turn(self, radius: float) -> int:
        """Tiles round a cylinder: the whole number that comes closest to their width."""
        return max(1, round(2 * np.pi * radius / self.tile[0]))


def tiling_slopes(depth: Array, tile: tuple[float, float]) -> NDArray[np.float32]:
    """Central differences (H, W, 2) of a tile's depth (H, W), to the right and upward, across its edges."""
    slopes = [
        (np.roll(depth, -1, axis) - np.roll(depth, 1, axis)) * (depth.shape[axis] / (2 * extent))
        for axis, extent in ((1, tile[0]), (0, tile[1]))
    ]
    return np.stack(slopes, -1).astype(np.float32)


def straight_share(normal: Array, outward: Array, from_axis: Array) -> Array:
    """How much (…) of the relief straight below a face surfaces with unit normals (…, 3) take: all where they face
    `outward` (…, 3), as that does, and none where they face along `from_axis` (…, 3), for they have what winds round
    the axis."""
    square = (np.einsum("...i,...i->...", normal, outward) - SQUARE_LEAST) / SQUARE_RANGE
    wound = np.abs(np.einsum("...i,...i->...", normal, from_axis))
    return np.asarray(np.clip(square, 0, 1) * np.clip((WOUND_MOST - wound) / WOUND_RANGE, 0, 1))
