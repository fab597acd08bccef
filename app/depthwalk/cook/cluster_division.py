"""Divide triangles into clusters: the leaves of k-d trees over their centroids, and a little over their normals."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook import kernels
from depthwalk.cook.mesh_clusters import SIZE
from depthwalk.geometry.spatial_order import kd_tree_order
from depthwalk.geometry.triangles import face_normals
from depthwalk.parallel import batches
from depthwalk.types import Array, Ints, Rows

NORMAL_PLACE = 0.02  # distance, relative to the mesh's size, that a difference of 1 between normals counts as
_BATCH = 1 << 18  # triangles at a time
_LARGE = 1 << 15  # points: a run of more is halved before it is sorted, so that it fits into the CPU's cache


def divided(point: Array, corners: Rows, part: Rows, group: Rows) -> tuple[Ints, Ints]:
    """Divide triangles into clusters.

    Parameters
    ----------
    point
        (p, 3) places, in a frame in which the mesh has size 1.
    corners
        (t, 3) rows of `point`.
    part, group
        (t,) the part of the mesh and the group of each triangle, which a cluster shares.

    Returns
    -------
    tuple
        The order (t,) of the triangles in which each cluster is a run, by group, then part; and the triangles (n,) of
        each cluster.
    """
    if not len(group):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    key = group.astype(np.int64) * (int(part.max(initial=0)) + 1) + part
    rising = bool((np.diff(key) >= 0).all())
    order = np.arange(len(key)) if rising else np.argsort(key, kind="stable")
    begins = np.append(np.flatnonzero(np.diff(key[order], prepend=-1)), len(order))
    length = np.diff(begins)
    size = -(-length // -(-length // SIZE))
    places = np.empty((len(key), 6), np.float32)
    for batch in batches(len(key), _BATCH):
        placed = point[corners[order[batch]]].astype(np.float64)
        places[batch, :3], places[batch, 3:] = placed.mean(1), NORMAL_PLACE * face_normals(placed)[0]
    if loops := kernels.loaded():
        inner = loops.divide(places, begins, size)
    else:
        runs = zip(begins, begins[1:], size.tolist(), strict=False)
        inner = np.concatenate([first + _leaves(places[first:last], leaf) for first, last, leaf in runs])
    clusters = -(-length // size)
    count = np.repeat(size, clusters)
    count[np.cumsum(clusters) - 1] = length - size * (clusters - 1)
    return order[inner], count


def _leaves(places: NDArray[np.float32], size: int) -> Ints:
    """Return the order of places (n, 6) in which each run of `size` is a leaf, as `kd_tree_order` does."""
    if len(places) <= _LARGE:
        return np.asarray(kd_tree_order(places, size))
    half = size
    while 2 * half < len(places):
        half *= 2
    axis = int(np.ptp(places, axis=0).argmax())
    order = np.argpartition(places[:, axis], half)
    return np.concatenate([side[_leaves(places[side], size)] for side in (order[:half], order[half:])])
