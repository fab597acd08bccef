"""Simplify surfaces by edge collapse, in the order of quadric errors (Garland and Heckbert 1997).

The triangles of an object's images overlap, cross and end in fringes, at which simplifiers for manifolds stop. This one
makes no demands on the surface. It works in rounds over arrays: each round collapses all edges that are the cheapest at
both of their ends.
"""

from dataclasses import dataclass, replace

import numpy as np

from depthwalk.cook.quadrics import ClusteredSurface, optimal_points, squared_distances
from depthwalk.geometry.distinct import sorted_distinct
from depthwalk.geometry.indexed_triangles import (
    PAIR_BITS,
    any_corner,
    distinct_triangles,
    drop_unused,
    normals_and_areas,
)
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.geometry.spatial_order import stable_order
from depthwalk.geometry.vectors import lengths
from depthwalk.parallel import Map, batches
from depthwalk.types import Array, Ints, Mask

_MAX_ROUNDS = 60
_MIN_SHARE = 0.01  # of the vertices: a round that collapses fewer edges is the last
_STIFFNESS = 1e-3  # of a surface's weight: pulls a vertex to its edge's midpoint where planes leave it free
_SHORT = 1e-4  # part of an edge's length that counts as an error: in flat areas, short edges go first
_LEAST = 1e-200  # metres⁴: costs are never 0, so that the random factor makes all of them differ
_TURN = 0.2  # cosine: triangles that turn further than that have flipped
_BATCH = 1 << 15  # edges or triangles at a time: with fewer, threads wait for each other more than for memory


@dataclass(frozen=True, kw_only=True)
class _Edges(StructOfArrays):
    """Hold m edges that may be collapsed.

    start, end: (m,) vertices; target: (m, 3), where the merged vertex would be, metres; quadric (m, 10) and weight (m,)
    of the merged vertex; cost: (m,), its squared distances, metres⁴.
    """

    start: Ints
    end: Ints
    target: Array
    quadric: Array
    weight: Array
    cost: Array


@dataclass(frozen=True)
class _Known:
    """Hold what one round passes on to the next.

    new: (n,) bool, vertices made by the round, whose edges have not been examined; cheap: the edges elsewhere that may
    be collapsed, in the order of their ends.
    """

    new: Mask
    cheap: _Edges | None


def collapse_edges(surface: ClusteredSurface, tolerance: float, parallel: Map = map) -> ClusteredSurface:
    """Reduce the triangles of a surface by collapsing edges while it deviates by at most about a tolerance.

    An edge may collapse to a vertex while the squared distance of this vertex, integrated over the surface that it
    represents, is at most tolerance⁴: an area of tolerance² may be off by the tolerance, a smaller area by more.

    Parameters
    ----------
    surface
        The surface to simplify.
    tolerance
        Allowed distance from the original surface, metres.
    parallel
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    ClusteredSurface
        The simplified surface.
    """
    random = np.random.default_rng(0)
    known = _Known(np.ones(len(surface.point), bool), None)
    for _ in range(_MAX_ROUNDS):
        before = len(surface.point)
        surface, known = _collapse_once(surface, known, tolerance, random, parallel)
        if before - len(surface.point) <= _MIN_SHARE * before:
            break
    return surface


def _collapse_once(
    surface: ClusteredSurface, known: _Known, tolerance: float, random: np.random.Generator, parallel: Map
) -> tuple[ClusteredSurface, _Known]:
    """Do one round; return the remaining surface, and what is known of it."""
    cheap, chosen = _cheapest(surface, known, tolerance, random, parallel)
    start, end = chosen.start, chosen.end
    moved, number = surface.point.copy(), np.arange(len(surface.point))
    moved[start], moved[end], number[end] = chosen.target, chosen.target, start
    flipped = _flipped(surface, moved, np.concatenate([start, end]), tolerance, parallel)
    undone = flipped.take(start) | flipped.take(end)
    number[end[undone]] = end[undone]
    for side in start[undone], end[undone]:
        moved[side] = surface.point.take(side, 0)
    kept = np.flatnonzero(~undone)
    quadric, weight = surface.quadric.copy(), surface.weight.copy()
    quadric[start[kept]], weight[start[kept]] = chosen.quadric.take(kept, 0), chosen.weight[kept]
    new = np.zeros(len(moved), bool)
    new[start[kept]] = True
    # Only at a new vertex can a triangle have become a copy of another.
    triangles = number.take(surface.triangles)
    touched = any_corner(new, triangles)
    unchanged = triangles.take(np.flatnonzero(~touched), 0)
    triangles = np.concatenate([unchanged, distinct_triangles(triangles.take(np.flatnonzero(touched), 0))])
    left, triangles = drop_unused(triangles, len(moved))
    simplified = ClusteredSurface(
        point=moved.take(left, 0), triangles=triangles, quadric=quadric.take(left, 0), weight=weight.take(left)
    )
    gone = new | (number != np.arange(len(number)))
    cheap = cheap.take(np.flatnonzero(~(gone.take(cheap.start) | gone.take(cheap.end))))
    renumbered = np.full(len(moved), -1)
    renumbered[left] = np.arange(len(left))
    cheap = replace(cheap, start=renumbered.take(cheap.start), end=renumbered.take(cheap.end))
    return simplified, _Known(new.take(left), cheap)


def _flipped(surface: ClusteredSurface, moved: Array, changed: Ints, tolerance: float, parallel: Map) -> Mask:
    """Return the vertices (n,) of triangles that flip when vertices are moved.

    moved: (n, 3), their positions afterwards, metres; changed: (m,) the vertices that are moved.
    """
    elsewhere = np.zeros(len(moved), bool)
    elsewhere[changed] = True
    triangles = surface.triangles.take(np.flatnonzero(any_corner(elsewhere, surface.triangles)), 0)

    def flipped_of(batch: slice) -> Ints:
        normal, area = normals_and_areas(moved, triangles[batch])
        turned = np.einsum("ij,ij->i", normal, normals_and_areas(surface.point, triangles[batch])[0]) < _TURN
        # Triangles smaller than the tolerance may turn freely: folds are full of them.
        return np.asarray(triangles[batch][turned & (area > tolerance**2)])

    flipped = np.zeros(len(moved), bool)
    for corners in parallel(flipped_of, batches(len(triangles), _BATCH)):
        flipped[corners] = True
    return flipped


def _cheapest(
    surface: ClusteredSurface, known: _Known, tolerance: float, random: np.random.Generator, parallel: Map
) -> tuple[_Edges, _Edges]:
    """Return all edges that may be collapsed, and those of them that are the cheapest at both of their ends."""
    edges = _cheap_edges(surface, *_new_edges(surface.triangles, known.new), tolerance, parallel)
    if known.cheap is not None and len(known.cheap.start):
        edges = _Edges.joined([edges, known.cheap])
        edges = edges.take(stable_order(edges.start << PAIR_BITS | edges.end))
    length = lengths(surface.point.take(edges.start, 0) - surface.point.take(edges.end, 0))
    # A random factor, so that edges whose collapse was undone do not come first in every round.
    cost = (edges.cost + _SHORT * edges.weight * length**2 + _LEAST) * random.uniform(1, 1.3, len(length))
    least = np.full(len(surface.point), np.inf)
    for end in edges.start, edges.end:
        np.minimum.at(least, end, cost)
    cheapest = (least.take(edges.start) == cost) & (least.take(edges.end) == cost)
    return edges, edges.take(np.flatnonzero(cheapest))


def _new_edges(triangles: Ints, new: Mask) -> tuple[Ints, Ints]:
    """Return both ends (m,) of all edges of triangles (t, 3) that have an end in `new` (n,), each edge once."""
    corners = np.ascontiguousarray(triangles.T)
    marks = new.take(corners)
    keys = []
    for one, other in (0, 1), (1, 2), (2, 0):
        chosen = np.flatnonzero(marks[one] | marks[other])
        start, end = corners[one].take(chosen), corners[other].take(chosen)
        keys.append(np.minimum(start, end) << PAIR_BITS | np.maximum(start, end))
    key = sorted_distinct(np.concatenate(keys))
    return np.asarray(key >> PAIR_BITS), np.asarray(key & (1 << PAIR_BITS) - 1)


def _cheap_edges(surface: ClusteredSurface, start: Ints, end: Ints, tolerance: float, parallel: Map) -> _Edges:
    """Return those of the edges with ends (m,) that may be collapsed."""

    def cheap(batch: slice) -> _Edges:
        edges = _edges(surface, start[batch], end[batch])
        return edges.take(np.flatnonzero(edges.cost <= tolerance**4))

    return _Edges.joined(list(parallel(cheap, batches(len(start), _BATCH))))


def _edges(surface: ClusteredSurface, start: Ints, end: Ints) -> _Edges:
    """Return the results of collapsing edges with ends (m,)."""
    quadric = surface.quadric.take(start, 0)
    quadric += surface.quadric.take(end, 0)
    weight = surface.weight.take(start) + surface.weight.take(end)
    one, other = surface.point.take(start, 0), surface.point.take(end, 0)
    middle = (one + other) / 2
    columns = np.ascontiguousarray(quadric.T)
    target = optimal_points(columns, _STIFFNESS * weight + 1e-30, middle)
    astray = lengths(target - middle) > lengths(one - other)
    target[astray] = middle[astray]
    cost = np.maximum(squared_distances(columns, target), 0)
    return _Edges(start=start, end=end, target=target, quadric=quadric, weight=weight, cost=cost)
