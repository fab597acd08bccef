"""Surfaces with fewer triangles: edges contracted in the order of quadric errors (Garland and Heckbert 1997).

What the faces of an object draw overlaps, crosses and ends in fringes; simplifiers for manifolds stop there. This one
asks nothing of a surface. It is done in rounds over arrays: in each, all edges are contracted that are the cheapest at
both of their ends.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.sharp_features import SharpFeatures
from depthwalk.geometry.soa import Takes
from depthwalk.geometry.triangles import doubled_areas
from depthwalk.geometry.vectors import lengths
from depthwalk.parallel import Map, batches
from depthwalk.types import Array, Ints

_BITS = 21  # of the number of a vertex, or of a cube along an axis, so that three fit into one key
_MASK = (1 << _BITS) - 1
_MOST_ROUNDS = 60
_WORTH = 0.01  # of the vertices: a round that contracts fewer is the last
_STIFFNESS = 1e-3  # of a surface's weight: draws a vertex to the middle of its edge where planes leave it free
_SHORT = 1e-4  # part of an edge's length that counts as an error: where all is flat, short ones go first
_TURN = 0.2  # cosine: triangles that turn further than that have flipped
_BATCH = 1 << 14  # edges or triangles at a time: what is known of them stays in the cache
_PAIRS = np.triu_indices(4)  # a quadric is the upper half of a symmetric matrix, 4 × 4


@dataclass(frozen=True)
class ClusteredSurface:
    """Triangles that share vertices, and what each vertex stands for.

    point: (n, 3) metres; triangles: (t, 3); quadric: (n, 10) and weight: (n,): the squared distance from all planes
    that it stands for, weighted by their areas, and the sum of these.
    """

    point: Array
    triangles: Ints
    quadric: Array
    weight: Array

    @property
    def area(self) -> float:
        """Metres²."""
        return float(_normals(self.point, self.triangles)[1].sum())


@dataclass(frozen=True)
class _Live:
    """Where edges may have become cheap since all were looked at: vertices (n,) that are `new`, and vertices (n,) that
    are `ends` of what was cheap."""

    new: NDArray[np.bool_]
    ends: NDArray[np.bool_]


@dataclass(frozen=True)
class _Edges(Takes):
    """m edges. start, end: (m,); target: (m, 3) where these would come to lie; quadric: (m, 10); weight, cost: (m,)."""

    start: Ints
    end: Ints
    target: Array
    quadric: Array
    weight: Array
    cost: Array


def cluster_vertices(point: Array, triangles: Ints, rank: Ints, cell: float) -> tuple[Array, Ints]:
    """Points (m, 3) float64 and the triangles (u, 3) that are left where those of points (n, 3) within a cube of side
    `cell`, metres, become one: the first of the least `rank` (n,); but for those that face the other way, as the two
    sides of a leaf. triangles: (t, 3)."""
    first, number = _groups(voxel_keys(point - point.min(0), cell), rank)
    facing = vertex_directions(point, triangles)
    first, number = _groups(2 * number + (np.einsum("ij,ij->i", facing, facing[first][number]) < 0), rank)
    used, triangles = _renumbered(_distinct(number[triangles]), len(first))
    return point[first[used]].astype(np.float64), triangles


def voxel_keys(point: Array, side: float) -> Ints:
    """Numbers (n,) of the cubes of a lattice, `side` metres wide, that hold points (n, 3)."""
    x, y, z = np.floor(point / side).astype(np.int64).T
    return (x << 2 * _BITS) + (y << _BITS) + z


def surface_of(point: Array, triangles: Ints, facets: SharpFeatures | None = None) -> ClusteredSurface:
    """Triangles (t, 3) of points (n, 3), each of which stands for itself as yet.

    facets: n, of the points. Those of a triangle's corners then count for a half, its own plane and those upright on
    the surface's ends for the other: the former meet in ridges that the latter cut off, but outside of what is round,
    and the latter within.
    """
    quadric, weight = _quadrics(point, triangles)
    if facets is not None:
        quadric = (quadric + _facet_quadric(triangles, facets, _normals(point, triangles)[1])) / 2
    return ClusteredSurface(point, triangles, quadric, weight)


def _groups(key: Ints, rank: Ints) -> tuple[Ints, Ints]:
    """Points of one `key` (n,) are a group: the first (g,) of each of the least `rank` (n,), and the group (n,) of
    each point."""
    order = np.lexsort((rank, key))
    begins = np.diff(key[order], prepend=-1) > 0
    number = np.empty(len(key), np.int64)
    number[order] = np.cumsum(begins) - 1
    return order[begins], number


def vertex_directions(point: Array, triangles: Ints) -> Array:
    """Normals (n, 3) of points (n, 3), not unit: the sums of their triangles' (t, 3)."""
    facing = np.zeros(point.shape)
    for column, values in zip(facing.T, doubled_areas(point, triangles).T, strict=True):
        for corner in triangles.T:
            column += np.bincount(corner, values, len(point))
    return facing


def collapse_edges(surface: ClusteredSurface, tolerance: float, each: Map = map) -> ClusteredSurface:
    """Contracts all edges by which the squared distance to what their vertex stands for, integrated over that, grows to
    no more than `tolerance`⁴, metres: so far may an area of tolerance² come off, a smaller one farther."""
    random = np.random.default_rng(0)
    live = _Live(*np.ones((2, len(surface.point)), bool))
    for _ in range(_MOST_ROUNDS):
        before = len(surface.point)
        surface, live = _contract_once(surface, live, tolerance, random, each)
        if before - len(surface.point) <= _WORTH * before:
            break
    return surface


def _contract_once(
    surface: ClusteredSurface, live: _Live, tolerance: float, random: np.random.Generator, each: Map
) -> tuple[ClusteredSurface, _Live]:
    """One round: what is left, and what of it the next round is to look at."""
    cheap, chosen = _cheapest(surface, live, tolerance, random, each)
    start, end = chosen.start, chosen.end
    moved, number = surface.point.copy(), np.arange(len(surface.point))
    moved[start], moved[end], number[end] = chosen.target, chosen.target, start
    spoilt = _spoilt(surface, moved, tolerance, each)
    undone = spoilt[start] | spoilt[end]
    number[end[undone]] = end[undone]
    for side in start, end:
        moved[side[undone]] = surface.point[side[undone]]
    kept = ~undone
    quadric, weight = surface.quadric.copy(), surface.weight.copy()
    quadric[start[kept]], weight[start[kept]] = chosen.quadric[kept], chosen.weight[kept]
    new, ends = np.zeros((2, len(moved)), bool)
    new[start[kept]] = True
    ends[number[np.concatenate([cheap.start, cheap.end])]] = True
    # Only where a vertex is new can a triangle have become another's copy.
    triangles = number[surface.triangles]
    touched = _any_corner(new, triangles)
    triangles = np.concatenate([triangles[~touched], _distinct(triangles[touched])])
    left, triangles = _renumbered(triangles, len(moved))
    return ClusteredSurface(moved[left], triangles, quadric[left], weight[left]), _Live(new[left], ends[left])


def _spoilt(surface: ClusteredSurface, moved: Array, tolerance: float, each: Map) -> NDArray[np.bool_]:
    """Vertices (n,) of triangles that have flipped where these are `moved` (n, 3)."""
    triangles = surface.triangles[_any_corner((moved != surface.point).any(1), surface.triangles)]

    def flipped(some: slice) -> Ints:
        normal, area = _normals(moved, triangles[some])
        turned = np.einsum("ij,ij->i", normal, _normals(surface.point, triangles[some])[0]) < _TURN
        # What is smaller than the tolerance may turn as it likes: folds are full of that.
        return triangles[some][turned & (area > tolerance**2)]

    spoilt = np.zeros(len(moved), bool)
    for some in each(flipped, batches(len(triangles), _BATCH)):
        spoilt[some] = True
    return spoilt


def _cheapest(
    surface: ClusteredSurface, live: _Live, tolerance: float, random: np.random.Generator, each: Map
) -> tuple[_Edges, _Edges]:
    """All edges that may be contracted, and those of them that are the cheapest at both of their ends."""
    edges = _cheap_edges(surface, *_live_ends(surface.triangles, live), tolerance, each)
    length = lengths(surface.point[edges.start] - surface.point[edges.end])
    # A little by chance, lest those that are undone come first in every round.
    cost = (edges.cost + _SHORT * edges.weight * length**2) * random.uniform(1, 1.3, len(length))
    dearest_first = np.argsort(cost)[::-1]
    best = np.empty(len(surface.point), np.int64)
    ends = np.stack([edges.start, edges.end], -1)
    best[ends[dearest_first]] = dearest_first[:, None]  # the last written stays
    return edges, edges.take(np.flatnonzero((best[ends] == np.arange(len(ends))[:, None]).all(1)))


def _live_ends(triangles: Ints, live: _Live) -> tuple[Ints, Ints]:
    """Both ends (m,) of all edges of `triangles` that may have become cheap, or have been, each once."""
    new, ends = live.new[triangles], live.ends[triangles]
    keys = []
    for one, other in (0, 1), (1, 2), (2, 0):
        here = new[:, one] | new[:, other] | ends[:, one] & ends[:, other]
        start, end = triangles[here, one], triangles[here, other]
        keys.append(np.minimum(start, end) << _BITS | np.maximum(start, end))
    key = np.sort(np.concatenate(keys))
    key = key[np.diff(key, prepend=-1) > 0]  # np.unique hashes, at ten times the cost
    return key >> _BITS, key & _MASK


def _cheap_edges(surface: ClusteredSurface, start: Ints, end: Ints, tolerance: float, each: Map) -> _Edges:
    """Those of edges with ends (m,) that may be contracted."""

    def cheap(some: slice) -> _Edges:
        edges = _edges(surface, start[some], end[some])
        return edges.take(np.flatnonzero(edges.cost <= tolerance**4))

    return _Edges.joined(list(each(cheap, batches(len(start), _BATCH))))


def _edges(surface: ClusteredSurface, start: Ints, end: Ints) -> _Edges:
    quadric = surface.quadric[start] + surface.quadric[end]
    weight = surface.weight[start] + surface.weight[end]
    middle = (surface.point[start] + surface.point[end]) / 2
    columns = np.ascontiguousarray(quadric.T)
    target = _optimum(columns, _STIFFNESS * weight + 1e-30, middle)
    astray = lengths(target - middle) > lengths(surface.point[start] - surface.point[end])
    target[astray] = middle[astray]
    return _Edges(start, end, target, quadric, weight, np.maximum(_squared_distance(columns, target), 0))


def _quadrics(point: Array, triangles: Ints) -> tuple[Array, Array]:
    """Of each vertex, from the planes of its triangles and from planes upright on edges that end the surface."""
    normal, area = _normals(point, triangles)
    count = len(point)
    quadric, weight = np.zeros((count, len(_PAIRS[0]))), np.zeros(count)
    _add_planes(quadric, triangles.T, normal, point[triangles[:, 0]], area)
    for corner in triangles.T:
        weight += np.bincount(corner, area, count)
    start, end, outward = open_edges(point, triangles, normal)
    length = lengths(outward)
    upright = outward / np.maximum(length, 1e-30)[:, None]
    _add_planes(quadric, (start, end), upright, point[start], length**2)
    return quadric, weight


def _facet_quadric(triangles: Ints, facets: SharpFeatures, area: Array) -> Array:
    """(n, 10) of n vertices, from the facets of all corners of their triangles (t, 3), of areas (t,)."""
    count = len(facets.point)
    own, quadric = np.zeros((2, count, len(_PAIRS[0])))
    _add_planes(own, (np.arange(count),), facets.normal, facets.point, np.ones(count))
    for column, values in zip(quadric.T, own.T, strict=True):
        mean = values[triangles].mean(1) * area
        for corner in triangles.T:
            column += np.bincount(corner, mean, count)
    return quadric


def open_edges(point: Array, triangles: Ints, normal: Array) -> tuple[Ints, Ints, Array]:
    """Both ends (m,) of edges that end the surface of triangles (t, 3) with normals (t, 3), and vectors (m, 3) outward,
    as long as they are."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    # Both directions of an edge side by side, the last bit telling them apart.
    key = np.minimum(start, end) << _BITS + 1 | np.maximum(start, end) << 1 | (start > end)
    order = np.argsort(key)
    key = key[order]
    begins = np.flatnonzero(np.diff(key >> 1, prepend=-1))
    ends = np.append(begins[1:], len(key))
    one_way = key[begins] == key[ends - 1]
    open_ = np.sort(order[np.repeat(one_way, ends - begins)])
    start, end = start[open_], end[open_]
    return start, end, np.cross(point[end] - point[start], normal[open_ // 3])


def _add_planes(quadric: Array, vertices: Iterable[Ints], normal: Array, point: Array, weight: Array) -> None:
    """Adds planes through points (m, 3) to `quadric` (n, 10) of each of `vertices`, (m,) each."""
    plane = *normal.T, -np.einsum("ij,ij->i", normal, point)
    for column, one, other in zip(quadric.T, *_PAIRS, strict=True):
        values = plane[one] * plane[other] * weight
        for vertex in vertices:
            column += np.bincount(vertex, values, len(quadric))


def _squared_distance(quadric: Array, point: Array) -> Array:
    """(n,) of points (n, 3) to what `quadric` (10, n) stands for, weighted."""
    xx, xy, xz, xw, yy, yz, yw, zz, zw, ww = quadric
    x, y, z = point.T
    mixed = x * (xy * y + xz * z + xw) + y * (yz * z + yw) + z * zw
    return np.asarray(xx * x * x + yy * y * y + zz * z * z + 2 * mixed + ww)


def _optimum(quadric: Array, stiffness: Array, middle: Array) -> Array:
    """The points (n, 3) of the least error of `quadric` (10, n), springs to `middle` included: Cramer's rule, 3 × 3."""
    xx, xy, xz, xw, yy, yz, yw, zz, zw, _ = quadric
    xx, yy, zz = xx + stiffness, yy + stiffness, zz + stiffness
    x, y, z = stiffness * middle.T - (xw, yw, zw)
    first = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    second = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    determinant = xx * first[0] + xy * first[1] + xz * first[2]
    rows = first, (first[1], second[0], second[1]), (first[2], second[1], second[2])  # of the adjugate
    return np.stack([(a * x + b * y + c * z) / determinant for a, b, c in rows], -1)


def _normals(point: Array, triangles: Ints) -> tuple[Array, Array]:
    """Unit normals (t, 3) and areas (t,)."""
    across = doubled_areas(point, triangles)
    length = lengths(across)
    return across / np.maximum(length, 1e-30)[:, None], length / 2


def _distinct(triangles: Ints) -> Ints:
    """Triangles (t, 3) with three corners, each once, the smallest number first."""
    a, b, c = triangles.T
    # Of the three rotations, that with the smallest number first has the smallest key.
    keys = [one << 2 * _BITS | two << _BITS | three for one, two, three in ((a, b, c), (b, c, a), (c, a, b))]
    key = np.sort(np.minimum(np.minimum(*keys[:2]), keys[2])[(a != b) & (b != c) & (c != a)])
    key = key[np.diff(key, prepend=-1) > 0]
    return np.stack([key >> 2 * _BITS, key >> _BITS & _MASK, key & _MASK], -1)


def _any_corner(vertices: NDArray[np.bool_], triangles: Ints) -> NDArray[np.bool_]:
    """Which triangles (t, 3) have one of `vertices` (n,)."""
    a, b, c = triangles.T
    return vertices[a] | vertices[b] | vertices[c]  # `any` along so short an axis takes several times as long


def _renumbered(triangles: Ints, count: int) -> tuple[Ints, Ints]:
    """Those of `count` vertices that triangles (t, 3) have, rising, and these with the vertices' places among them."""
    used = np.zeros(count, bool)
    used[triangles] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[triangles]
