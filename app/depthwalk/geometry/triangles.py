"""Compute with arrays of triangles: normals, areas, points spread over them, and identical vertices."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.distinct import distinct_numbers
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array, Ints, Rows

_BATCH = 1 << 14  # points at a time


def spread_directions(count: int) -> NDArray[np.float64]:
    """Return `count` unit vectors (count, 3) spread evenly over the sphere, from +Y down to −Y: a Fibonacci lattice."""
    number = np.arange(count)
    y = 1 - (2 * number + 1) / count
    turn, level = np.pi * (1 + 5**0.5) * number, np.sqrt(1 - y**2)
    return np.stack([level * np.cos(turn), y, level * np.sin(turn)], -1)


def face_normals(corners: Array) -> tuple[Array, Array]:
    """Return the unit normals (n, 3) and the areas (n,), metres², of triangles with `corners` (n, 3, 3), metres.

    `corners[k]` holds the three corners of triangle k, counter-clockwise seen from the front. The normal of a triangle
    without area is 0.
    """
    a, b, c = corners.transpose(1, 2, 0)
    (ux, uy, uz), (vx, vy, vz) = b - a, c - a
    cross = np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], -1)  # half the time of np.cross
    doubled = lengths(cross)
    return cross / np.maximum(doubled, 1e-300)[:, None], doubled / 2


def sample_triangles(corners: Array, count: int) -> tuple[Array, Array]:
    """Spread points evenly over triangles.

    Parameters
    ----------
    corners
        (n, 3, 3) triangles, metres.
    count
        Number of points.

    Returns
    -------
    tuple
        Points (count, 3), metres, and the unit normals (count, 3) of their triangles.
    """
    normals, areas = face_normals(corners)
    points, triangles = zip(*sample_batches(corners, areas, count), strict=True)
    return np.concatenate(points), normals[np.concatenate(triangles)]


def sample_batches(corners: Array, areas: Array, count: int) -> Iterator[tuple[Array, Ints]]:
    """Yield points spread evenly over triangles, some thousands at a time, which stay in the CPU's cache.

    The total area is divided into `count` equal shares in the triangles' order, and each share gets one random point.
    So points come triangle by triangle, and the same arguments give the same points.

    Parameters
    ----------
    corners, areas
        (n, 3, 3) corners of the triangles, metres, and (n,) areas, metres².
    count
        Total number of points, at least 1.

    Yields
    ------
    tuple
        Points (m, 3), metres, and the number (m,) of the triangle that each lies on.
    """
    ends = np.cumsum(areas)
    # One stream of random numbers per variable, each starting where the previous one ends.
    along_stream, u_stream, v_stream = (np.random.Generator(np.random.PCG64(0).advance(k * count)) for k in range(3))
    for first in range(0, count, _BATCH):
        number = np.arange(first, min(first + _BATCH, count))
        along = (number + along_stream.random(len(number))) / count * ends[-1]  # rising
        low, high = np.searchsorted(ends, along[[0, -1]]).clip(max=len(ends) - 1).tolist()
        upto = np.append(np.searchsorted(along, ends[low:high], "right"), len(along))
        points_on = np.diff(upto, prepend=0)  # number on each of the triangles from `low` to `high`
        u, v = u_stream.random(len(number)), v_stream.random(len(number))
        over = u + v > 1
        u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
        a, b, c = corners[low : high + 1].transpose(1, 2, 0)
        points = np.empty((len(number), 3), np.result_type(corners, u))
        for column, start, along_u, along_v in zip(points.T, a, b - a, c - a, strict=True):
            column[:] = start.repeat(points_on) + u * along_u.repeat(points_on) + v * along_v.repeat(points_on)
        yield points, np.arange(low, high + 1).repeat(points_on)


def doubled_areas(positions: Array, faces: Rows) -> NDArray[np.float64]:
    """Return the cross products (t, 3) of two edges of each triangle: along its normal, with twice its area as length.

    Parameters
    ----------
    positions
        (n, 3) vertices, metres.
    faces
        (t, 3) rows of `positions`, counter-clockwise seen from the front.

    Returns
    -------
    numpy.ndarray
        (t, 3) float64, metres².
    """
    return np.stack(crossed_edges(corner_axes(positions, faces)), -1)


def corner_axes(positions: Array, faces: Rows) -> list[Array]:
    """Return x, y and z of the corners of triangles, each (3, t), which NumPy reduces several times as fast as rows.

    Parameters
    ----------
    positions
        (n, 3) vertices.
    faces
        (t, 3) rows of `positions`.
    """
    corners = np.ascontiguousarray(faces.T)
    return [np.ascontiguousarray(axis).take(corners) for axis in positions.T]


def crossed_edges(axes: list[Array]) -> list[Array]:
    """Return x, y and z (t,) of the cross products of two edges of triangles whose `corner_axes` are given."""
    (ux, uy, uz), (vx, vy, vz) = ([axis[k] - axis[0] for axis in axes] for k in (1, 2))
    return [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx]  # half the time of np.cross


def row_ids(columns: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Assign numbers to the rows of an array, so that equal rows have the same number.

    Parameters
    ----------
    columns
        (n, k) of any type.

    Returns
    -------
    tuple
        The number (n,) int64 of each row, from 0 to m − 1, and for each number the first row (m,) int64 that has it.
    """
    varying = columns[:, (columns != columns[:1]).any(axis=0)]
    if varying.shape[1] == 0:
        return np.zeros(len(columns), np.int64), np.zeros(1, np.int64)
    if (keys := _keys(varying)) is not None:
        _, first, ids = distinct_numbers(keys)
        return ids, first
    order = _row_order(varying)
    ordered = varying[order]
    starts = np.concatenate([[True], (ordered[1:] != ordered[:-1]).any(axis=1)])
    ids = np.empty(len(columns), np.int64)
    ids[order] = np.cumsum(starts) - 1
    return ids, order[starts]


def _keys(columns: NDArray[Any]) -> NDArray[np.int64] | None:
    """Return a number (n,), from 0, for each row (n, k) of integers, in the order of the rows.

    Sorting rows of three vertex numbers then takes a third of the time. None for other rows, and where such numbers
    would have more than 63 bits.
    """
    if not np.can_cast(columns.dtype, np.int64):
        return None
    low = columns.min(axis=0).astype(np.int64)
    sizes = [last - first + 1 for first, last in zip(low.tolist(), columns.max(axis=0).tolist(), strict=True)]
    if math.prod(sizes) > np.iinfo(np.int64).max:
        return None
    keys: NDArray[np.int64] = (columns - low) @ np.cumprod([1, *sizes[:-1]])
    return keys


def _row_order(columns: NDArray[Any]) -> NDArray[np.int64]:
    """Return the order of rows (n, k), k > 0, that `numpy.lexsort` returns for the columns in reverse order.

    Few rows have the same last number. Sorting by that, and only those few by the others, takes a third of the time.
    """
    last = columns[:, -1]
    order = np.argsort(last, kind="stable")
    placed = last[order]
    same = (placed[1:] == placed[:-1]) | ((placed[1:] != placed[1:]) & (placed[:-1] != placed[:-1]))  # NaN, too
    tied = np.flatnonzero(np.append(same, False) | np.append(False, same))
    run = np.cumsum(~np.append(False, same))[tied]
    order[tied] = order[tied][np.lexsort([*columns[order[tied], :-1].T, run])]
    return order
