"""Hold a group of triangles that is being simplified: records of places, corners and vertices, linked to each other.

Records, rather than an array for each value, keep together what is used together, and make calls cheap: numba passes
arrays one by one.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.kernels.quadric_loops import add_plane, triangle_normal
from depthwalk.kernels.compilation import compiled
from depthwalk.types import Array, Ints, Mask

PLACE = np.dtype(
    [
        ("quadric", "f8", 10),  # see `cook.quadrics`
        ("point", "f8", 3),
        ("normal", "f8", 3),
        ("weight", "f8"),  # area of the planes of the quadric
        ("cost", "f8"),  # of its best collapse
        ("barred", "f8"),  # cost and end of a collapse that failed: the best comes after it
        ("barred_end", "i4"),
        ("end", "i4"),  # of its best collapse
        ("rank", "i4"),  # see `queue_loops`
        ("first", "i4"),  # its first and its last corner
        ("last", "i4"),
        ("several", "i4"),  # vertices here
        ("seen", "i4"),  # stamp of the last list of neighbours that it was in
        ("slot", "i4"),  # its row in that list
        ("locked", "?"),
        ("special", "?"),  # see `seamed_mesh.special_places`
    ],
    align=True,
)
CORNER = np.dtype([("place", "i4"), ("vertex", "i4"), ("following", "i4")])  # the next corner at the place, or −1
VERTEX = np.dtype([("part", "i4"), ("becomes", "i4"), ("seen", "i4")])  # what it becomes in the collapse that is tried
LISTS = np.dtype([("near", "i4"), ("shared", "i4"), ("around", "i4"), ("queue", "i4"), ("gone", "i4")])

Records = NDArray[Any]


class Surface(NamedTuple):
    """Hold triangles; corner k of triangle t is 3 t + k.

    places (p,), corners (3 t,), vertices (v,): records, see above; look: (v, k) see `Vertices`; alive: (t,) whether a
    triangle has not vanished; lists: (n,) columns are lists, with as many entries as whoever writes them says; stamps:
    (2,) the last of places and vertices; target: (3,) where the end of the collapse that is tried would be; colour: the
    column of `look` where colours begin, −1 if they do not count; tint: (p, 13) see `cook.colour_quadrics`, or none;
    merged, nothing: (10,) quadric of the collapse that is tried, and zeros.
    """

    places: Records
    corners: Records
    vertices: Records
    look: Array
    alive: Mask
    lists: Records
    stamps: Ints
    target: Array
    colour: int
    tint: Array
    merged: Array
    nothing: Array


@compiled
def surface_of(
    points: Array, of: Ints, part: Ints, looks: Array, triangles: Ints, locked: Mask, colour: int
) -> Surface:
    """Return the records of all groups, of which `begin_group` completes one; see `collapse_loops.collapse`."""
    places, corners = np.zeros(len(points), PLACE), np.zeros(3 * len(triangles), CORNER)
    vertices, look = np.zeros(len(of), VERTEX), np.empty(looks.shape)
    for number in range(len(points)):
        for axis in range(3):
            places[number].point[axis] = points[number, axis]
        places[number].locked = locked[number]
        places[number].rank = -1
    for number in range(len(of)):
        vertices[number].part, vertices[number].becomes = part[number], -1
        for k in range(looks.shape[1]):
            look[number, k] = looks[number, k]
    for triangle in range(len(triangles)):
        for k in range(3):
            vertex = triangles[triangle, k]
            corner = corners[3 * triangle + k]
            corner.vertex, corner.place, corner.following = vertex, of[vertex], -1
    alive, lists = np.ones(len(triangles), np.bool_), np.zeros(max(len(of), len(points)) + 1, LISTS)
    stamps, tint = np.zeros(2, np.int64), np.zeros((len(points) if colour >= 0 else 0, 13))
    return Surface(
        places, corners, vertices, look, alive, lists, stamps, np.empty(3), colour, tint, np.empty(10), np.zeros(10)
    )


@compiled
def begin_group(s: Surface, begin: int, end: int) -> int:
    """Complete the records of the triangles from `begin` to `end`; write their places to `around`, return how many."""
    s.stamps[0] += 1
    count = 0
    for corner in range(3 * begin, 3 * end):
        number = s.corners[corner].place
        here = s.places[number]
        if here.seen != s.stamps[0]:
            here.seen = s.stamps[0]
            here.first = here.last = here.end = here.barred_end = -1
            here.barred = -1.0
            here.weight = 0.0
            for k in range(10):
                here.quadric[k] = 0.0
            for axis in range(3):
                here.normal[axis] = 0.0
            s.lists[count].around = number
            count += 1
        if here.last < 0:
            here.first = corner
        else:
            s.corners[here.last].following = corner
        here.last = corner
    for triangle in range(begin, end):
        _add_planes(s, triangle)
    for k in range(count):
        number = s.lists[k].around
        here = s.places[number]
        unit(here.normal)
        here.several = count_vertices(s, number)
        here.special = is_special(s, list_neighbours(s, number))
    return count


@compiled
def _add_planes(s: Surface, triangle: int) -> None:
    """Add the plane of a triangle to its places, and planes along its open edges, perpendicular to it."""
    a, b, c = s.corners[3 * triangle].place, s.corners[3 * triangle + 1].place, s.corners[3 * triangle + 2].place
    x, y, z, size = triangle_normal(s.places[a].point, s.places[b].point, s.places[c].point)
    scale = 1 / max(size, 2e-30)
    for k in range(3):
        number, next_number = s.corners[3 * triangle + k].place, s.corners[3 * triangle + (k + 1) % 3].place
        here, to = s.places[number], s.places[next_number]
        add_plane(here.quadric, x * scale, y * scale, z * scale, here.point, size / 2)
        here.weight += size / 2
        here.normal[0] += x
        here.normal[1] += y
        here.normal[2] += z
        if not _runs(s, next_number, number):
            p, q = here.point, to.point
            d, e, f = q[0] - p[0], q[1] - p[1], q[2] - p[2]
            u, v, w = (e * z - f * y) * scale, (f * x - d * z) * scale, (d * y - e * x) * scale
            squared = u * u + v * v + w * w
            along = 1 / max(np.sqrt(squared), 1e-30)
            add_plane(here.quadric, u * along, v * along, w * along, p, squared)
            add_plane(to.quadric, u * along, v * along, w * along, p, squared)


@compiled
def _runs(s: Surface, start: int, to: int) -> bool:
    """Return whether a triangle has an edge from `start` to `to`, in this direction."""
    corner = s.places[start].first
    while corner >= 0:
        triangle = corner // 3
        if s.corners[3 * triangle + (corner - 3 * triangle + 1) % 3].place == to:
            return True
        corner = s.corners[corner].following
    return False


@compiled
def unit(vector: Array) -> None:
    """Give a vector (3,) unit length, if it has any."""
    length = max(np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2), 1e-300)
    for axis in range(3):
        vector[axis] /= length


@compiled
def count_vertices(s: Surface, number: int) -> int:
    """Return how many vertices the triangles at a place use there."""
    s.stamps[1] += 1
    stamp, count, corner = s.stamps[1], 0, s.places[number].first
    while corner >= 0:
        vertex = s.vertices[s.corners[corner].vertex]
        if s.alive[corner // 3] and vertex.seen != stamp:
            vertex.seen = stamp
            count += 1
        corner = s.corners[corner].following
    return count


@compiled
def list_neighbours(s: Surface, number: int) -> int:
    """Write the neighbours of a place to `near`, and the triangles at each edge to `shared`; return their number.

    They are those with the present stamp in `seen`. Triangles that have vanished are unlinked from the place.
    """
    s.stamps[0] += 1
    here = s.places[number]
    stamp, count, before, corner = s.stamps[0], 0, -1, here.first
    while corner >= 0:
        after, triangle = s.corners[corner].following, corner // 3
        if s.alive[triangle]:
            for step in range(1, 3):
                other_number = s.corners[3 * triangle + (corner - 3 * triangle + step) % 3].place
                other = s.places[other_number]
                if other.seen != stamp:
                    other.seen, other.slot = stamp, count
                    s.lists[count].near, s.lists[count].shared = other_number, 0
                    count += 1
                s.lists[other.slot].shared += 1
            before = corner
        else:
            if before < 0:
                here.first = after
            else:
                s.corners[before].following = after
            if after < 0:
                here.last = before
        corner = after
    return count


@compiled
def is_special(s: Surface, near: int) -> bool:
    """Return whether an edge to one of the `near` listed neighbours has one triangle, or more than two."""
    special = False
    for k in range(near):
        special |= s.lists[k].shared != 2
    return special


@compiled
def corner_at(s: Surface, triangle: int, number: int) -> int:
    """Return the corner of a triangle at a place; −1 if it has none there."""
    for corner in range(3 * triangle, 3 * triangle + 3):
        if s.corners[corner].place == number:
            return int(corner)
    return -1


@compiled
def has_triangle(s: Surface, number: int, one: int, other: int) -> bool:
    """Return whether there is a triangle between three places."""
    corner = s.places[number].first
    while corner >= 0:
        triangle = corner // 3
        if s.alive[triangle] and corner_at(s, triangle, one) >= 0 and corner_at(s, triangle, other) >= 0:
            return True
        corner = s.corners[corner].following
    return False
