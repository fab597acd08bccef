"""Merge vertices that are nearly at the same position: vertex clustering (Rossignac and Borrel 1993).

The images of an object sample its surface several times over. Clustering makes one surface of these copies, which edge
collapse cannot join because it follows edges.
"""

import numpy as np

from depthwalk.geometry.indexed_triangles import distinct_triangles, drop_unused, vertex_directions
from depthwalk.geometry.spatial_order import stable_order
from depthwalk.types import Array, Ints


def cluster_vertices(point: Array, triangles: Ints, rank: Ints, voxel_size: float) -> tuple[Array, Ints]:
    """Merge the vertices within each voxel into one of them, and drop triangles that lose a corner or occur twice.

    Vertices that face opposite ways, such as those on the two sides of a leaf, stay apart.

    Parameters
    ----------
    point
        (n, 3) vertices, metres, object frame; the voxels are aligned with its axes.
    triangles
        (t, 3) rows of `point`.
    rank
        (n,) order of preference: each voxel keeps the first of its vertices of lowest rank.
    voxel_size
        Edge of a voxel, metres.

    Returns
    -------
    tuple
        Vertices (m, 3) float64, metres, and triangles (u, 3) int64, rows of these vertices, each once.
    """
    kept, triangles = kept_vertices(point, triangles, rank, voxel_size)
    return point[kept].astype(np.float64), triangles


def kept_vertices(point: Array, triangles: Ints, rank: Ints, voxel_size: float) -> tuple[Ints, Ints]:
    """Do the same as `cluster_vertices`, but return the rows (m,) of `point` that are kept instead of the vertices."""
    first, number = _groups(_voxel_keys(point - point.min(0), voxel_size), rank)
    facing = vertex_directions(point, triangles)
    first, number = _groups(
        2 * number + (np.einsum("ij,ij->i", facing, facing.take(first, 0).take(number, 0)) < 0), rank
    )
    used, triangles = drop_unused(distinct_triangles(number[triangles]), len(first))
    return first[used], triangles


def _voxel_keys(point: Array, voxel_size: float) -> Ints:
    """Return the numbers (n,) of the voxels that hold points (n, 3); none of their coordinates is negative."""
    x, y, z = np.ascontiguousarray(np.floor(point / voxel_size).astype(np.int64).T)
    return np.asarray((x * (y.max(initial=0) + 1) + y) * (z.max(initial=0) + 1) + z)


def _groups(key: Ints, rank: Ints) -> tuple[Ints, Ints]:
    """Return the first member (g,) of the lowest rank of each group, and the group (n,) of each point.

    key: (n,), equal within a group; rank: (n,).
    """
    order = stable_order(key * (rank.max(initial=0) + 1) + rank)
    begins = np.diff(key.take(order), prepend=-1) > 0
    number = np.empty(len(key), np.int64)
    number[order] = np.cumsum(begins) - 1
    return order[begins], number
