"""Reduce pictures and bound the circles of confusion near each pixel, as the twin of shaders/dof.

`ranges` mirrors tiles.frag and spread.frag (McGuire et al. 2012, "A Reconstruction Filter for Plausible Motion Blur"),
`reduced` mirrors reduce.frag. Pictures and circles of confusion are as in `reference.dof`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.view.lens import EVEN, LEAST_HALF, LEAST_QUARTER, LEAST_STEP, ONE_SURFACE, SHARP_RADIUS, TileClass
from depthwalk.types import Array


def ranges(circles: Array, tile: int) -> Array:
    """Return the least and the greatest circle of confusion that may reach into each pixel's tile.

    The two bound the part of the depth buffer through which `gather` traces its rays. The picture is divided into
    square tiles. A tile counts its own circles, and those of other tiles that are larger than the gap between the two.

    Parameters
    ----------
    circles
        (H, W) radii, pixels, negative before the focus.
    tile
        Edge of a tile, pixels.

    Returns
    -------
    Array
        (2, H, W) radii, pixels, with their signs: the least, and the greatest.
    """
    height, width = circles.shape
    rows, columns = np.arange(0, height, tile), np.arange(0, width, tile)
    extremes = np.stack([cut.reduceat(cut.reduceat(circles, rows, 0), columns, 1) for cut in (np.minimum, np.maximum)])
    y, x = (grid.ravel() for grid in np.mgrid[: len(rows), : len(columns)])
    apart = np.maximum(np.abs(np.stack([y[:, None] - y, x[:, None] - x])) - 1, 0) * tile
    gap = np.hypot(*apart)  # (tiles, tiles)
    low, high = extremes.reshape(2, -1)
    own = np.eye(len(y), dtype=bool)
    least = np.where(own | (-low > gap), low, np.inf).min(1)
    greatest = np.where(own | (high > gap), high, -np.inf).max(1)
    spread = np.stack([least, greatest]).reshape(extremes.shape)
    return spread.repeat(tile, 1).repeat(tile, 2)[:, :height, :width]


@dataclass(frozen=True, kw_only=True)
class Reduced:
    """Hold a picture each of whose pixels stands for a square block of the whole picture's.

    Attributes
    ----------
    block
        Pixels of the whole picture along one of its pixels.
    lit
        (h, w, 4) linear, premultiplied: the mean of the surface that covers most of a block.
    circles
        (h, w) radii of that surface, pixels of the whole picture.
    least, greatest
        (h, w) the extremes of the circles in a block, pixels of the whole picture.
    """

    block: int
    lit: Array
    circles: Array
    least: Array
    greatest: Array


def reduced(picture: Reduced) -> Reduced:
    """Return `picture` at half of its width and height, rounded up; mirrors reduce.frag."""
    height, width = picture.circles.shape
    rows = [np.minimum(np.arange(0, height, 2) + k, height - 1) for k in (0, 1)]
    columns = [np.minimum(np.arange(0, width, 2) + k, width - 1) for k in (0, 1)]

    def blocks(image: Array) -> Array:
        return np.stack([image[np.ix_(y, x)] for y in rows for x in columns])

    found = blocks(picture.circles)
    low, high = found.min(0), found.max(0)
    farther = found >= np.where(high - low < ONE_SURFACE, low, 0.5 * (low + high))
    weight = (farther == (farther.sum(0) > 2)).astype(float)
    weight /= weight.sum(0)
    return Reduced(
        block=2 * picture.block,
        lit=(weight[..., None] * blocks(picture.lit)).sum(0),
        circles=(weight * found).sum(0),
        least=blocks(picture.least).min(0),
        greatest=blocks(picture.greatest).max(0),
    )


def tile_classes(quarter: Reduced, tile: int) -> NDArray[np.intp]:
    """Return the `TileClass` of each tile; mirrors tiles.frag, spread.frag and classes.frag.

    Parameters
    ----------
    quarter
        The picture at a quarter of its width and height.
    tile
        Edge of a tile, pixels of the whole picture.

    Returns
    -------
    NDArray[np.intp]
        (rows, columns) bits, row 0 at the bottom.
    """
    low, high = quarter.least, quarter.greatest
    least, greatest = low.copy(), high.copy()
    for axis in (0, 1):
        count = low.shape[axis]
        beside = np.minimum(np.arange(count) + 1, count - 1)
        least = np.minimum(least, low.take(beside, axis))
        greatest = np.maximum(greatest, high.take(beside, axis))
    side = tile // quarter.block
    starts = [np.arange(0, size, side) for size in low.shape]

    def of_tiles(cut: np.ufunc, image: Array) -> Array:
        return np.asarray(cut.reduceat(cut.reduceat(image, starts[0], 0), starts[1], 1))

    step = of_tiles(np.maximum, greatest - least).ravel()
    low, high = of_tiles(np.minimum, low), of_tiles(np.maximum, high)
    shape, (y, x) = low.shape, (grid.ravel() for grid in np.mgrid[: low.shape[0], : low.shape[1]])
    low, high = low.ravel(), high.ravel()
    gap = np.hypot(*(np.maximum(np.abs(np.stack([y[:, None] - y, x[:, None] - x])) - 1, 0) * tile))
    reach = np.maximum(-low, high)
    around = np.maximum(reach, reach[:, None]) >= gap
    own = np.eye(len(y), dtype=bool)
    nearest = np.where(own | (-low > gap), low, np.inf).min(1)
    farthest = np.where(own | (high > gap), high, -np.inf).max(1)
    smallest = np.maximum(np.where(around, low, np.inf).min(1), -np.where(around, high, -np.inf).max(1))
    smallest = np.maximum(smallest, 0)
    even = np.where(around, step, -np.inf).max(1) <= np.maximum(LEAST_STEP, EVEN * smallest)
    kinds = [
        (np.maximum(-nearest, farthest) < SHARP_RADIUS, TileClass.SHARP, TileClass.SHARP),
        (smallest >= LEAST_QUARTER, TileClass.QUARTER_EVEN, TileClass.QUARTER),
        (smallest >= LEAST_HALF, TileClass.HALF_EVEN, TileClass.HALF),
        (np.ones(len(y), bool), TileClass.EVEN, TileClass.MIXED),
    ]
    chosen = np.select([where for where, _, _ in kinds], [np.where(even, a, b) for _, a, b in kinds])
    return np.asarray(chosen.reshape(shape), np.intp)
