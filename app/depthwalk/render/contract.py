"""Surfaces with fewer triangles: edges contracted in the order of quadric errors (Garland and Heckbert 1997).

What the faces of an object draw overlaps, crosses and ends in fringes; simplifiers for manifolds stop there. This one
asks nothing of a surface. It is done in rounds over arrays: in each, all edges are contracted that are the cheapest at
both of their ends.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.normals import doubled_areas

Array = NDArray[np.floating]
Ints = NDArray[np.int64]

_BITS = 21  # of a vertex number, so that three fit into one key
_MOST_ROUNDS = 60
_WORTH = 0.01  # of the vertices: a round that contracts fewer is the last
_STIFFNESS = 1e-3  # of a surface's weight: draws a vertex to the middle of its edge where planes leave it free
_SHORT = 1e-4  # part of an edge's length that counts as an error: where all is flat, short ones go first
_TURN = 0.2  # cosine: triangles that turn further than that have flipped
_PAIRS = np.triu_indices(4)  # a quadric is the upper half of a symmetric matrix, 4 × 4


@dataclass(frozen=True)
class WeldedSurface:
    """Triangles that share vertices, and what each vertex stands for.

    point: (n, 3) metres; triangles: (t, 3); quadric: (n, 10) and weight: (n,): the squared distance from all planes
    that it stands for, weighted by their areas, and the sum of these.
    """

    point: Array
    triangles: Ints
    quadric: Array
    weight: Array


def weld(point: Array, triangles: Ints, yields: NDArray[np.bool_], cell: float) -> WeldedSurface:
    """Triangles (t, 3) of points (n, 3), of which those within a cube of side `cell`, metres, become one: the first
    that does not yield (n,); but for those that face the other way, as the two sides of a leaf."""
    cube = np.floor((point - point.min(0)) / cell).astype(np.int64)
    key = cube @ (1 << 2 * _BITS, 1 << _BITS, 1)
    first, number = _groups(key, yields)
    facing = _facing(point, triangles)
    first, number = _groups(2 * number + (np.einsum("ij,ij->i", facing, facing[first][number]) < 0), yields)
    triangles = _distinct(number[triangles])
    used, corners = np.unique(triangles, return_inverse=True)
    point, triangles = point[first][used].astype(np.float64), corners.reshape(-1, 3)
    return WeldedSurface(point, triangles, *_quadrics(point, triangles))


def _groups(key: Ints, yields: NDArray[np.bool_]) -> tuple[Ints, Ints]:
    """Points of one `key` (n,) are a group: the first (g,) of each that does not yield (n,), if any, and the group (n,)
    of each point."""
    order = np.lexsort((yields, key))
    _, first, place = np.unique(key[order], return_index=True, return_inverse=True)
    number = np.empty(len(key), np.int64)
    number[order] = place
    return order[first], number


def _facing(point: Array, triangles: Ints) -> Array:
    """Normals (n, 3) of points (n, 3), not unit: the sums of their triangles' (t, 3)."""
    facing = np.zeros(point.shape)
    _gather(facing, triangles.ravel(), np.repeat(doubled_areas(point, triangles), 3, axis=0))
    return facing


def contract(surface: WeldedSurface, tolerance: float) -> WeldedSurface:
    """Contracts all edges by which the squared distance to what their vertex stands for, integrated over that, grows to
    no more than `tolerance`⁴, metres: so far may an area of tolerance² come off, a smaller one farther."""
    random = np.random.default_rng(0)
    for _ in range(_MOST_ROUNDS):
        before = len(surface.point)
        surface = _contract_once(surface, tolerance, random)
        if before - len(surface.point) <= _WORTH * before:
            break
    return surface


def _contract_once(surface: WeldedSurface, tolerance: float, random: np.random.Generator) -> WeldedSurface:
    start, end, target, quadric, weight = _cheapest(surface, tolerance, random)
    moved, number = surface.point.copy(), np.arange(len(surface.point))
    moved[start], moved[end], number[end] = target, target, start
    triangles = number[surface.triangles]
    # What is smaller than the tolerance may turn as it likes: folds are full of that.
    normal, area = _normals(moved, triangles)
    turned = np.einsum("ij,ij->i", normal, _normals(surface.point, surface.triangles)[0]) < _TURN
    spoilt = np.zeros(len(moved), bool)
    spoilt[triangles[turned & (area > tolerance**2)]] = True
    kept, undone = ~spoilt[start], spoilt[start]
    number[end[undone]] = end[undone]
    for ends in start, end:
        moved[ends[undone]] = surface.point[ends[undone]]
    all_quadrics, all_weights = surface.quadric.copy(), surface.weight.copy()
    all_quadrics[start[kept]], all_weights[start[kept]] = quadric[kept], weight[kept]
    triangles = _distinct(number[surface.triangles])
    used, corners = np.unique(triangles, return_inverse=True)
    return WeldedSurface(moved[used], corners.reshape(-1, 3), all_quadrics[used], all_weights[used])


def _cheapest(
    surface: WeldedSurface, tolerance: float, random: np.random.Generator
) -> tuple[Ints, Ints, Array, Array, Array]:
    """Edges that share no end: both ends (m,), where these come to lie (m, 3), quadric (m, 10) and weight (m,)."""
    ends = np.sort(surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    key = np.sort(ends[:, 0] << _BITS | ends[:, 1])
    key = key[np.diff(key, prepend=-1) > 0]  # np.unique hashes, at ten times the cost
    start, end = key >> _BITS, key & (1 << _BITS) - 1
    quadric = surface.quadric[start] + surface.quadric[end]
    weight = surface.weight[start] + surface.weight[end]
    middle = (surface.point[start] + surface.point[end]) / 2
    length = np.linalg.norm(surface.point[start] - surface.point[end], axis=1)
    target = _optimum(quadric, _STIFFNESS * weight + 1e-30, middle)
    astray = np.linalg.norm(target - middle, axis=1) > length
    target[astray] = middle[astray]
    cost = np.maximum(_squared_distance(quadric, target), 0)
    cheap = np.flatnonzero(cost <= tolerance**4)
    # A little by chance, lest those that are undone come first in every round.
    order = np.argsort((cost[cheap] + _SHORT * weight[cheap] * length[cheap] ** 2) * random.uniform(1, 1.3, len(cheap)))
    cheap = cheap[order]
    rank, best = np.arange(len(cheap)), np.full(len(surface.point), len(cheap))
    for each in start[cheap], end[cheap]:
        np.minimum.at(best, each, rank)
    chosen = cheap[(best[start[cheap]] == rank) & (best[end[cheap]] == rank)]
    return start[chosen], end[chosen], target[chosen], quadric[chosen], weight[chosen]


def _quadrics(point: Array, triangles: Ints) -> tuple[Array, Array]:
    """Of each vertex, from the planes of its triangles and from planes upright on edges that end the surface."""
    normal, area = _normals(point, triangles)
    count = len(point)
    quadric, weight = np.zeros((count, len(_PAIRS[0]))), np.zeros(count)
    planes = _plane_quadrics(normal, point[triangles[:, 0]], area)
    for corner in triangles.T:
        _gather(quadric, corner, planes)
        weight += np.bincount(corner, area, count)
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    open_ = np.flatnonzero(~np.isin(start << _BITS | end, end << _BITS | start))
    start, end = start[open_], end[open_]
    along = point[end] - point[start]
    outward = np.cross(along, normal[open_ // 3])
    length = np.linalg.norm(outward, axis=1)
    planes = _plane_quadrics(outward / np.maximum(length, 1e-30)[:, None], point[start], length**2)
    for corner in start, end:
        _gather(quadric, corner, planes)
    return quadric, weight


def _plane_quadrics(normal: Array, point: Array, weight: Array) -> Array:
    """(n, 10) of planes through points (n, 3)."""
    plane = np.column_stack([normal, -np.einsum("ij,ij->i", normal, point)])
    return np.asarray(plane[:, _PAIRS[0]] * plane[:, _PAIRS[1]] * weight[:, None])


def _gather(quadric: Array, vertex: Ints, added: Array) -> None:
    for column, values in zip(quadric.T, added.T, strict=True):
        column += np.bincount(vertex, values, len(quadric))


def _squared_distance(quadric: Array, point: Array) -> Array:
    at = np.column_stack([point, np.ones(len(point))])
    twice = np.where(_PAIRS[0] == _PAIRS[1], 1.0, 2.0)
    return np.einsum("ij,ij,j->i", quadric, at[:, _PAIRS[0]] * at[:, _PAIRS[1]], twice)


def _optimum(quadric: Array, stiffness: Array, middle: Array) -> Array:
    """The points (n, 3) of the least error, springs to `middle` included: Cramer's rule, 3 × 3."""
    xx, xy, xz, yy, yz, zz = quadric[:, [0, 1, 2, 4, 5, 7]].T
    xx, yy, zz = xx + stiffness, yy + stiffness, zz + stiffness
    right = stiffness[:, None] * middle - quadric[:, [3, 6, 8]]
    first = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    second = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    adjugate = np.stack([*first, first[1], second[0], second[1], first[2], second[1], second[2]], -1)
    determinant = xx * first[0] + xy * first[1] + xz * first[2]
    return np.asarray(np.einsum("nij,nj->ni", adjugate.reshape(-1, 3, 3), right) / determinant[:, None])


def _normals(point: Array, triangles: Ints) -> tuple[Array, Array]:
    """Unit normals (t, 3) and areas (t,)."""
    across = doubled_areas(point, triangles)
    length = np.linalg.norm(across, axis=1)
    return across / np.maximum(length, 1e-30)[:, None], length / 2


def _distinct(triangles: Ints) -> Ints:
    """Triangles (t, 3) with three corners, each once, the smallest number first."""
    following = np.roll(triangles, -1, axis=1)
    triangles = triangles[(triangles != following).all(1)]
    first = triangles.argmin(1)[:, None]
    triangles = np.take_along_axis(triangles, (np.arange(3) + first) % 3, axis=1)
    _, once = np.unique(triangles @ (1 << 2 * _BITS, 1 << _BITS, 1), return_index=True)
    return np.asarray(triangles[once])
