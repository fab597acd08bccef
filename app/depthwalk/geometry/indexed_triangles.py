"""Work on triangles that share vertices, rows (t, 3) of vertex numbers: find copies, boundary edges and normals.

Three vertex numbers, or three coordinates of a voxel, are packed into one 64-bit key, since sorting keys is many times
as fast as sorting rows.
"""

import numpy as np

from depthwalk.geometry.distinct import sorted_distinct
from depthwalk.geometry.spatial_order import stable_order
from depthwalk.geometry.triangles import doubled_areas
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array, Ints, Mask

PAIR_BITS = 31  # of a number, so that two fit into one key
_KEY_BITS = 21  # so that three do
_KEY_MASK = (1 << _KEY_BITS) - 1


def normals_and_areas(point: Array, triangles: Ints) -> tuple[Array, Array]:
    """Return the unit normals (t, 3) and areas (t,), metres², of `triangles` (t, 3), rows of `point` (n, 3), metres."""
    across = doubled_areas(point, triangles)
    length = lengths(across)
    return across / np.maximum(length, 1e-30)[:, None], length / 2


def vertex_directions(point: Array, triangles: Ints) -> Array:
    """Return a vector along the normal at each vertex, whose length grows with the triangles around it.

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
    corners = np.ascontiguousarray(triangles.T)
    facing = np.zeros((3, len(point)))
    for column, values in zip(facing, np.ascontiguousarray(doubled_areas(point, triangles).T), strict=True):
        for corner in corners:
            column += np.bincount(corner, values, len(point))
    return np.ascontiguousarray(facing.T)


def opposite_edges(triangles: Ints) -> Ints:
    """Return, for each edge of each triangle, the edge that runs the other way between the same vertices.

    Edge 3 k + i begins at corner i of triangle k, and ends at the next.

    Parameters
    ----------
    triangles
        (t, 3) rows of vertices, each with three different corners.

    Returns
    -------
    numpy.ndarray
        (3 t,) the number of the opposite edge; of several, the first. −1 if there is none.
    """
    start, end = np.ascontiguousarray(triangles).ravel(), np.roll(triangles, -1, axis=1).ravel()
    # Both directions of an edge become neighbours, distinguished by the last bit.
    bits = int(triangles.max(initial=0)).bit_length()
    key = np.minimum(start, end) << bits + 1
    key |= np.maximum(start, end) << 1
    key |= start > end
    order = stable_order(key)
    key = key.take(order)
    begins = np.flatnonzero(np.diff(key, prepend=-1))  # of runs of equal edges
    edge = key.take(begins) >> 1
    paired = np.flatnonzero(edge[1:] == edge[:-1])
    first, other = order.take(begins), np.full(len(begins), -1, np.int64)
    other[paired], other[paired + 1] = first[paired + 1], first[paired]
    opposite = np.empty(len(key), np.int64)
    opposite[order] = np.repeat(other, np.diff(begins, append=len(key)))
    return opposite


def open_edges(point: Array, triangles: Ints, normal: Array, opposite: Ints | None = None) -> tuple[Ints, Ints, Array]:
    """Return the boundary edges of a surface: those along which no triangle runs in the opposite direction.

    Parameters
    ----------
    point
        (n, 3) vertices, metres.
    triangles
        (t, 3) rows of `point`, each with three corners.
    normal
        (t, 3) unit normals of the triangles.
    opposite
        (3 t,) the result of `opposite_edges` for the triangles, if it is known.

    Returns
    -------
    tuple
        The rows (m,) of `point` where each of the m edges begins, those (m,) where it ends, and vectors (m, 3), metres,
        that point away from its triangle, in the triangle's plane, and have the edge's length.
    """
    open_ = np.flatnonzero((opposite_edges(triangles) if opposite is None else opposite) < 0)
    triangle, corner = np.divmod(open_, 3)
    start, end = triangles[triangle, corner], triangles[triangle, (corner + 1) % 3]
    return start, end, np.cross(point[end] - point[start], normal[triangle])


def distinct_triangles(triangles: Ints) -> Ints:
    """Drop triangles without three different corners, and all but one of several equal ones.

    Triangles with the same corners but opposite winding are not equal.

    Parameters
    ----------
    triangles
        (t, 3) numbers of vertices; from 2²¹ on, sorting takes several times as long.

    Returns
    -------
    numpy.ndarray
        (u, 3) int64, the remaining triangles, in ascending order, each rotated so that its smallest number comes first.
    """
    a, b, c = triangles.T
    if triangles.max(initial=0) > _KEY_MASK:
        return _distinct_rows(triangles[(a != b) & (b != c) & (c != a)])
    # Of the three rotations, the one with the smallest number first has the smallest key.
    keys = [one << 2 * _KEY_BITS | two << _KEY_BITS | three for one, two, three in ((a, b, c), (b, c, a), (c, a, b))]
    key = sorted_distinct(np.minimum(np.minimum(*keys[:2]), keys[2])[(a != b) & (b != c) & (c != a)])
    return np.stack([key >> 2 * _KEY_BITS, key >> _KEY_BITS & _KEY_MASK, key & _KEY_MASK], -1)


def _distinct_rows(triangles: Ints) -> Ints:
    """Do the same as `distinct_triangles` for triangles with three different corners, whose numbers no key can hold."""
    turned = np.take_along_axis(triangles, (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    rows = turned.take(np.lexsort(turned.T[::-1]), 0)
    is_first = np.append(True, (rows[1:] != rows[:-1]).any(axis=1))[: len(rows)]
    return np.asarray(rows[is_first])


def any_corner(vertices: Mask, triangles: Ints) -> Mask:
    """Return which of `triangles` (t, 3), numbers of vertices, have a corner in the mask `vertices` (n,): (t,) bool."""
    a, b, c = triangles.T
    return np.asarray(vertices[a] | vertices[b] | vertices[c])  # `any` along so short an axis takes far longer


def drop_unused(triangles: Ints, count: int) -> tuple[Ints, Ints]:
    """Drop vertices that no triangle uses.

    Parameters
    ----------
    triangles
        (t, 3) numbers of vertices.
    count
        Number of vertices.

    Returns
    -------
    tuple
        The old numbers (m,) of the remaining vertices, ascending, and the triangles (t, 3) in new numbers.
    """
    used = np.zeros(count, bool)
    used[triangles] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[triangles]
