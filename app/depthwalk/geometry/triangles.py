"""TODO docstring."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array


def spread_directions(count: int) -> NDArray[np.float64]:
    """Return unit vectors (count, 3) spread evenly over the sphere, from +Y down to −Y: a Fibonacci lattice."""
    number = np.arange(count)
    y = 1 - (2 * number + 1) / count
    turn, level = np.pi * (1 + 5**0.5) * number, np.sqrt(1 - y**2)
    return np.stack([level * np.cos(turn), y, level * np.sin(turn)], -1)


def face_normals(corners: Array) -> tuple[Array, Array]:
    """Return the unit normals (n, 3) and areas (n,) of triangles (n, 3, 3)."""
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(cross, axis=1)
    return cross / np.maximum(doubled, 1e-300)[:, None], doubled / 2


def sample_triangles(corners: Array, count: int) -> tuple[Array, Array]:
    """Return points (count, 3) spread evenly over triangles (n, 3, 3), and the unit normals (count, 3) there."""
    normals, areas = face_normals(corners)
    random = np.random.default_rng(0)
    ends = np.cumsum(areas)
    face = np.searchsorted(ends, (np.arange(count) + random.random(count)) / count * ends[-1]).clip(0, len(ends) - 1)
    u, v = random.random((2, count))
    over = u + v > 1
    u, v = np.where(over, 1 - u, u)[:, None], np.where(over, 1 - v, v)[:, None]
    a, b, c = corners[face].transpose(1, 0, 2)
    return a + u * (b - a) + v * (c - a), normals[face]


def doubled_areas(positions: NDArray, faces: NDArray) -> NDArray[np.float64]:
    """(F, 3) cross product of two edges: along the face's normal, as long as twice its area."""
    x, y, z = (np.ascontiguousarray(axis)[faces.T] for axis in positions.T)  # half the time of np.cross
    (ux, uy, uz), (vx, vy, vz) = ([axis[k] - axis[0] for axis in (x, y, z)] for k in (1, 2))
    return np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], -1)


def row_ids(columns: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number the distinct rows of a (V, K) array.

    Returns (V,) the number of each row, and (N,) the first row that has each number.
    """
    varying = columns[:, (columns != columns[:1]).any(axis=0)]
    if varying.shape[1] == 0:
        return np.zeros(len(columns), np.int64), np.zeros(1, np.int64)
    order = np.lexsort(varying.T)
    ordered = varying[order]
    starts = np.concatenate([[True], (ordered[1:] != ordered[:-1]).any(axis=1)])
    ids = np.empty(len(columns), np.int64)
    ids[order] = np.cumsum(starts) - 1
    return ids, order[starts]
