"""Simplify groups of triangles, each by itself, always collapsing the edge that costs least.

The reference is `cook.group_collapse`, which collapses in rounds, several groups at once: costs and conditions are the
same, the order is not.
"""

import numpy as np

from depthwalk.cook.kernels.collapse_costs import NORMAL, SEAM, SHORT, STEEP, STIFFNESS, TURN
from depthwalk.cook.kernels.colour_loops import (
    begin_colours,
    best_colour,
    fixed_colour_cost,
    merge_colours,
    reduce,
)
from depthwalk.cook.kernels.quadric_loops import distance, optimal_point, triangle_normal
from depthwalk.cook.kernels.queue_loops import remove, update
from depthwalk.cook.kernels.surface_loops import (
    Surface,
    begin_group,
    corner_at,
    count_vertices,
    has_triangle,
    is_special,
    list_neighbours,
    surface_of,
    unit,
)
from depthwalk.kernels.compilation import (
    BoolArray1,
    Float64Array2,
    Int64Array1,
    Int64Array2,
    compiled,
    compiled_as_annotated,
)
from depthwalk.types import Array, Ints


@compiled
def _simplify(s: Surface, begin: int, end: int, wanted: int) -> None:
    """Simplify the triangles from `begin` to `end` to the `wanted` number, or as far as that is cheap.

    Where most collapses are not allowed, as among slivers and locked places, the last ones that are would leave holes
    in the shape, and its error would be that of all groups above.
    """
    places, size = begin_group(s, begin, end), 0
    if s.colour >= 0:
        begin_colours(s, begin, end, places)
    for k in range(places):
        number = s.lists[k].around
        if not s.places[number].locked:
            _choose(s, number, list_neighbours(s, number))
            size = update(s, size, number)
    count, middle, limit, highest = end - begin, (end - begin + wanted) // 2, np.inf, 0.0
    while count > wanted and size:
        start = s.lists[0].queue
        first = s.places[start]
        if first.cost > limit:
            break
        to = first.end
        vanished = _try(s, start, to)
        if vanished < 0:  # the next best one is tried when its turn comes
            first.barred, first.barred_end = first.cost, to
            _choose(s, start, list_neighbours(s, start))
            size = update(s, size, start)
            continue
        count -= vanished
        highest = max(highest, first.cost)
        if count <= middle and limit == np.inf:
            limit = STEEP * highest
        size = remove(s, size, start)
        near = list_neighbours(s, to)
        for k in range(near):
            s.lists[k].around = s.lists[k].near
        s.lists[near].around = to
        for k in range(near + 1):
            number = s.lists[k].around
            if not s.places[number].locked:
                _choose_again(s, number, start, to)
                size = update(s, size, number)
    for k in range(size):
        s.places[s.lists[k].queue].rank = -1


@compiled
def _choose(s: Surface, start: int, near: int) -> None:
    """Find the best collapse of a place after the barred one: its end and cost, infinite if there is none.

    near: number of its neighbours, which are listed.
    """
    here = s.places[start]
    here.special = is_special(s, near)
    here.end, here.cost = -1, np.inf
    for k in range(near):
        if s.lists[k].shared != 2 or not here.special:  # vertices on an open edge move along open edges only
            to = s.lists[k].near
            cost, _, _ = _assess(s, start, to)
            if cost < here.barred or (cost == here.barred and to <= here.barred_end):
                continue
            if cost < here.cost:
                here.end, here.cost = to, cost


@compiled
def _choose_again(s: Surface, number: int, gone: int, moved: int) -> None:
    """Find the best collapse of a place at or beside `moved`, with which `gone` has merged."""
    here, near, several = s.places[number], list_neighbours(s, number), count_vertices(s, number)
    same = number != moved and here.end != gone and here.end != moved and here.barred < 0 and here.several == several
    here.several, here.barred, here.barred_end = several, -1.0, -1
    if same and here.special == is_special(s, near):  # only one of its edges has another cost
        if s.lists[s.places[moved].slot].shared != 2 or not here.special:
            cost, _, _ = _assess(s, number, moved)
            if cost < here.cost:
                here.end, here.cost = moved, cost
    else:
        _choose(s, number, near)


@compiled
def _assess(s: Surface, start: int, to: int) -> tuple[float, bool, bool]:
    """Return the cost of a collapse, whether the end moves, and whether a seam is lost; write the place to `target`.

    See `collapse_choice.best_collapses`.
    """
    one, other = s.places[start], s.places[to]
    met = 1
    if one.several > 1 or other.several > 1:
        met = _met(s, start, to)
    loose = met != one.several
    free = not other.locked and one.special == other.special and not loose and met == other.several
    away = turned = 0.0
    for axis in range(3):
        away += (one.point[axis] - other.point[axis]) ** 2
        turned += (one.normal[axis] - other.normal[axis]) ** 2
        s.target[axis] = other.point[axis]
    if s.colour >= 0:
        cost = _coloured_cost(s, start, to, free)
    else:
        if free:
            stiffness = STIFFNESS * (one.weight + other.weight) + 1e-30
            optimal_point(one.quadric, other.quadric, stiffness, one.point, other.point, s.target)
        cost = max(distance(one.quadric, other.quadric, s.target), 0.0)
    cost += one.weight * (SHORT * away + NORMAL**2 * turned + (SEAM**2 if loose else 0.0))
    return cost, free, loose


@compiled
def _coloured_cost(s: Surface, start: int, to: int, free: bool) -> float:
    """Return the quadric error of a collapse in place and colour; if the end is free, write the best place to `target`.

    See `cook.colour_quadrics`.
    """
    one, other = s.places[start], s.places[to]
    reduce(s, start, to)
    if free:
        stiffness = STIFFNESS * (one.weight + other.weight) + 1e-30
        optimal_point(s.merged, s.nothing, stiffness, one.point, other.point, s.target)
    cost = max(distance(s.merged, s.nothing, s.target), 0.0)
    return cost if free else cost + fixed_colour_cost(s, start, to)


@compiled
def _met(s: Surface, start: int, to: int) -> int:
    """Return how many pairs of vertices an edge has in the triangles along it, at least 1."""
    count, corner = 0, s.places[start].first
    while corner >= 0:
        other = corner_at(s, corner // 3, to)
        if s.alive[corner // 3] and other >= 0:
            new, earlier = True, s.places[start].first
            while earlier != corner and new:
                there = corner_at(s, earlier // 3, to)
                new = not (
                    s.alive[earlier // 3]
                    and there >= 0
                    and s.corners[earlier].vertex == s.corners[corner].vertex
                    and s.corners[there].vertex == s.corners[other].vertex
                )
                earlier = s.corners[earlier].following
            count += new
        corner = s.corners[corner].following
    return max(count, 1)


@compiled
def _try(s: Surface, start: int, to: int) -> int:
    """Collapse an edge if that is allowed; return the number of triangles that vanish, or −1 if it is not."""
    _, free, loose = _assess(s, start, to)
    if _breaks_topology(s, start, to) or _flips(s, start, to) or (free and _flips(s, to, start)):
        return -1
    lost = _match(s, start, to, loose)
    if lost < 0:
        return -1
    gone, end = s.places[start], s.places[to]
    if free:
        along = inward = 0.0
        for axis in range(3):
            step = gone.point[axis] - end.point[axis]
            along += step**2
            inward += step * (s.target[axis] - end.point[axis])
        share = min(max(inward / max(along, 1e-300), 0.0), 1.0)
        for axis in range(3):
            end.point[axis] = s.target[axis]
            end.normal[axis] += share * (gone.normal[axis] - end.normal[axis])
        unit(end.normal)
        for k in range(lost):  # in this case as many as there are at the end
            vertex = s.lists[k].gone
            into = s.vertices[vertex].becomes
            for value in range(s.look.shape[1]):
                s.look[into, value] += share * (s.look[vertex, value] - s.look[into, value])
            if s.colour >= 0 and s.tint[start, 12] * s.tint[to, 12] > 0:
                for channel in range(3):
                    s.look[into, s.colour + channel] = best_colour(s, start, to, channel)
    for k in range(10):
        end.quadric[k] += gone.quadric[k]
    if s.colour >= 0:
        merge_colours(s, start, to)
    end.weight += gone.weight
    vanished = _merge(s, start, to)
    for k in range(lost):
        s.vertices[s.lists[k].gone].becomes = -1
    return vanished


@compiled
def _breaks_topology(s: Surface, start: int, to: int) -> bool:
    """Return whether a collapse would make surfaces touch themselves, here or in groups beside this one."""
    near = list_neighbours(s, start)
    for k in range(near):
        s.lists[k].around = s.lists[k].near
    vanish = s.lists[s.places[to].slot].shared
    list_neighbours(s, to)
    common = 0
    for k in range(near):
        number = s.lists[k].around
        if number == to:
            continue
        if s.places[number].seen == s.stamps[0]:
            common += 1
        elif s.places[to].locked and s.places[number].locked:  # groups beside this one may have this edge
            return True
    if common != vanish:
        return True
    if near == 3:  # it must not be the tip of a tetrahedron: its base would then exist twice
        corner = s.places[start].first
        while corner >= 0:
            triangle = corner // 3
            if s.alive[triangle] and corner_at(s, triangle, to) < 0:
                one = s.corners[3 * triangle + (corner - 3 * triangle + 1) % 3].place
                other = s.corners[3 * triangle + (corner - 3 * triangle + 2) % 3].place
                if has_triangle(s, to, one, other):
                    return True
            corner = s.corners[corner].following
    return False


@compiled
def _flips(s: Surface, number: int, other: int) -> bool:
    """Return whether a triangle at a place, but not at the `other`, flips when the place moves to the target."""
    corner = s.places[number].first
    while corner >= 0:
        triangle = corner // 3
        if s.alive[triangle] and corner_at(s, triangle, other) < 0:
            one = s.places[s.corners[3 * triangle + (corner - 3 * triangle + 1) % 3].place].point
            two = s.places[s.corners[3 * triangle + (corner - 3 * triangle + 2) % 3].place].point
            x, y, z, size = triangle_normal(s.places[number].point, one, two)
            u, v, w, after = triangle_normal(s.target, one, two)
            if size > 0 and (after == 0 or x * u + y * v + z * w < TURN * size * after):
                return True
        corner = s.corners[corner].following
    return False


@compiled
def _match(s: Surface, start: int, to: int, loose: bool) -> int:
    """Find the vertex at the end of a collapse that each at its start becomes.

    Writes those at the start to `gone`, and what they become to `becomes`. Returns their number, or −1 if there is none
    on the same side of a seam; see `group_collapse`.
    """
    count, fails, corner = 0, False, s.places[start].first
    s.stamps[1] += 1
    while corner >= 0:
        vertex = s.corners[corner].vertex
        mine = s.vertices[vertex]
        if s.alive[corner // 3]:
            if mine.seen != s.stamps[1]:
                mine.seen = s.stamps[1]
                s.lists[count].gone = vertex
                count += 1
                if loose:
                    mine.becomes = _most_alike(s, vertex, to)
            other = corner_at(s, corner // 3, to)
            if other >= 0 and not loose:
                fails |= mine.becomes >= 0 and mine.becomes != s.corners[other].vertex
                mine.becomes = s.corners[other].vertex
        corner = s.corners[corner].following
    for k in range(count):
        fails |= s.vertices[s.lists[k].gone].becomes < 0
    if fails:
        for k in range(count):
            s.vertices[s.lists[k].gone].becomes = -1
        return -1
    return count


@compiled
def _most_alike(s: Surface, vertex: int, to: int) -> int:
    """Return the vertex of the same part at a place whose appearance differs least; −1 if there is none."""
    best, least, corner = -1, np.inf, s.places[to].first
    while corner >= 0:
        other = s.corners[corner].vertex
        if s.alive[corner // 3] and s.vertices[other].part == s.vertices[vertex].part:
            apart = 0.0
            for k in range(s.look.shape[1]):
                apart += (s.look[vertex, k] - s.look[other, k]) ** 2
            if apart < least:
                best, least = other, apart
        corner = s.corners[corner].following
    return int(best)


@compiled
def _merge(s: Surface, start: int, to: int) -> int:
    """Move the corners at `start` to `to`; return how many triangles at both have vanished."""
    gone, end = s.places[start], s.places[to]
    vanished, corner = 0, gone.first
    while corner >= 0:
        triangle = corner // 3
        if s.alive[triangle]:
            if corner_at(s, triangle, to) >= 0:
                s.alive[triangle] = False
                vanished += 1
            else:
                s.corners[corner].place = to
                s.corners[corner].vertex = s.vertices[s.corners[corner].vertex].becomes
        corner = s.corners[corner].following
    if end.last < 0:
        end.first = gone.first
    else:
        s.corners[end.last].following = gone.first
    end.last = gone.last
    gone.first = gone.last = -1
    return vanished


@compiled_as_annotated
def collapse(
    points: Float64Array2,
    of: Int64Array1,
    part: Int64Array1,
    looks: Float64Array2,
    triangles: Int64Array2,
    group: Int64Array1,
    wanted: Int64Array1,
    locked: BoolArray1,
    colour: int,
) -> tuple[Ints, Ints, Array, Array]:
    """Simplify groups of triangles; see `cook.group_collapse.collapse_groups`.

    points: (p, 3); of: (v,) place of each vertex; part: (v,); looks: (v, k); triangles: (t, 3) in the order of their
    groups (t,); wanted: (g,); locked: (p,); colour: column of looks where colours begin, or −1. Returns the remaining
    triangles, their groups, points and looks.
    """
    s = surface_of(points, of, part, looks, triangles, locked, colour)
    left, left_group = np.empty(triangles.shape, np.int64), np.empty(len(group), np.int64)
    # Of each group's triangles. A variable that starts as 0 would have `_simplify` compiled once more, for that number.
    bounds = np.zeros(len(wanted) + 1, np.int64)
    for number in group:
        bounds[number + 1] += 1
    for number in range(len(wanted)):
        bounds[number + 1] += bounds[number]
    count = 0
    for number in range(len(wanted)):
        begin, end = bounds[number], bounds[number + 1]
        _simplify(s, begin, end, int(wanted[number]))
        for triangle in range(begin, end):
            if s.alive[triangle]:
                for k in range(3):
                    left[count, k] = s.corners[3 * triangle + k].vertex
                left_group[count] = number
                count += 1
    point = np.empty(points.shape)
    for number in range(len(points)):
        for axis in range(3):
            point[number, axis] = s.places[number].point[axis]
    return left[:count].copy(), left_group[:count].copy(), point, s.look
