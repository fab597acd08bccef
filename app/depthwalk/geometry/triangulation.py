"""Cut polygons into triangles: fans, or by their ears where a fan would leave the polygon."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Ints

# What cutting may take, in corners that are looked at, some 50 ns each, and what testing one corner costs beside them.
# Polygons beyond it are cut into fans.
_MOST_WORK, _WORK_PER_CORNER, _WORK_PER_TEST = 20_000_000, 1_000, 500
_ROWS_AT_ONCE = 1 << 18  # triangles whose normals are compared at once, which bounds the memory
_FLAT = 1e-6  # part of a polygon's area: a triangle that turns back by less does so since coordinates are rounded


def triangulated(positions: NDArray[np.float64], sizes: Ints) -> tuple[Ints, Ints]:
    """Cut polygons into triangles.

    Parameters
    ----------
    positions
        (C, 3) places of the corners of all polygons, one polygon after the other.
    sizes
        (P,) corners of each polygon.

    Returns
    -------
    (F, 3) the corners of each triangle, rows of `positions`, turning as the polygon does; and (F,) its polygon.
    """
    fans = np.maximum(sizes - 2, 0)
    polygon = np.repeat(np.arange(len(fans)), fans)
    first_triangle = np.cumsum(fans) - fans
    step = np.arange(len(polygon)) - first_triangle[polygon]
    starts = np.cumsum(sizes) - sizes
    start = starts[polygon]
    triangles = np.stack([start, start + step + 1, start + step + 2], axis=1)
    cut_concave(positions, triangles, polygon, sizes)
    return triangles, polygon


def cut_concave(positions: NDArray[np.float64], triangles: Ints, polygon: Ints, sizes: Ints) -> None:
    """Replace the fans of concave polygons, which would leave the polygon, by triangles within it.

    Parameters
    ----------
    positions
        (C, 3) places of the corners of all polygons, one polygon after the other.
    triangles
        (F, 3) the corners of each triangle of the fans, rows of `positions`, those of a polygon one after the other;
        changed in place.
    polygon
        (F,) the polygon of each triangle, ascending.
    sizes
        (P,) corners of each polygon.
    """
    if not (sizes > 3).any():
        return
    starts = np.cumsum(sizes) - sizes
    fans = np.maximum(sizes - 2, 0)
    first_triangle = np.cumsum(fans) - fans
    left = _MOST_WORK + _WORK_PER_CORNER * len(positions)
    for number in _concave(positions, triangles, polygon, sizes):
        if left < 0:
            break
        size = int(sizes[number])
        rows, work = _cut_ears(positions[starts[number] : starts[number] + size], left)
        left -= work
        if len(rows) == size - 2:
            at = first_triangle[number]
            triangles[at : at + size - 2] = rows + starts[number]


def _concave(positions: NDArray[np.float64], triangles: Ints, polygon: Ints, sizes: Ints) -> list[int]:
    """Return the numbers of the polygons in whose fans a triangle turns the other way than the whole."""
    found: list[int] = []
    ends = np.cumsum(np.maximum(sizes - 2, 0))  # of the triangles of each polygon
    cuts = np.searchsorted(ends, np.arange(_ROWS_AT_ONCE, len(triangles), _ROWS_AT_ONCE), side="right")
    bounds = [0, *ends[cuts].tolist(), len(triangles)]
    for start, end in pairwise(bounds):
        rows = start + np.flatnonzero(sizes[polygon[start:end]] > 3)
        if not len(rows):
            continue
        numbers = polygon[rows] - polygon[start]
        first, second, third = positions[triangles[rows]].transpose(1, 0, 2)
        with np.errstate(invalid="ignore", over="ignore"):
            normals = np.cross(second - first, third - first)
            whole = np.stack([np.bincount(numbers, axis) for axis in normals.T], axis=1)
            turned = (normals * whole[numbers]).sum(axis=1) < -_FLAT * (whole**2).sum(axis=1)[numbers]
        found += np.unique(polygon[rows[turned]]).tolist()
    return found


def _cut_ears(corners: NDArray[np.float64], most_work: int) -> tuple[Ints, int]:
    """Cut a polygon (n, 3) by its ears; return triangles, fewer than n − 2 if that fails, and the work that it took."""
    with np.errstate(invalid="ignore", over="ignore"):
        normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
        flat = np.delete(corners, int(np.abs(normal).argmax()), axis=1)
        x, y = flat.T
        if (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() < 0:
            flat = flat * [-1, 1]
        left = list(range(len(flat)))
        cut: list[tuple[int, int, int]] = []
        at = failed = work = 0
        while len(left) > 3 and failed < len(left) and work < most_work:
            at %= len(left)
            ear = left[at - 1], left[at], left[(at + 1) % len(left)]
            work += _WORK_PER_TEST + len(left)
            if _is_ear(flat, ear, left):
                cut.append(ear)
                del left[at]
                failed = 0
            else:
                at += 1
                failed += 1
    if len(left) == 3:
        cut.append((left[0], left[1], left[2]))
    return np.array(cut, np.int64).reshape(-1, 3), work


def _is_ear(flat: NDArray[np.float64], ear: tuple[int, int, int], left: list[int]) -> bool:
    """Return whether three corners of a counter-clockwise polygon turn left and have no other inside."""
    triangle = flat[list(ear)]
    edges = np.roll(triangle, -1, axis=0) - triangle
    if edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0] <= 0:
        return False
    others = flat[left][:, None] - triangle
    sides = edges[:, 0] * others[..., 1] - edges[:, 1] * others[..., 0]
    inside = (sides >= 0).all(axis=1)
    inside &= ~(others == 0).all(axis=2).any(axis=1)  # its own corners, and others at their places
    return not bool(inside.any())
