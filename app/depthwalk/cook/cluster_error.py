"""Measure how far simplified groups of triangles are from the mesh that they were made from."""

import numpy as np
from scipy.spatial import cKDTree

from depthwalk.cook import kernels
from depthwalk.geometry.triangles import face_normals
from depthwalk.parallel import batches
from depthwalk.types import Array, Ints, Mask, Rows

_FEWEST = 8192  # probes of a mesh
_PER_GROUP = 64  # probes of a group, if this makes more than _FEWEST
_NEAREST = 4  # points on the simplified triangles; the nearest of their triangles counts
_EXACT = 16  # probes at a time whose distance is measured exactly
_BATCH = 1 << 15  # probes at a time
_AREAS = 1 << 18  # triangles at a time


class Probes:
    """Follow points of a mesh through the clusters that replace the surface on which they lie.

    Half of the points are vertices, where simplification moves the surface most; the others are spread evenly.

    Attributes
    ----------
    point : (n, 3) the points; the mesh has a size of about 1.
    cluster : (n,) the cluster that each belongs to, as the caller numbers them.
    """

    def __init__(self, point: Array, triangles: Rows, cluster: Rows, groups: int) -> None:
        """Choose the points.

        Parameters
        ----------
        point
            (p, 3) positions of vertices.
        triangles
            (t, 3) rows of `point`.
        cluster
            (t,) the cluster of each triangle.
        groups
            Approximate number of groups into which the clusters will be put.
        """
        self._random = np.random.default_rng(0)
        count = max(_FEWEST, _PER_GROUP * groups) // 2
        areas = [
            face_normals(point[triangles[batch]].astype(np.float64))[1] for batch in batches(len(triangles), _AREAS)
        ]
        inside, row = _spread(point, triangles, np.concatenate(areas), count, self._random)
        any_triangle = np.full(len(point), -1, np.int32)
        any_triangle[triangles] = np.arange(len(triangles), dtype=np.int32)[:, None]
        used = np.flatnonzero(any_triangle >= 0)
        chosen = used if len(used) <= count else np.sort(self._random.choice(used, count, replace=False))
        self.point = np.concatenate([inside, point[chosen]]).astype(np.float64)
        self.cluster = cluster[np.concatenate([row, any_triangle[chosen]])].astype(np.int64)

    def thin_out(self, groups: int) -> None:
        """Drop some of the points if there are more than so many groups need."""
        count = max(_FEWEST, _PER_GROUP * groups)
        if len(self.point) > count:
            kept = np.sort(self._random.choice(len(self.point), count, replace=False))
            self.point, self.cluster = self.point[kept], self.cluster[kept]


def group_errors(point: Array, of: Ints, corners: Array, group: Ints, groups: int) -> tuple[Array, Ints]:
    """Find the largest distance of points from the simplified triangles of their groups.

    Without compiled loops, distances to the triangles of the nearest of many points on them serve as upper bounds.
    Where these are largest, all triangles of the group are tested.

    Parameters
    ----------
    point, of
        (n, 3) the points, and the group (n,) of each, ascending.
    corners, group
        (t, 3, 3) the simplified triangles, and the group (t,) of each, ascending; every group of a point has some.
    groups
        Number of groups.

    Returns
    -------
    tuple
        The distances (groups,), and the triangle (n,) that each point is near.
    """
    error = np.zeros(groups)
    if not (len(point) and len(corners)):
        return error, np.zeros(len(point), np.int64)
    if loops := kernels.loaded():
        squared, nearest = loops.nearest(point, of, corners, group)
        np.maximum.at(error, of, squared)
        return np.sqrt(error), nearest
    bound, nearest = _bounds(point, of, corners, group)
    begins, ends = (np.searchsorted(group, np.arange(groups), side) for side in ("left", "right"))
    firsts = np.searchsorted(of, np.arange(groups + 1))
    for number in range(groups):
        run = slice(firsts[number], firsts[number + 1])
        error[number] = _greatest_distance(point[run], bound[run], corners[begins[number] : ends[number]])
    return np.sqrt(error), nearest


def _bounds(point: Array, of: Ints, corners: Array, group: Ints) -> tuple[Array, Ints]:
    """Return upper bounds (n,) of the squared distances of points, and the triangles (n,) at these distances."""
    apart = 10.0  # distance between groups along a fourth axis: many times the mesh's size
    spread, triangle = spread_points(corners, 2 * len(point), np.random.default_rng(0))
    triangle = np.concatenate([np.arange(len(corners)), triangle])
    tree = cKDTree(np.column_stack([np.concatenate([corners.mean(1), spread]), apart * group[triangle]]))
    bound, nearest = np.empty(len(point)), np.empty(len(point), np.int64)
    for batch in batches(len(point), _BATCH):
        here = point[batch]
        found = triangle[tree.query(np.column_stack([here, apart * of[batch]]), _NEAREST)[1] % len(triangle)]
        distance = squared_distances(here[:, None], corners[found])
        distance[group[found] != of[batch][:, None]] = np.inf
        best = distance.argmin(1)
        bound[batch] = distance[np.arange(len(best)), best]
        nearest[batch] = found[np.arange(len(best)), best]
    return bound, nearest


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
    rows = np.arange(3 * len(corners)).reshape(-1, 3)
    return _spread(corners.reshape(-1, 3), rows, face_normals(corners)[1], count, random)


def _spread(point: Array, triangles: Rows, areas: Array, count: int, random: np.random.Generator) -> tuple[Array, Ints]:
    """Do the same for triangles (t, 3), rows of `point`, of known areas (t,)."""
    area = np.cumsum(areas, dtype=np.float64)
    row = np.searchsorted(area[:-1], (np.arange(count) + random.random(count)) / count * area[-1])
    share = np.sort(random.random((count, 2)), axis=1)
    weights = np.stack([share[:, 0], share[:, 1] - share[:, 0], 1 - share[:, 1]], -1)
    return np.einsum("nk,nkd->nd", weights, point[triangles[row]]), row


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
