"""Define meso-structure: a tiling depth image that changes the depth of an object's images (Liu et al. 2007, §3.4)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array

# How much of the relief straight below a face applies to a surface depends on two cosines of its normal: with the
# face's outward direction (rising from LEAST over RANGE) and with the direction from the axis (falling to 0 at MOST).
SQUARE_LEAST, SQUARE_RANGE = 0.7, 0.25
WOUND_MOST, WOUND_RANGE = 0.7, 0.4


@dataclass(frozen=True, kw_only=True)
class Meso:
    """Hold one tile of relief that repeats over a surface; row 0 is at the bottom.

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
        """Return how many tiles go round a cylinder of `radius` metres while keeping about their width."""
        return max(1, round(2 * np.pi * radius / self.tile[0]))


def tiling_slopes(depth: Array, tile: tuple[float, float]) -> NDArray[np.float32]:
    """Return the slopes of a repeating tile: central differences that continue across its edges.

    Parameters
    ----------
    depth
        (H, W) metres, row 0 at the bottom.
    tile
        Width and height of the tile, metres.

    Returns
    -------
    numpy.ndarray
        (H, W, 2) float32, to the right and upward, metres per metre.
    """
    slopes = [
        (np.roll(depth, -1, axis) - np.roll(depth, 1, axis)) * (depth.shape[axis] / (2 * extent))
        for axis, extent in ((1, tile[0]), (0, tile[1]))
    ]
    return np.stack(slopes, -1).astype(np.float32)


def straight_share(normal: Array, outward: Array, from_axis: Array) -> Array:
    """Return how much of a planar face's relief moves its samples straight inward, rather than toward the axis.

    The share is 1 where a surface faces outward like the face, and 0 where it faces away from the axis, since the
    relief wound around the axis moves that surface.

    Parameters
    ----------
    normal
        (…, 3) unit normals of the surfaces, object frame.
    outward
        (…, 3) unit vectors out of the face, object frame.
    from_axis
        (…, 3) unit vectors from the cylinder's axis to the surfaces, object frame.

    Returns
    -------
    numpy.ndarray
        (…) shares, 0 to 1.
    """
    square = (np.einsum("...i,...i->...", normal, outward) - SQUARE_LEAST) / SQUARE_RANGE
    wound = np.abs(np.einsum("...i,...i->...", normal, from_axis))
    return np.asarray(np.clip(square, 0, 1) * np.clip((WOUND_MOST - wound) / WOUND_RANGE, 0, 1))
