"""Choose the edges that a round of simplification collapses, and their targets: the cheapest that do not touch.

A collapse costs its quadric error (Garland and Heckbert 1997), plus a little for turned normals and lost seams.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from depthwalk.cook.colour_quadrics import best_colours, reduced
from depthwalk.cook.kernels.collapse_costs import NORMAL, SEAM, SHORT, STIFFNESS
from depthwalk.cook.quadrics import optimal_points, squared_distances
from depthwalk.cook.seamed_mesh import DirectedEdges, Places, Vertices, contains, special_places
from depthwalk.geometry.distinct import sorted_distinct
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.geometry.spatial_order import within_runs
from depthwalk.types import Array, Ints, Mask

_TURNS = 4  # in which the collapses of a round are chosen
_ELIGIBLE = 0.5  # part of the collapses that a group still needs: a round takes some of this many cheapest ones
_FEWEST_ELIGIBLE = 8  # least number of a group's edges that may collapse in a round
_NEVER = np.iinfo(np.int64).max


@dataclass(frozen=True)
class Collapses(StructOfArrays):
    """Hold n collapses of edges: `start` (n,) vanishes, and `end` (n,) moves to `target` (n, 3).

    free: (n,) whether `end` may move at all; loose: (n,) whether a seam is lost, so that each vertex merges with the
    vertex at `end` whose appearance differs least; key: (n,) see `DirectedEdges`; cost: (n,).
    """

    start: Ints
    end: Ints
    target: Array
    free: Mask
    loose: Mask
    key: Ints
    cost: Array


def able_edges(edges: DirectedEdges, locked: Mask, banned: Ints) -> Ints:
    """Return the edges (n,) whose start may move to their end. banned: keys of those that have failed, ascending."""
    # Vertices on an open edge move along open edges only.
    able = ~locked[edges.start] & ((edges.count != 2) | ~special_places(edges)[edges.start])
    rows = np.flatnonzero(able)
    return rows[~contains(banned, edges.key[rows])] if len(banned) else rows


def seams_at(vertices: Vertices, edges: DirectedEdges, triangles: Ints) -> tuple[Mask, Mask]:
    """Return at which edges (e,) a seam would be lost, and at which the vertices of both ends correspond one to one."""
    used = np.zeros(len(vertices.place), bool)
    used[triangles] = True
    count = np.bincount(vertices.place[used], minlength=len(edges.first) - 1)
    several = np.flatnonzero((count > 1)[vertices.place[triangles]].any(1))
    corners = triangles[several]
    pairs = np.concatenate([corners[:, [i, j]] for i in range(3) for j in range(3) if i != j])
    key = sorted_distinct(pairs[:, 0] * len(used) + pairs[:, 1])
    start, end = (vertices.place[side] for side in np.divmod(key, len(used)))
    met = np.bincount(np.searchsorted(edges.key, start * len(count) + end), minlength=len(edges.key))
    met = np.maximum(met, 1)
    return met != count[edges.start], (met == count[edges.start]) & (met == count[edges.end])


def best_collapses(
    places: Places,
    edges: DirectedEdges,
    able: Ints,
    locked: Mask,
    seams: tuple[Mask, Mask],
    colour_of: Callable[[Ints], Array] | None = None,
) -> Collapses:
    """Return the collapses of the edges `able` (n,), with their best targets.

    seams: see `seams_at`; colour_of: returns the colours (m, 3), 0 to 1, of places (m,) with one vertex; None if
    colours do not count.
    """
    start, end = edges.start[able], edges.end[able]
    special = special_places(edges)
    loose, paired = (found[able] for found in seams)
    free = ~locked[end] & (special[start] == special[end]) & paired
    quadric: Array = places.quadric.take(start, 0) + places.quadric.take(end, 0)
    quadric = np.ascontiguousarray(quadric.T)
    tint: Array = np.zeros((0, 0))
    if colour_of:
        tint = np.ascontiguousarray((places.tint.take(start, 0) + places.tint.take(end, 0)).T)
        quadric = reduced(quadric, tint)
    from_, to = places.point.take(start, 0), places.point.take(end, 0)
    weight = places.weight.take(start)
    away = np.square(to - from_).sum(1)
    rows = np.flatnonzero(free)
    middle = (from_[rows] + to[rows]) / 2
    stiffness = STIFFNESS * (weight[rows] + places.weight.take(end[rows])) + 1e-30
    best = optimal_points(quadric[:, rows], stiffness, middle)
    astray = np.square(best - middle).sum(1) > away[rows]
    best[astray] = middle[astray]
    target = to
    target[rows] = best
    turned = np.square(places.normal.take(end, 0) - places.normal.take(start, 0)).sum(1)
    cost = np.maximum(squared_distances(quadric, target), 0) + weight * (SHORT * away + NORMAL**2 * turned)
    cost += weight * SEAM**2 * loose
    if colour_of:  # an end that stays keeps its colour, too
        rows = np.flatnonzero(~free & (places.tint[end, -1] > 0))
        off = np.square(colour_of(end[rows]) - best_colours(tint[:, rows], target[rows])).sum(1)
        cost[rows] += tint[-1, rows] * off
    return Collapses(start, end, target, free, loose, edges.key[able], cost)


def cheapest(collapses: Collapses, corners: Ints, group: Ints, missing: Ints) -> Collapses:
    """Return the cheapest collapse at each place, limited to the cheapest of each group.

    corners: (t, 3) places of the triangles; group: (t,) of each; missing: (g,) collapses that each group needs.
    """
    start, cost = collapses.start, collapses.cost
    if not len(start):
        return collapses
    begins = np.flatnonzero(np.diff(start, prepend=-1))
    least = np.repeat(np.minimum.reduceat(cost, begins), np.diff(begins, append=len(start)))
    best = np.flatnonzero(cost == least)
    best = best[np.flatnonzero(np.diff(start[best], prepend=-1))]
    group_of = np.zeros(int(corners.max()) + 1, group.dtype)
    group_of[corners] = group[:, None]
    best = best[np.lexsort((cost[best], group_of[start[best]]))]
    of = group_of[start[best]]
    rank = within_runs(np.bincount(of, minlength=len(missing)))
    return collapses.take(best[rank < np.maximum(_ELIGIBLE * missing, np.minimum(_FEWEST_ELIGIBLE, 4 * missing))[of]])


def independent(edges: DirectedEdges, collapses: Collapses, priority: Array) -> Ints:
    """Return rows of collapses that do not share any end or any neighbour of an end.

    Those first in priority within their surroundings are taken, then those first among the rest, and so on (Luby 1986).
    priority: (n,) the lowest come first.
    """
    own = np.empty(len(priority), np.int64)
    own[np.argsort(priority)] = np.arange(len(priority))
    left = np.arange(len(priority))
    taken: list[Ints] = []
    while len(left) and len(taken) < _TURNS:
        ends = np.concatenate([collapses.start[left], collapses.end[left]])
        first = _least_around(edges, ends, np.tile(own[left], 2)).reshape(2, -1)
        wins = (first == own[left]).all(0)
        taken.append(left[wins])
        winners = np.concatenate([collapses.start[left[wins]], collapses.end[left[wins]]])
        near = _least_around(edges, winners, np.zeros(len(winners), np.int64), ends).reshape(2, -1)
        left = left[(near > 0).all(0)]
    return np.concatenate(taken)


def _least_around(edges: DirectedEdges, places: Ints, numbers: Ints, at: Ints | None = None) -> Ints:
    """Return the least of the `numbers` (n,), which belong to `places` (n,), within two edges' distance.

    at: places (m,) for which to find it; None: the same places.
    """
    least = np.full(len(edges.first) - 1, _NEVER)
    np.minimum.at(least, places, numbers)
    used = np.flatnonzero(np.diff(edges.first))
    for _ in range(2):
        least[used] = np.minimum(least[used], np.minimum.reduceat(least[edges.end], edges.first[used]))
    return least[places if at is None else at]
