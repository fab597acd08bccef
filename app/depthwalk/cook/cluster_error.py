"""Measure how far simplified groups of triangles are from the mesh that they were made from."""

import numpy as np
from scipy.spatial import cKDTree

from depthwalk.geometry.triangles import face_normals
from depthwalk.parallel import batches
from depthwalk.types import Array, Ints, Mask

_FEWEST = 8192  # probes of a mesh
_PER_GROUP = 64  # probes of a group, if this makes more than _FEWEST
_NEAREST = 4  # points on the simplified triangles; the nearest of their triangles counts
_EXACT = 16  # probes at a time whose distance is measured exactly
_BATCH = 1 << 15  # probes at a time


class Probes:
    """Follow points of a mesh through the clusters that replace the surface on which they lie.

    Half of the points are vertices, where simplification moves the surface most; the others are spread evenly.

    Attributes
    ----------
    cluster : (n,) the cluster that each point belongs to, as the caller numbers them.
    """

    def __init__(self, point: Array, triangles: Ints, cluster: Ints, groups: int) -> None:
        """Choose the points.

        Parameters
        ----------
        point
            (p, 3) positions of vertices; the mesh has a size of about 1.
        triangles
            (t, 3) rows of `point`.
        cluster
            (t,) the cluster of each triangle.
        groups
            Approximate number of groups into which the clusters will be put.
        """
        random = np.random.default_rng(0)
        count = max(_FEWEST, _PER_GROUP * groups) // 2
        inside, row = spread_points(point[triangles], count, random)
        any_triangle = np.full(len(point), -1)
        any_triangle[triangles] = np.arange(len(triangles))[:, None]
        used = np.flatnonzero(any_triangle >= 0)
        chosen = used if len(used) <= count else np.sort(random.choice(used, count, replace=False))
        self._point = np.concatenate([inside, point[chosen]])
        self.cluster = cluster[np.concatenate([row, any_triangle[chosen]])]
        self._random = random

    def measure(self, group_of_cluster: Ints, groups: int, corners: Array, group: Ints, cluster: Ints) -> Array:
        """Find the largest distance of points from the simplified triangles of their groups, and move them there.

        Distances to the triangles of the nearest of many points on them are upper bounds. Where these are largest, all
        triangles of the group are tested.

        Parameters
        ----------
        group_of_cluster
            (c,) the group of each cluster before the simplification; −1 for clusters that stay unchanged.
        groups
            Number of groups.
        corners
            (t, 3, 3) the simplified triangles.
        group, cluster
            (t,) the group of each simplified triangle, and the cluster that it is in now.

        Returns
        -------
        Array
            (groups,) distances.
        """
        self._thin_out(groups)
        error = np.zeros(groups)
        of = group_of_cluster[self.cluster]
        rows = np.flatnonzero(of >= 0)
        rows = rows[np.argsort(of[rows], kind="stable")]
        if not (len(rows) and len(corners)):
            return error
        apart = 10.0  # distance between groups along a fourth axis: many times the mesh's size
        spread, triangle = spread_points(corners, 2 * len(rows), self._random)
        triangle = np.concatenate([np.arange(len(corners)), triangle])
        tree = cKDTree(np.column_stack([np.concatenate([corners.mean(1), spread]), apart * group[triangle]]))
        bound = np.empty(len(rows))
        for batch in batches(len(rows), _BATCH):
            point = self._point[rows[batch]]
            found = triangle[tree.query(np.column_stack([point, apart * of[rows[batch]]]), _NEAREST)[1] % len(triangle)]
            distance = squared_distances(point[:, None], corners[found])
            distance[group[found] != of[rows[batch]][:, None]] = np.inf
            best = distance.argmin(1)
            bound[batch] = distance[np.arange(len(best)), best]
            self.cluster[rows[batch]] = cluster[found[np.arange(len(best)), best]]
        order = np.argsort(group, kind="stable")
        begins, ends = (np.searchsorted(group[order], np.arange(groups), side) for side in ("left", "right"))
        firsts = np.searchsorted(of[rows], np.arange(groups + 1))
        for number in range(groups):
            run = slice(firsts[number], firsts[number + 1])
            surface = corners[order[begins[number] : ends[number]]]
            error[number] = _greatest_distance(self._point[rows[run]], bound[run], surface)
        return np.sqrt(error)

    def _thin_out(self, groups: int) -> None:
        """Drop some of the points if there are more than this many groups need."""
        count = max(_FEWEST, _PER_GROUP * groups)
        if len(self._point) > count:
            kept = np.sort(self._random.choice(len(self._point), count, replace=False))
            self._point, self.cluster = self._point[kept], self.cluster[kept]


def _greatest_distance(point: Array, bound: Array, corners: Array) -> float:
    """Return the largest squared distance of points (n, 3), bounded by `bound` (n,), from triangles (t, 3, 3)."""
    order, greatest = np.argsort(-bound), 0.0
    for batch in batches(len(order), _EXACT):
        rows = order[batch]
        if bound[rows].max(initial=0.0) <= greatest:
            break
        exact = squared_distances(point[rows][:, None], corners[None]).min(1)
        greatest = max(greatest, float(np.minimum(exact, bound[rows]).max(initial=0.0)))
    return greatest


def spread_points(corners: Array, count: int, random: np.random.Generator) -> tuple[Array, Ints]:
    """Return points (count, 3) spread evenly over triangles (t, 3, 3), and the triangle (count,) of each."""
    area = np.cumsum(face_normals(corners)[1])
    row = np.searchsorted(area[:-1], (np.arange(count) + random.random(count)) / count * area[-1])
    share = np.sort(random.random((count, 2)), axis=1)
    weights = np.stack([share[:, 0], share[:, 1] - share[:, 0], 1 - share[:, 1]], -1)
    return np.einsum("nk,nkd->nd", weights, corners[row]), row


def squared_distances(point: Array, corners: Array) -> Array:
    """Return the squared distances of points (…, 3) from triangles (…, 3, 3)."""
    a, b, c = (corners[..., k, :] for k in range(3))
    ab, ac, ap = b - a, c - a, point - a
    d1, d2 = _dot(ab, ap), _dot(ac, ap)
    bb, cc, bc = _dot(ab, ab), _dot(ac, ac), _dot(ab, ac)
    area = np.maximum(bb * cc - bc * bc, 0)
    safe = np.where(area > 0, area, 1)
    v, w = (cc * d1 - bc * d2) / safe, (bb * d2 - bc * d1) / safe
    inside: Mask = (v >= 0) & (w >= 0) & (v + w <= 1) & (area > 0)
    plane = np.square(ap - v[..., None] * ab - w[..., None] * ac).sum(-1)
    edges = np.minimum(np.minimum(_from_edge(a, b, point), _from_edge(b, c, point)), _from_edge(c, a, point))
    return np.where(inside, plane, edges)


def _from_edge(start: Array, end: Array, point: Array) -> Array:
    """Return squared distances of points (…, 3) from edges with end points (…, 3)."""
    along, to = end - start, point - start
    length = _dot(along, along)
    share = np.clip(_dot(to, along) / np.where(length > 0, length, 1), 0, 1)
    return np.asarray(np.square(to - share[..., None] * along).sum(-1))


def _dot(one: Array, other: Array) -> Array:
    return np.asarray(np.einsum("...i,...i->...", one, other))
