"""Select the clusters of a mesh that show many objects at once: just fine enough, and without cracks between them.

A cluster is drawn where its own error cannot be seen and that of the group that it would be simplified in can (Karis,
Stubbe and Wihlidal 2021). Errors and spheres of a group enclose those of the groups below it, so that refining a group
implies refining all groups above it; and all clusters of a group share one error, so that they switch together.
"""

from typing import NamedTuple

import numpy as np

from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.types import Array, Mask, Rows

_TOGETHER = 1 << 22  # pairs of object and group that are tested at a time


class ClusterCut(NamedTuple):
    """Hold k pairs of an object and a cluster that shows a piece of it.

    Attributes
    ----------
    objects : (k,) rows of the objects.
    clusters : (k,) numbers of the clusters.
    """

    objects: Rows
    clusters: Rows


def select_clusters(clusters: MeshClusters, viewer: Array, nearest: Array, allowed: float) -> ClusterCut:
    """Choose the clusters of objects of one mesh.

    Levels are tested from the coarsest to the finest, each only for objects that need a coarser one refined, so that
    far objects cost a test of one or two groups.

    Parameters
    ----------
    clusters : the clusters of the mesh.
    viewer : (n, 3) the viewer in the frames of the objects, metres.
    nearest : (n,) the least distance from the viewer to the objects, metres in their frames.
    allowed : geometric error that a surface may have at a distance of one metre, metres.

    Returns
    -------
    The pairs of objects and clusters, in no order.
    """
    together = max(_TOGETHER // max(len(clusters.error), 1), 1)
    parts = [
        _select(clusters, viewer[first : first + together], nearest[first : first + together], allowed, first)
        for first in range(0, max(len(viewer), 1), together)
    ]
    return ClusterCut(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _select(clusters: MeshClusters, viewer: Array, nearest: Array, allowed: float, first: int) -> ClusterCut:
    """Choose the clusters of a few objects, whose rows begin at `first`."""
    levels = len(clusters.level_first) - 1
    refined = np.zeros((len(viewer), len(clusters.error) + 1), bool)
    refined[:, -1] = True  # for clusters in no group, −1
    any_refined = np.zeros(len(viewer), bool)
    # Clusters come in the order of the groups that made them: (levels + 2,) first cluster of each level, and the end.
    begins = np.searchsorted(clusters.made_by, np.append([-1], clusters.level_first))
    last = np.flatnonzero(clusters.group < 0)
    finest_root = int(np.searchsorted(begins, last[0], "right")) - 2 if len(last) else -1
    objects, chosen = [], []
    for level in range(levels - 1, -2, -1):
        rows = np.flatnonzero(any_refined) if level < finest_root else np.arange(len(viewer))
        if not len(rows):
            continue
        groups = slice(*clusters.level_first[level : level + 2]) if level >= 0 else slice(0, 0)
        own = _is_refined(clusters, groups, viewer[rows], nearest[rows], allowed)
        refined[rows, groups] = own
        members = np.arange(begins[level + 1], begins[level + 2])
        above, made_by = clusters.group[members], clusters.made_by[members] - groups.start
        is_cut = refined[rows[:, None], above]
        if level >= 0:
            is_cut &= ~own[:, made_by]
            any_refined[rows] |= own.any(1)
        row, member = np.nonzero(is_cut)
        objects.append(first + rows[row])
        chosen.append(members[member])
    empty = np.zeros(0, np.int64)
    return ClusterCut(np.concatenate([empty, *objects]), np.concatenate([empty, *chosen]))


def _is_refined(clusters: MeshClusters, groups: slice, viewer: Array, nearest: Array, allowed: float) -> Mask:
    """Return whether the clusters that each of `groups` (g,) was simplified to are too coarse for n objects, (n, g)."""
    apart = np.linalg.norm(viewer[:, None] - clusters.group_centre[groups], axis=-1) - clusters.group_radius[groups]
    return np.asarray(clusters.error[groups] > allowed * np.maximum(apart, nearest[:, None]))
