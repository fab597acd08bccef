"""Meso-structure: a tiling depth image that modulates the depth of an object's images (Liu et al. 2007, §3.4)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array

# Relief straight below a face is taken by surfaces by the cosines of two angles: that to the face's outward direction,
# from the least on over so much, and that to the axis, up to the most.
SQUARE_LEAST, SQUARE_RANGE = 0.7, 0.25
WOUND_MOST, WOUND_RANGE = 0.7, 0.4


@dataclass(frozen=True, kw_only=True)
class Meso:
    """Hold one tile of relief that is laid over a surface; row 0 is at the bottom.

    Attributes
    ----------
    relief
        (H, W, 3) float32: depth below the object's surface, metres from 0 to `height`, and its slopes to the right and
        upward, metres per metre.
    tile
        Width and height of the tile on the object, metres.
    height
        The greatest depth, metres.
    """

    relief: NDArray[np.float32]
    tile: tuple[float, float]
    height: float

    def tiles_per_turn(self, radius: float) -> int:
        """Return how many tiles go round a cylinder of `radius` metres, so that their width is about right."""
        return max(1, round(2 * np.pi * radius / self.tile[0]))


def tiling_slopes(depth: Array, tile: tuple[float, float]) -> NDArray[np.float32]:
    """Return the slopes (H, W, 2) of a tile's depth (H, W), to the right and upward, metres per metre.

    They are central differences that go on across the tile's edges; tile: its width and height, metres.
    """
    slopes = [
        (np.roll(depth, -1, axis) - np.roll(depth, 1, axis)) * (depth.shape[axis] / (2 * extent))
        for axis, extent in ((1, tile[0]), (0, tile[1]))
    ]
    return np.stack(slopes, -1).astype(np.float32)


def straight_share(normal: Array, outward: Array, from_axis: Array) -> Array:
    """Return how much (…), 0 to 1, of the relief straight below a planar face its surfaces take.

    It is all where they face outward as the face does, and none where they face away from the axis, since there they
    have the relief that winds round the axis.

    Parameters
    ----------
    normal
        (…, 3) unit normals of the surfaces.
    outward
        (…, 3) unit vectors out of the face.
    from_axis
        (…, 3) unit vectors from the cylinder's axis.
    """
    square = (np.einsum("...i,...i->...", normal, outward) - SQUARE_LEAST) / SQUARE_RANGE
    wound = np.abs(np.einsum("...i,...i->...", normal, from_axis))
    return np.asarray(np.clip(square, 0, 1) * np.clip((WOUND_MOST - wound) / WOUND_RANGE, 0, 1))
