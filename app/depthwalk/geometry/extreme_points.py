"""Select the few points of a set that extend farthest, so that repeated queries about its extent are cheap."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array

_COUNT = 512  # directions, 5° apart: the selected points extend as far as all points to within 0.5 %
_PRODUCTS = 1 << 16  # computed at a time: for 2¹⁸ multiplications, three each, OpenBLAS would wake its threads


def extreme_points(points: Array) -> NDArray[np.float64]:
    """Return the points that extend farthest in directions spread evenly over the sphere.

    The convex hull of the result is a little smaller than that of the points: no direction's extent shrinks by more
    than 0.5 % of the set's size.

    Parameters
    ----------
    points
        (n, 3) in any unit and frame.

    Returns
    -------
    numpy.ndarray
        (k, 3) float64, k ≤ 512; all of them if n ≤ 512.
    """
    if len(points) <= _COUNT:
        return points.astype(np.float64)
    found, _ = farthest(points, spread_directions(_COUNT))
    return points[np.unique(found)].astype(np.float64)


def farthest(points: Array, directions: Array) -> tuple[NDArray[np.int64], Array]:
    """Find which of some points extends farthest in each direction.

    Parameters
    ----------
    points
        (n, 3) at least one, in any unit and frame.
    directions
        (m, 3) of any length.

    Returns
    -------
    tuple
        (m,) rows of the points, the first of several that are equally far; and (m,) their products with the directions.
    """
    found, reach = np.zeros(len(directions), np.int64), np.full(len(directions), -np.inf)
    block = max(_PRODUCTS // max(len(directions), 1), 1)
    for start in range(0, len(points), block):
        along = directions @ points[start : start + block].T  # a row for each direction, since rows are searched faster
        best = along.argmax(1)
        value = along[np.arange(len(directions)), best]
        farther = value > reach
        reach[farther], found[farther] = value[farther], start + best[farther]
    return found, reach


def spread_directions(count: int) -> NDArray[np.float32]:
    """Return unit vectors (count, 3) on a Fibonacci lattice (González 2010, "Measurement of areas on a sphere")."""
    number = np.arange(count) + 0.5
    height, turn = 1 - 2 * number / count, np.pi * (1 + np.sqrt(5)) * number
    ring = np.sqrt(1 - height**2)
    return np.stack([ring * np.cos(turn), height, ring * np.sin(turn)], -1).astype(np.float32)
