"""Meso-structure: a tiling depth image that modulates the depth of an object's images (Liu et al. 2007, §3.4)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


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


def tiling_slopes(depth: NDArray[np.floating], tile: tuple[float, float]) -> NDArray[np.float32]:
    """Central differences (H, W, 2) of a tile's depth (H, W), to the right and upward, across its edges."""
    slopes = [
        (np.roll(depth, -1, axis) - np.roll(depth, 1, axis)) * (depth.shape[axis] / (2 * extent))
        for axis, extent in ((1, tile[0]), (0, tile[1]))
    ]
    return np.stack(slopes, -1).astype(np.float32)
