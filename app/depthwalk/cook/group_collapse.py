"""Simplify many groups of triangles at once, each to a number of triangles of its own, and leave their borders alone.

Edge collapse in the order of quadric errors (Garland and Heckbert 1997), in rounds over arrays. Each round collapses
edges whose neighbourhoods do not touch, so that the tests made before it hold for all of them together.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.cook.quadrics import optimal_points, squared_distances
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.geometry.spatial_order import within_runs
from depthwalk.geometry.triangles import face_normals
from depthwalk.types import Array, Ints, Mask

_MAX_ROUNDS = 60
_TURNS = 4  # in which collapses of a round are chosen
_ELIGIBLE = 0.5  # times the collapses that a group still needs: its cheapest ones, of which a round takes some
_FEWEST_ELIGIBLE = 8  # edges of a group that may collapse in a round
_CHANCE = 2.0  # costs come out up to so many times as large in a round
_NORMAL = 0.001  # part of the mesh's size that counts as far apart as normals which differ by 1
_SEAM = 0.01  # the same for the loss of a seam
_SHORT = 1e-4  # part of an edge's squared length that counts as an error: where all is flat, short ones go first
_STIFFNESS = 1e-3  # of a surface's weight: draws a vertex to the middle of its edge where planes leave it free
_TURN = 0.25  # cosine: a triangle that turns further than that has flipped
_NEVER = np.iinfo(np.int64).max


@dataclass(kw_only=True)
class Places(StructOfArrays):
    """Hold the p places at which a mesh has vertices, in a frame in which it is about as large as 1.

    Attributes
    ----------
    point : (p, 3) where they are.
    normal : (p, 3) mean unit normals there, 0 where there is none.
    quadric : (p, 10) what they stand for, see `cook.quadrics`.
    weight : (p,) the area of that.
    """

    point: Array
    normal: Array
    quadric: Array
    weight: Array


@dataclass(kw_only=True)
class Vertices(StructOfArrays):
    """Hold the v vertices of a mesh. Along seams, where looks differ, several have one place.

    Attributes
    ----------
    place : (v,) rows of `Places`.
    part : (v,) which part of the mesh uses each; no vertex is replaced by that of another part.
    look : (v, k) what is interpolated between them: normals, colours and so on.
    """

    place: Ints
    part: Ints
    look: Array


@dataclass(frozen=True)
class _Edges:
    """Hold the directed edges between places, sorted by start, then end.

    key: (e,) start × places + end. start, end: (e,). count: (e,) triangles at each. first: (p + 1,) first by start.
    """

    key: Ints
    start: Ints
    end: Ints
    count: Ints
    first: Ints


@dataclass(frozen=True)
class _Collapses(StructOfArrays):
    """Hold n collapses of edges: `start` (n,) vanishes, and `end` (n,) moves to `target` (n, 3).

    free: (n,) whether `end` may move at all; loose: (n,) whether a seam is lost, so that looks are those of the
    vertices at `end` that differ least; key: (n,) see `_Edges`; cost: (n,).
    """

    start: Ints
    end: Ints
    target: Array
    free: Mask
    loose: Mask
    key: Ints
    cost: Array


def collapse_groups(
    places: Places, vertices: Vertices, triangles: Ints, group: Ints, wanted: Ints
) -> tuple[Ints, Ints, Mask]:
    """Simplify groups of triangles by edge collapse; what several groups share stays where it is.

    A collapse keeps the surface's topology (link condition, Dey et al. 1999), its seams and the course of its open
    edges. So a group may keep more triangles than are wanted.

    Parameters
    ----------
    places, vertices
        What the mesh consists of; both are overwritten where vertices move.
    triangles
        (t, 3) rows of `vertices`; the places of each triangle differ.
    group
        (t,) the group that each triangle belongs to, from 0 to g − 1.
    wanted
        (g,) how many triangles each group is to have.

    Returns
    -------
    tuple
        Triangles (n, 3) that are left, their groups (n,), and which of the places (p,) have moved.
    """
    random = np.random.default_rng(0)
    locked = _shared(vertices.place[triangles], group, len(places.point))
    moved = np.zeros(len(locked), bool)
    banned = np.zeros(0, np.int64)
    done_triangles, done_groups = [], []
    for _ in range(_MAX_ROUNDS):
        missing = -(-(np.bincount(group, minlength=len(wanted)) - wanted) // 2)
        done = (missing <= 0)[group]
        if done.any():
            done_triangles.append(triangles[done])
            done_groups.append(group[done])
            triangles, group = triangles[~done], group[~done]
        if not len(triangles):
            break
        edges = _directed_edges(vertices.place[triangles], len(locked))
        able = _able(edges, locked, banned)
        chosen = _collapses(places, edges, able, locked, _loose(vertices, edges, triangles))
        chosen = _cheapest(chosen, vertices.place[triangles], group, missing)
        if not len(chosen.start):
            break
        # A little by chance: where costs rise steadily, hardly any is the least around.
        chosen = chosen.take(_independent(edges, chosen, chosen.cost * random.uniform(1, _CHANCE, len(chosen.cost))))
        triangles, group, failed = _collapse(places, vertices, edges, triangles, group, chosen)
        moved[chosen.end[chosen.free & ~failed]] = True
        banned = np.union1d(banned, chosen.key[failed])
    return np.concatenate([*done_triangles, triangles]), np.concatenate([*done_groups, group]), moved


def _shared(corners: Ints, group: Ints, count: int) -> Mask:
    """Return which of `count` places triangles with `corners` (t, 3) of several groups (t,) share."""
    one = np.zeros(count, group.dtype)
    one[corners] = group[:, None]  # any of the groups
    locked = np.zeros(count, bool)
    locked[corners[one[corners] != group[:, None]]] = True
    return locked


def _directed_edges(corners: Ints, count: int) -> _Edges:
    """Return the edges of triangles with `corners` (t, 3), of `count` places, in both directions."""
    a, b, c = np.ascontiguousarray(corners.T)
    key = np.sort(np.concatenate([p * count + q for p, q in ((a, b), (b, a), (b, c), (c, b), (c, a), (a, c))]))
    begins = np.flatnonzero(np.diff(key, prepend=-1))
    key, triangles = key[begins], np.diff(begins, append=len(key))
    start, end = np.divmod(key, count)
    first = np.zeros(count + 1, np.int64)
    np.cumsum(np.bincount(start, minlength=count), out=first[1:])
    return _Edges(key, start, end, triangles, first)


def _special(edges: _Edges) -> Mask:
    """Return which places (p,) lie on an open edge, or on one where more than two faces meet."""
    special = np.zeros(len(edges.first) - 1, bool)
    special[edges.start[edges.count != 2]] = True
    return special


def _able(edges: _Edges, locked: Mask, banned: Ints) -> Ints:
    """Return the edges (n,) whose start may move to their end. banned: keys of those that have failed, rising."""
    # What lies on an open edge moves along open edges only.
    able = ~locked[edges.start] & ((edges.count != 2) | ~_special(edges)[edges.start])
    rows = np.flatnonzero(able)
    return rows[~_contains(banned, edges.key[rows])] if len(banned) else rows


def _loose(vertices: Vertices, edges: _Edges, triangles: Ints) -> tuple[Mask, Mask]:
    """Return at which edges (e,) a seam would be lost, and at which vertices at the two ends correspond one to one."""
    used = np.zeros(len(vertices.place), bool)
    used[triangles] = True
    count = np.bincount(vertices.place[used], minlength=len(edges.first) - 1)
    several = np.flatnonzero((count > 1)[vertices.place[triangles]].any(1))
    corners = triangles[several]
    pairs = np.concatenate([corners[:, [i, j]] for i in range(3) for j in range(3) if i != j])
    key = np.unique(pairs[:, 0] * len(used) + pairs[:, 1])
    start, end = (vertices.place[side] for side in np.divmod(key, len(used)))
    met = np.ones(len(edges.key), np.int64)
    rows, times = np.unique(np.searchsorted(edges.key, start * len(count) + end), return_counts=True)
    met[rows] = times
    return met != count[edges.start], (met == count[edges.start]) & (met == count[edges.end])


def _collapses(places: Places, edges: _Edges, able: Ints, locked: Mask, seams: tuple[Mask, Mask]) -> _Collapses:
    """Return the collapses of the edges `able` (n,), with their best targets. seams: see `_loose`."""
    start, end = edges.start[able], edges.end[able]
    special = _special(edges)
    loose, paired = (found[able] for found in seams)
    free = ~locked[end] & (special[start] == special[end]) & paired
    quadric = np.ascontiguousarray((places.quadric.take(start, 0) + places.quadric.take(end, 0)).T)
    from_, to = places.point.take(start, 0), places.point.take(end, 0)
    weight = places.weight.take(start)
    away = np.square(to - from_).sum(1)
    rows = np.flatnonzero(free)
    middle = (from_[rows] + to[rows]) / 2
    stiffness = _STIFFNESS * (weight[rows] + places.weight.take(end[rows])) + 1e-30
    best = optimal_points(quadric[:, rows], stiffness, middle)
    astray = np.square(best - middle).sum(1) > away[rows]
    best[astray] = middle[astray]
    target = to
    target[rows] = best
    turned = np.square(places.normal.take(end, 0) - places.normal.take(start, 0)).sum(1)
    cost = np.maximum(squared_distances(quadric, target), 0) + weight * (_SHORT * away + _NORMAL**2 * turned)
    cost += weight * _SEAM**2 * loose
    return _Collapses(start, end, target, free, loose, edges.key[able], cost)


def _cheapest(collapses: _Collapses, corners: Ints, group: Ints, missing: Ints) -> _Collapses:
    """Return the cheapest collapse of each place, and only the cheapest of each group.

    corners: (t, 3) places of the triangles; group: (t,) theirs; missing: (g,) how many collapses each group needs.
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


def _independent(edges: _Edges, collapses: _Collapses, priority: Array) -> Ints:
    """Return some of the n collapses, as rows, whose ends and all their neighbours no other one has.

    Those that come first of all around are taken, then those that come first of what is left, and so on (Luby 1986).
    priority: (n,) the least come first.
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


def _least_around(edges: _Edges, places: Ints, numbers: Ints, at: Ints | None = None) -> Ints:
    """Return the least of the `numbers` (n,), which belong to `places` (n,), of those at most two edges away.

    at: places (m,) around which it is found; None: the same.
    """
    least = np.full(len(edges.first) - 1, _NEVER)
    np.minimum.at(least, places, numbers)
    used = np.flatnonzero(np.diff(edges.first))
    for _ in range(2):
        least[used] = np.minimum(least[used], np.minimum.reduceat(least[edges.end], edges.first[used]))
    return least[places if at is None else at]


def _collapse(
    places: Places, vertices: Vertices, edges: _Edges, triangles: Ints, group: Ints, collapses: _Collapses
) -> tuple[Ints, Ints, Mask]:
    """Make n collapses where they are allowed.

    Returns the triangles and groups that are left, and which of the collapses (n,) are not allowed.
    """
    start, end = collapses.start, collapses.end
    number = np.full(len(places.point), -1)
    number[start] = number[end] = np.arange(len(start))
    all_corners = vertices.place[triangles]
    touched = number[all_corners].max(1)
    rows = np.flatnonzero(touched >= 0)
    collapse, corners, own = touched[rows], all_corners[rows], triangles[rows]
    is_start, is_end = corners == start[collapse, None], corners == end[collapse, None]
    vanish = is_start.any(1) & is_end.any(1)
    failed = _breaks_topology(edges, all_corners, collapses, corners, collapse, vanish, is_start)

    # Each vertex that vanishes must have one that it becomes, on its own side of seams.
    becomes = np.full(len(vertices.place), -1)
    gone, into = own[vanish][is_start[vanish]], own[vanish][is_end[vanish]]
    becomes[gone] = into
    loose = collapses.loose[collapse]
    becomes[own[loose][is_start[loose]]] = -1
    _match_loosely(
        vertices,
        becomes,
        *((own[loose][side[loose]], collapse[loose][side[loose].any(1)]) for side in (is_start, is_end)),
    )
    lost = own[is_start]
    failed[collapse[is_start.any(1)][becomes[lost] < 0]] = True
    failed[collapse[vanish][(becomes[gone] != into) & ~loose[vanish]]] = True

    stay = np.flatnonzero(~vanish)
    before = places.point[corners[stay]]
    after = np.where((is_start | is_end)[stay, :, None], collapses.target[collapse[stay], None], before)
    normal, turned = face_normals(before)[0], face_normals(after)[0]
    failed[collapse[stay[(np.einsum("ij,ij->i", normal, turned) < _TURN) & normal.any(1)]]] = True

    good = ~failed[collapse]
    triangles = triangles.copy()
    triangles[rows[good]] = np.where(is_start, becomes[own], own)[good]
    kept = np.ones(len(triangles), bool)
    kept[rows[good & vanish]] = False
    pairs = good[vanish] & collapses.free[collapse[vanish]]
    _move(places, vertices, collapses.take(~failed), gone[pairs], into[pairs])
    return triangles[kept], group[kept], failed


def _match_loosely(vertices: Vertices, becomes: Ints, gone: tuple[Ints, Ints], into: tuple[Ints, Ints]) -> None:
    """Let vertices that vanish become those of the same part, at the end of their collapses, whose looks differ least.

    becomes: (v,) is filled in, −1 where there is none; gone, into: (k,) vertices and the collapses (k,) that they are
    at the start and at the end of, which may be given several times.
    """
    if not len(gone[0]):
        return
    (one, of_one), (other, of_other) = (np.unique(np.stack(side), axis=1) for side in (gone, into))
    order = np.argsort(of_other, kind="stable")
    other, of_other = other[order], of_other[order]
    first, last = np.searchsorted(of_other, of_one), np.searchsorted(of_other, of_one, "right")
    pair = np.repeat(np.arange(len(one)), last - first)
    candidate = other[np.repeat(first, last - first) + within_runs(last - first)]
    alike = vertices.part[one[pair]] == vertices.part[candidate]
    pair, candidate = pair[alike], candidate[alike]
    apart = np.square(vertices.look[one[pair]] - vertices.look[candidate]).sum(1)
    order = np.argsort(-apart, kind="stable")  # the last one counts
    becomes[one[pair[order]]] = candidate[order]


def _move(places: Places, vertices: Vertices, collapses: _Collapses, gone: Ints, into: Ints) -> None:
    """Merge places and vertices: the pairs `gone` and `into` (m,), each of which may occur twice, become one."""
    start, end, free = collapses.start, collapses.end, collapses.free
    along = places.point[start] - places.point[end]
    share = np.einsum("ij,ij->i", collapses.target - places.point[end], along)
    share = np.clip(share / np.maximum(np.square(along).sum(1), 1e-300), 0, 1) * free
    of_place = np.zeros(len(places.point))
    of_place[end] = share
    into, first = np.unique(into, return_index=True)
    part = of_place[vertices.place[into]][:, None]
    vertices.look[into] += part * (vertices.look[gone[first]] - vertices.look[into])
    places.point[end] = collapses.target
    normal = places.normal[end] + share[:, None] * (places.normal[start] - places.normal[end])
    places.normal[end] = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    places.quadric[end] += places.quadric[start]
    places.weight[end] += places.weight[start]


def _breaks_topology(
    edges: _Edges, triangles: Ints, collapses: _Collapses, around: Ints, collapse: Ints, vanish: Mask, is_start: Mask
) -> Mask:
    """Return which of n collapses would make surfaces touch themselves.

    triangles: (t, 3) corners of all triangles; around: (k, 3) of those at an end of a collapse; collapse: (k,) which
    one that is; vanish: (k,) whether it has both ends; is_start: (k, 3) which corners are the start.
    """
    start, end, count = collapses.start, collapses.end, len(edges.first) - 1
    # Only what forms a triangle with both ends may be a neighbour of both.
    valence = np.diff(edges.first)[start]
    neighbour = edges.end[np.repeat(edges.first[start], valence) + within_runs(valence)]
    of = np.repeat(np.arange(len(start)), valence)
    common = np.bincount(of[_contains(edges.key, end[of] * count + neighbour)], minlength=len(start))
    failed = np.asarray(common != np.bincount(collapse[vanish], minlength=len(start)))
    # A place with three triangles must not be the tip of a tetrahedron: its base would be there twice.
    tip = np.flatnonzero(~vanish & is_start.any(1) & (valence == 3)[collapse])
    if len(tip):
        base = np.where(is_start[tip], end[collapse[tip], None], around[tip])
        failed[collapse[tip][_exist(triangles, base, count)]] = True
    return failed


def _exist(triangles: Ints, wanted: Ints, count: int) -> Mask:
    """Return which triangles `wanted` (k, 3) are among `triangles` (t, 3) of `count` places, wound either way.

    Sums of random numbers stand for corners in any order; with 60 bits, chance makes no two equal.
    """
    mark = np.random.default_rng(0).integers(0, 1 << 60, count)
    candidates = triangles[np.isin(triangles, wanted).all(1)]
    return np.isin(mark[wanted].sum(1), mark[candidates].sum(1))


def _contains(known: Ints, keys: Ints) -> Mask:
    """Return which of the `keys` are among those `known`, which rise."""
    return np.asarray(known[np.searchsorted(known, keys).clip(max=len(known) - 1)] == keys)
