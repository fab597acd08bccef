"""Simplify many groups of triangles, each to its own number of triangles, without changing their borders.

Edges collapse in the order of quadric errors (Garland and Heckbert 1997). Where `cook.kernels` are loaded, they do so
one by one in each group. NumPy collapses edges of all groups in rounds over arrays: in each those whose neighbourhoods
do not touch, so that tests made before the round hold for all of them together.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from depthwalk.cook import kernels
from depthwalk.cook.collapse_choice import Collapses, able_edges, best_collapses, cheapest, independent, seams_at
from depthwalk.cook.colour_quadrics import WIDTH as TINT
from depthwalk.cook.colour_quadrics import best_colours, colour_quadrics, reduced
from depthwalk.cook.kernels.collapse_costs import TURN
from depthwalk.cook.quadrics import clustered_surface
from depthwalk.cook.seamed_mesh import DirectedEdges, Places, Vertices, contains, directed_edges
from depthwalk.geometry.indexed_triangles import vertex_directions
from depthwalk.geometry.spatial_order import within_runs
from depthwalk.geometry.triangles import face_normals
from depthwalk.types import Array, Ints, Mask

_MAX_ROUNDS = 60
_CHANCE = 2.0  # largest random factor on costs in a round


class Simplified(NamedTuple):
    """Hold simplified groups.

    Attributes
    ----------
    triangles : (n, 3) the remaining triangles, rows of the vertices.
    group : (n,) the group of each.
    point : (p, 3) the places, some of which have moved.
    look : (v, k) the appearance of the vertices there.
    """

    triangles: Ints
    group: Ints
    point: Array
    look: Array


def collapse_groups(
    point: Array,
    vertices: Vertices,
    triangles: Ints,
    group: Ints,
    wanted: Ints,
    locked: Mask,
    colour: int | None = None,
) -> Simplified:
    """Simplify groups of triangles by edge collapse.

    A collapse preserves the surface's topology (link condition, Dey et al. 1999), its seams and the course of its open
    edges. So a group may keep more triangles than wanted.

    Parameters
    ----------
    point
        (p, 3) the places of the mesh, in a frame in which its size is about 1.
    vertices
        The vertices at these places.
    triangles
        (t, 3) rows of `vertices`; the places of each triangle differ.
    group
        (t,) the group that each triangle belongs to, from 0 to g − 1, ascending.
    wanted
        (g,) the number of triangles that each group should have.
    locked
        (p,) the places that stay where they are: those that a group shares with others, and perhaps more. No edge is
        made between two of them, since other groups may have the same.
    colour
        The first of three columns of `vertices.look` that are colours, from 0 to 1, which collapses should preserve;
        None to preserve the shape alone.

    Returns
    -------
    Simplified
        The simplified groups, in the order of groups.
    """
    if loops := kernels.loaded():
        column = -1 if colour is None else colour
        of, look = vertices.place, vertices.look
        found = loops.collapse(point, of, vertices.part, look, triangles, group, wanted, locked, column)
        return Simplified(*found)
    random = np.random.default_rng(0)
    places = _places(point, vertices, triangles, colour)
    vertices = Vertices(place=vertices.place, part=vertices.part, look=vertices.look.copy())
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
        edges = directed_edges(vertices.place[triangles], len(locked))
        able = able_edges(edges, locked, banned)
        seams = seams_at(vertices, edges, triangles)
        colour_of = None if colour is None else _colour_of(vertices, triangles, len(locked), colour)
        chosen = best_collapses(places, edges, able, locked, seams, colour_of)
        chosen = cheapest(chosen, vertices.place[triangles], group, missing)
        if not len(chosen.start):
            break
        # A random factor: where costs rise steadily, hardly any is the least in its surroundings.
        chosen = chosen.take(independent(edges, chosen, chosen.cost * random.uniform(1, _CHANCE, len(chosen.cost))))
        triangles, group, failed = _collapse(places, vertices, edges, triangles, group, chosen, locked, colour)
        banned = np.union1d(banned, chosen.key[failed])
    triangles, group = np.concatenate([*done_triangles, triangles]), np.concatenate([*done_groups, group])
    order = np.argsort(group, kind="stable")
    return Simplified(triangles[order], group[order], places.point, vertices.look)


def _places(point: Array, vertices: Vertices, triangles: Ints, colour: int | None) -> Places:
    """Return places at `point` (p, 3) with the planes, normals and, if wanted, the colours of their triangles."""
    corners = vertices.place[triangles]
    surface = clustered_surface(point, corners)
    normal = vertex_directions(point, corners)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    quadric = surface.quadric
    tint: Array = np.zeros((len(point), TINT))
    if colour is not None:
        used = np.zeros(len(vertices.place), bool)
        used[triangles] = True
        single = np.bincount(vertices.place[used], minlength=len(point)) == 1
        of_colours, tint = colour_quadrics(point, corners, vertices.look[triangles, colour : colour + 3], single)
        quadric = quadric + of_colours
    return Places(point=point.copy(), normal=normal, quadric=quadric, weight=surface.weight, tint=tint)


def _colour_of(vertices: Vertices, triangles: Ints, count: int, colour: int) -> Callable[[Ints], Array]:
    """Return a function that returns the colours (n, 3) of places (n,), of which there are `count`, with one vertex."""
    vertex = np.zeros(count, np.int64)
    vertex[vertices.place[triangles]] = triangles
    columns = np.arange(colour, colour + 3)
    return lambda places: np.asarray(vertices.look[vertex[places, None], columns])


def _collapse(
    places: Places,
    vertices: Vertices,
    edges: DirectedEdges,
    triangles: Ints,
    group: Ints,
    collapses: Collapses,
    locked: Mask,
    colour: int | None,
) -> tuple[Ints, Ints, Mask]:
    """Do those of n collapses that are allowed.

    Returns the remaining triangles and groups, and which of the collapses (n,) are not allowed.
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
    failed = _breaks_topology(edges, all_corners, collapses, corners, collapse, vanish, is_start, locked)

    # Each vertex that vanishes needs one to merge into, on its own side of seams.
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
    failed[collapse[stay[(np.einsum("ij,ij->i", normal, turned) < TURN) & normal.any(1)]]] = True

    good = ~failed[collapse]
    triangles = triangles.copy()
    triangles[rows[good]] = np.where(is_start, becomes[own], own)[good]
    kept = np.ones(len(triangles), bool)
    kept[rows[good & vanish]] = False
    pairs = good[vanish] & collapses.free[collapse[vanish]]
    _move(places, vertices, collapses.take(~failed), gone[pairs], into[pairs], colour)
    return triangles[kept], group[kept], failed


def _match_loosely(vertices: Vertices, becomes: Ints, gone: tuple[Ints, Ints], into: tuple[Ints, Ints]) -> None:
    """Merge vertices that vanish into those of the same part, at the collapse's end, whose appearance differs least.

    becomes: (v,) is filled in, −1 where there is none; gone, into: (k,) vertices and the collapses (k,) at whose start
    and end they are; pairs may occur several times.
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
    order = np.argsort(-apart, kind="stable")  # the last one written counts
    becomes[one[pair[order]]] = candidate[order]


def _move(places: Places, vertices: Vertices, collapses: Collapses, gone: Ints, into: Ints, colour: int | None) -> None:
    """Merge places and vertices: the pairs `gone` and `into` (m,), which may occur twice, become one."""
    start, end, free = collapses.start, collapses.end, collapses.free
    along = places.point[start] - places.point[end]
    share = np.einsum("ij,ij->i", collapses.target - places.point[end], along)
    share = np.clip(share / np.maximum(np.square(along).sum(1), 1e-300), 0, 1) * free
    of_place = np.zeros(len(places.point))
    of_place[end] = share
    into, first = np.unique(into, return_index=True)
    part = of_place[vertices.place[into]][:, None]
    vertices.look[into] += part * (vertices.look[gone[first]] - vertices.look[into])
    one, other = places.tint[start], places.tint[end]
    if colour is not None:
        best = np.zeros((len(places.point), 3))
        best[end] = best_colours((one + other).T, collapses.target)
        tinted = np.zeros(len(best), bool)
        tinted[end] = free & (one[:, -1] > 0) & (other[:, -1] > 0)
        chosen = into[tinted[vertices.place[into]]]
        vertices.look[chosen, colour : colour + 3] = best[vertices.place[chosen]]
        # Where the end has several colours, the tint ends: from now on, the best ones are in the quadric.
        of_start = places.quadric[start]
        places.quadric[end] -= np.where(other[:, -1:] > 0, 0, of_start - reduced(of_start.T, one.T).T)
        places.tint[end] += np.where(other[:, -1:] > 0, one, 0)
    places.point[end] = collapses.target
    normal = places.normal[end] + share[:, None] * (places.normal[start] - places.normal[end])
    places.normal[end] = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    places.quadric[end] += places.quadric[start]
    places.weight[end] += places.weight[start]


def _breaks_topology(
    edges: DirectedEdges,
    triangles: Ints,
    collapses: Collapses,
    around: Ints,
    collapse: Ints,
    vanish: Mask,
    is_start: Mask,
    locked: Mask,
) -> Mask:
    """Return which of n collapses would make surfaces touch themselves, or may let one touch another group.

    triangles: (t, 3) corners of all triangles; around: (k, 3) of those at an end of a collapse; collapse: (k,) its
    number; vanish: (k,) whether the triangle has both ends; is_start: (k, 3) which corners are the start; locked: (p,).
    """
    start, end, count = collapses.start, collapses.end, len(edges.first) - 1
    # Only a vertex that forms a triangle with both ends may be a neighbour of both.
    valence = np.diff(edges.first)[start]
    neighbour = edges.end[np.repeat(edges.first[start], valence) + within_runs(valence)]
    of = np.repeat(np.arange(len(start)), valence)
    shared = contains(edges.key, end[of] * count + neighbour)
    common = np.bincount(of[shared], minlength=len(start))
    failed = np.asarray(common != np.bincount(collapse[vanish], minlength=len(start)))
    # Groups beside this one may have, or make, an edge between two places that stay.
    failed[of[locked[end[of]] & locked[neighbour] & ~shared & (neighbour != end[of])]] = True
    # A place with three triangles must not be the tip of a tetrahedron: its base would then exist twice.
    tip = np.flatnonzero(~vanish & is_start.any(1) & (valence == 3)[collapse])
    if len(tip):
        base = np.where(is_start[tip], end[collapse[tip], None], around[tip])
        failed[collapse[tip][_exist(triangles, base, count)]] = True
    return failed


def _exist(triangles: Ints, wanted: Ints, count: int) -> Mask:
    """Return which triangles `wanted` (k, 3) are among `triangles` (t, 3) of `count` places, with either winding.

    Sums of random numbers represent corners in any order; with 60 bits, collisions do not happen in practice.
    """
    mark = np.random.default_rng(0).integers(0, 1 << 60, count)
    candidates = triangles[np.isin(triangles, wanted).all(1)]
    return np.isin(mark[wanted].sum(1), mark[candidates].sum(1))
