"""Measure how far simplified groups of triangles are from the mesh that they were made from, in place and in colour.

A triangle whose colour is off looks as wrong as one that is out of place. By how much depends on its size: as a surface
is averaged over a pixel, triangles smaller than that may differ a lot. So a difference in colour counts as a distance
in proportion to the edges of the triangle that shows it. Points are compared with the triangle that is nearest in both,
as in the space of positions and colours of Garland and Heckbert 1998, "Simplifying Surfaces with Color and Texture
using Quadric Error Metrics": a colour that has only moved counts by how far it has moved.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from depthwalk.bake.level_looks import unit
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
# A triangle with edges of one metre whose colour is off by 1, black instead of white in one channel, looks as wrong as
# one that is so many metres out of place (docs/experiments.md).
_OFF_COLOUR = 0.5


class Colours(NamedTuple):
    """Hold the colours, 0 to 1, of points (n, 3) on a mesh, and those at the corners of simplified triangles (t, 3, 3).

    Both are empty if the mesh has one colour everywhere.
    """

    point: Array
    corner: Array

    @classmethod
    def none(cls) -> "Colours":
        """Return no colours."""
        return cls(np.zeros((0, 3)), np.zeros((0, 3, 3)))


class Probes:
    """Follow points of a mesh through the clusters that replace the surface on which they lie.

    Half of the points are vertices, where simplification moves the surface most; the others are spread evenly.

    Attributes
    ----------
    point : (n, 3) the points; the mesh has a size of about 1.
    normal : (n, 3) their unit normals, as shaders interpolate them.
    colour : (n, 3) their colours, 0 to 1; (0, 3) for a mesh with one colour everywhere.
    cluster : (n,) the cluster that each belongs to, as the caller numbers them.
    """

    def __init__(
        self, point: Array, triangles: Rows, normals: Array, colours: Array, cluster: Rows, groups: int
    ) -> None:
        """Choose the points.

        Parameters
        ----------
        point
            (p, 3) positions of vertices.
        triangles
            (t, 3) rows of `point`.
        normals
            (t, 3, 3) the normals at the triangles' corners.
        colours
            (t, 3, 3) the colours at the triangles' corners, 0 to 1; (0, 3, 3) for a mesh with one colour everywhere.
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
        share, row = _spread(np.concatenate(areas), count, self._random)
        inside = np.einsum("nk,nkd->nd", share, point[triangles[row]])
        any_triangle = np.full(len(point), -1, np.int32)
        any_triangle[triangles] = np.arange(len(triangles), dtype=np.int32)[:, None]
        used = np.flatnonzero(any_triangle >= 0)
        chosen = used if len(used) <= count else np.sort(self._random.choice(used, count, replace=False))
        self.point = np.concatenate([inside, point[chosen]]).astype(np.float64)
        row = np.concatenate([row, any_triangle[chosen]])
        self.cluster = cluster[row].astype(np.int64)
        share = np.concatenate([share, triangles[any_triangle[chosen]] == chosen[:, None]])
        self.normal = unit(np.einsum("nk,nkd->nd", share, normals[row]))
        self.colour = np.zeros((0, 3))
        if len(colours):
            self.colour = np.einsum("nk,nkd->nd", share, colours[row])

    def thin_out(self, groups: int) -> None:
        """Drop some of the points if there are more than so many groups need."""
        count = max(_FEWEST, _PER_GROUP * groups)
        if len(self.point) > count:
            kept = np.sort(self._random.choice(len(self.point), count, replace=False))
            self.point, self.normal, self.cluster = self.point[kept], self.normal[kept], self.cluster[kept]
            if len(self.colour):
                self.colour = self.colour[kept]


def group_errors(
    point: Array, of: Ints, corners: Array, group: Ints, groups: int, colours: Colours | None = None
) -> tuple[Array, Ints]:
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
    colours
        The colours of the points and the triangles; None to measure positions alone.

    Returns
    -------
    tuple
        The distances (groups,), and the triangle (n,) that each point is near.
    """
    error = np.zeros(groups)
    if not (len(point) and len(corners)):
        return error, np.zeros(len(point), np.int64)
    colours = colours or Colours.none()
    metres = _OFF_COLOUR * np.sqrt(2 * face_normals(corners)[1]) if len(colours.point) else np.zeros(0)
    if loops := kernels.loaded():
        squared, nearest = loops.nearest(point, of, corners, group, colours.point, colours.corner, metres)
        np.maximum.at(error, of, squared)
        return np.sqrt(error), nearest
    distance = _Distance(point, corners, colours, metres)
    bound, nearest = _bounds(point, of, corners, group, distance)
    begins, ends = (np.searchsorted(group, np.arange(groups), side) for side in ("left", "right"))
    firsts = np.searchsorted(of, np.arange(groups + 1))
    for number in range(groups):
        rows, triangles = np.arange(*firsts[number : number + 2]), np.arange(begins[number], ends[number])
        error[number] = _greatest_distance(rows, bound, triangles, distance)
    return np.sqrt(error), nearest


class _Distance(NamedTuple):
    """Compute squared distances between points (n, 3) and triangles (t, 3, 3) in place and colour, by their rows.

    metres: (t,) that a difference of 1 between colours counts as.
    """

    point: Array
    corners: Array
    colours: Colours
    metres: Array

    def squared(self, points: Ints, triangles: Ints, bound: Array | float = np.inf) -> Array:
        """Return the squared distances of rows of points from rows of triangles, whose shapes are broadcast.

        bound: of the squared distances. Where positions alone are farther apart, colours are not compared.
        """
        distance = squared_distances(self.point[points], self.corners[triangles])
        if len(self.colours.point):
            near = np.nonzero(distance < bound)
            points, triangles = (np.broadcast_to(rows, distance.shape)[near] for rows in (points, triangles))
            share = nearest_shares(self.point[points], self.corners[triangles])
            shown = np.einsum("nk,nkd->nd", share, self.colours.corner[triangles])
            off = np.square(shown - self.colours.point[points]).sum(1)
            distance[near] += self.metres[triangles] ** 2 * off
        return distance


def _bounds(point: Array, of: Ints, corners: Array, group: Ints, distance_of: _Distance) -> tuple[Array, Ints]:
    """Return upper bounds (n,) of the squared distances of points, and the triangles (n,) at these distances."""
    apart = 10.0  # distance between groups along a fourth axis: many times the mesh's size
    spread, triangle = spread_points(corners, 2 * len(point), np.random.default_rng(0))
    triangle = np.concatenate([np.arange(len(corners)), triangle])
    tree = cKDTree(np.column_stack([np.concatenate([corners.mean(1), spread]), apart * group[triangle]]))
    bound, nearest = np.empty(len(point)), np.empty(len(point), np.int64)
    for batch in batches(len(point), _BATCH):
        here = point[batch]
        found = triangle[tree.query(np.column_stack([here, apart * of[batch]]), _NEAREST)[1] % len(triangle)]
        distance = distance_of.squared(np.arange(len(point))[batch, None], found)
        distance[group[found] != of[batch][:, None]] = np.inf
        best = distance.argmin(1)
        bound[batch] = distance[np.arange(len(best)), best]
        nearest[batch] = found[np.arange(len(best)), best]
    return bound, nearest


def _greatest_distance(rows: Ints, bound: Array, triangles: Ints, distance: _Distance) -> float:
    """Return the largest squared distance of points, rows (n,), from triangles, rows (t,), at most `bound` of each."""
    rows, greatest = rows[np.argsort(-bound[rows])], 0.0
    for batch in batches(len(rows), _EXACT):
        some = rows[batch]
        if bound[some].max(initial=0.0) <= greatest:
            break
        exact = distance.squared(some[:, None], triangles[None], bound[some][:, None]).min(1)
        greatest = max(greatest, float(np.minimum(exact, bound[some]).max(initial=0.0)))
    return greatest


def spread_points(corners: Array, count: int, random: np.random.Generator) -> tuple[Array, Ints]:
    """Return points (count, 3) spread evenly over triangles (t, 3, 3), and the triangle (count,) of each."""
    share, row = _spread(face_normals(corners)[1], count, random)
    return np.einsum("nk,nkd->nd", share, corners[row]), row


def _spread(areas: Array, count: int, random: np.random.Generator) -> tuple[Array, Ints]:
    """Return barycentric coordinates (count, 3) of points spread over triangles of known areas (t,), and the rows."""
    area = np.cumsum(areas, dtype=np.float64)
    row = np.searchsorted(area[:-1], (np.arange(count) + random.random(count)) / count * area[-1])
    share = np.sort(random.random((count, 2)), axis=1)
    return np.stack([share[:, 0], share[:, 1] - share[:, 0], 1 - share[:, 1]], -1), row


def nearest_shares(point: Array, corners: Array) -> Array:
    """Return barycentric coordinates (…, 3) of the points of triangles (…, 3, 3) that are nearest to points (…, 3)."""
    inside, v, w = _below(point, corners)
    edges = [(corners[..., k, :], corners[..., (k + 1) % 3, :]) for k in range(3)]
    nearest = np.stack([_from_edge(start, end, point) for start, end in edges]).argmin(0)
    shares = np.stack([1 - v - w, v, w], -1)
    for number, (start, end) in enumerate(edges):
        along = _along(start, end, point)
        on = np.roll(np.stack([1 - along, along, np.zeros_like(along)], -1), number, -1)
        shares = np.where(((nearest == number) & ~inside)[..., None], on, shares)
    return np.asarray(shares)


def squared_distances(point: Array, corners: Array) -> Array:
    """Return the squared distances of points (…, 3) from triangles (…, 3, 3)."""
    a, b, c = (corners[..., k, :] for k in range(3))
    inside, v, w = _below(point, corners)
    plane = np.square(point - a - v[..., None] * (b - a) - w[..., None] * (c - a)).sum(-1)
    edges = np.minimum(np.minimum(_from_edge(a, b, point), _from_edge(b, c, point)), _from_edge(c, a, point))
    return np.where(inside, plane, edges)


def _below(point: Array, corners: Array) -> tuple[Mask, Array, Array]:
    """Return whether points (…, 3) are above or below triangles (…, 3, 3), and the last two barycentric coordinates."""
    a, b, c = (corners[..., k, :] for k in range(3))
    ab, ac, ap = b - a, c - a, point - a
    d1, d2 = _dot(ab, ap), _dot(ac, ap)
    bb, cc, bc = _dot(ab, ab), _dot(ac, ac), _dot(ab, ac)
    area = np.maximum(bb * cc - bc * bc, 0)
    safe = np.where(area > 0, area, 1)
    v, w = (cc * d1 - bc * d2) / safe, (bb * d2 - bc * d1) / safe
    return (v >= 0) & (w >= 0) & (v + w <= 1) & (area > 0), v, w


def _from_edge(start: Array, end: Array, point: Array) -> Array:
    """Return squared distances of points (…, 3) from edges with end points (…, 3)."""
    share = _along(start, end, point)
    return np.asarray(np.square(point - start - share[..., None] * (end - start)).sum(-1))


def _along(start: Array, end: Array, point: Array) -> Array:
    """Return the part (…), 0 to 1, of the way along an edge that is nearest to a point (…, 3)."""
    along = end - start
    length = _dot(along, along)
    return np.asarray(np.clip(_dot(point - start, along) / np.where(length > 0, length, 1), 0, 1))


def _dot(one: Array, other: Array) -> Array:
    return np.asarray(np.einsum("...i,...i->...", one, other))
