"""Work on triangles that share vertices, rows (t, 3) of vertex numbers: find copies, boundary edges and normals.

Three vertex numbers, or three coordinates of a voxel, are packed into one 64-bit key: sorting keys is many times as
quick as sorting rows.
"""

import numpy as np

from depthwalk.geometry.triangles import doubled_areas
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array, Ints, Mask

KEY_BITS = 21  # of a number, so that three fit into one key
_KEY_MASK = (1 << KEY_BITS) - 1


def normals_and_areas(point: Array, triangles: Ints) -> tuple[Array, Array]:
    """Return the unit normals (t, 3) and areas (t,), metres², of `triangles` (t, 3), rows of `point` (n, 3), metres."""
    across = doubled_areas(point, triangles)
    length = lengths(across)
    return across / np.maximum(length, 1e-30)[:, None], length / 2


def vertex_directions(point: Array, triangles: Ints) -> Array:
    """Return a vector at each vertex that points as its normal does, and is longer the larger the triangles around it.

    It is the sum of the triangles' area vectors, which are normal to a triangle and twice as long as its area.

    Parameters
    ----------
    point
        (n, 3) vertices, metres.
    triangles
        (t, 3) rows of `point`.

    Returns
    -------
    Array
        (n, 3) metres².
    """
    facing = np.zeros(point.shape)
    for column, values in zip(facing.T, doubled_areas(point, triangles).T, strict=True):
        for corner in triangles.T:
            column += np.bincount(corner, values, len(point))
    return facing


def open_edges(point: Array, triangles: Ints, normal: Array) -> tuple[Ints, Ints, Array]:
    """Return the boundary edges of a surface: those along which no triangle runs in the opposite direction.

    Parameters
    ----------
    point
        (n, 3) vertices, metres.
    triangles
        (t, 3) rows of `point`, each with three corners.
    normal
        (t, 3) unit normals of the triangles.

    Returns
    -------
    tuple
        The rows (m,) of `point` where each of the m edges begins, those (m,) where it ends, and vectors (m, 3), metres,
        that point away from its triangle, in the triangle's plane, and are as long as the edge.
    """
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    # Both directions of an edge side by side, the last bit telling them apart.
    key = np.minimum(start, end) << KEY_BITS + 1 | np.maximum(start, end) << 1 | (start > end)
    order = np.argsort(key)
    key = key[order]
    begins = np.flatnonzero(np.diff(key >> 1, prepend=-1))
    ends = np.append(begins[1:], len(key))
    one_way = key[begins] == key[ends - 1]
    open_ = np.sort(order[np.repeat(one_way, ends - begins)])
    start, end = start[open_], end[open_]
    return start, end, np.cross(point[end] - point[start], normal[open_ // 3])


def distinct_triangles(triangles: Ints) -> Ints:
    """Leave out triangles without three different corners, and all but one of several equal ones.

    Triangles of the same corners that are wound in opposite directions are not equal.

    Parameters
    ----------
    triangles
        (t, 3) numbers of vertices, below 2²¹.

    Returns
    -------
    numpy.ndarray
        (u, 3) int64, the triangles that stay, in rising order, each rotated so that its smallest number comes first.
    """
    a, b, c = triangles.T
    # Of the three rotations, that with the smallest number first has the smallest key.
    keys = [one << 2 * KEY_BITS | two << KEY_BITS | three for one, two, three in ((a, b, c), (b, c, a), (c, a, b))]
    key = np.sort(np.minimum(np.minimum(*keys[:2]), keys[2])[(a != b) & (b != c) & (c != a)])
    key = key[np.diff(key, prepend=-1) > 0]
    return np.stack([key >> 2 * KEY_BITS, key >> KEY_BITS & _KEY_MASK, key & _KEY_MASK], -1)


def any_corner(vertices: Mask, triangles: Ints) -> Mask:
    """Return which of `triangles` (t, 3), numbers of vertices, have a corner in the mask `vertices` (n,): (t,) bool."""
    a, b, c = triangles.T
    return np.asarray(
        vertices[a] | vertices[b] | vertices[c]
    )  # `any` along so short an axis takes several times as long


def drop_unused(triangles: Ints, count: int) -> tuple[Ints, Ints]:
    """Leave out vertices that no triangle uses.

    Parameters
    ----------
    triangles
        (t, 3) numbers of vertices.
    count
        Number of vertices.

    Returns
    -------
    tuple
        The old numbers (m,) of the vertices that stay, rising, and the triangles (t, 3) in new numbers.
    """
    used = np.zeros(count, bool)
    used[triangles] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[triangles]
