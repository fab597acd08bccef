"""Close the small holes of a surface, which the depth images of an object leave where none of them has a sample.

The grids of an object's images end where a surface is seen edge-on or lies behind more layers than there are, as in the
grooves of hair. Where the next image begins farther off, a hole of a few texels is left, through which one looks into
the object. Its rim is a short closed walk along the surface's boundary.
"""

from itertools import pairwise
from math import dist

import numpy as np

from depthwalk.geometry.indexed_triangles import distinct_triangles, opposite_edges, vertex_directions
from depthwalk.types import Array, Ints, Mask

_Follow = dict[int, list[int]]
_Point = tuple[float, float, float]
_Places = dict[int, _Point]


def fill_holes(point: Array, triangles: Ints, max_perimeter: float, max_edges: int) -> Ints:
    """Add triangles that close the small holes of a surface.

    The boundary of a small separate piece of surface, such as a leaf, is no hole: a triangle across it would face the
    other way.

    Parameters
    ----------
    point
        (n, 3) vertices, metres.
    triangles
        (t, 3) rows of `point`, each with three different corners.
    max_perimeter
        Longest rim of a hole that is closed, metres.
    max_edges
        Most edges of such a rim.

    Returns
    -------
    numpy.ndarray
        (u, 3) int64 triangles: those of the surface, and in each closed hole a fan around one corner of its rim.
    """
    # Around a hole, its rim runs against the boundary edges of the surface.
    triangle, corner = np.divmod(np.flatnonzero(opposite_edges(triangles) < 0), 3)
    starts, ends = triangles[triangle, (corner + 1) % 3], triangles[triangle, corner]
    candidates = _may_close(starts, ends, len(point), max_edges).tolist()
    rims = np.concatenate([starts, ends])
    places: _Places = dict(zip(rims.tolist(), map(tuple, point[rims].tolist()), strict=True))
    starts, ends = starts.tolist(), ends.tolist()
    follow: _Follow = {}
    for start, end in zip(starts, ends, strict=True):
        follow.setdefault(start, []).append(end)
    facing = vertex_directions(point, triangles)
    added: list[tuple[int, int, int]] = []
    for start, end, is_candidate in zip(starts, ends, candidates, strict=True):
        if not is_candidate or end not in follow[start]:
            continue  # on no short rim, or part of a hole that has been closed
        rim = _shortest_rim(follow, places, start, end, max_perimeter, max_edges)
        if rim and _faces_outward([places[vertex] for vertex in rim], facing[rim].sum(0).tolist()):
            for here, there in pairwise([*rim, rim[0]]):
                follow[here].remove(there)
            added += _fan(point, rim)
    return distinct_triangles(np.concatenate([triangles, np.array(added, np.int64).reshape(-1, 3)]))


def _may_close(starts: Ints, ends: Ints, points: int, max_edges: int) -> Mask:
    """Return which edges along rims (b,) may begin a closed walk of so many edges.

    Most vertices are followed by one other, so that most walks are settled without a search: for all edges at once, as
    far as the first vertex that several follow.

    starts, ends: (b,) rows of the vertices; points: how many vertices there are.
    """
    leaving = np.bincount(starts, minlength=points + 1)
    following = np.full(points + 1, points)  # the row after the last vertex stands for none
    following[starts] = ends
    at, may_close = ends, leaving[ends] > 1
    for _ in range(max_edges - 1):
        at = following[at]
        may_close |= (at == starts) | (leaving[at] > 1)
    return may_close


def _shortest_rim(
    follow: _Follow, places: _Places, start: int, end: int, max_perimeter: float, max_edges: int
) -> list[int]:
    """Return the vertices of the closed walk of fewest edges that begins with an edge; [] if all are too long.

    follow: the vertices that follow each vertex along rims; places: of their vertices, metres; start, end: of the edge.
    """
    origin, before, reached = places[start], {end: start}, [end]
    for _ in range(max_edges - 1):
        further = []
        for vertex in reached:
            for following in follow.get(vertex, ()):
                # What is farther off than half of the perimeter is not on a rim of that length.
                if following not in before and 2 * dist(origin, places[following]) <= max_perimeter:
                    before[following] = vertex
                    further.append(following)
        if start in before:
            rim = [start]
            while (vertex := before[rim[-1]]) != start:
                rim.append(vertex)
            rim.reverse()
            length = sum(dist(places[here], places[there]) for here, there in pairwise([*rim, rim[0]]))
            return rim if length <= max_perimeter else []
        reached = further
    return []


def _faces_outward(rim: list[_Point], facing: list[float]) -> bool:
    """Return whether triangles within a rim would face as the surface around them.

    rim: its vertices, metres; facing: (3,) the sum of the surface's `vertex_directions` there.
    """
    x0, y0, z0 = rim[0]
    x, y, z = facing
    volume = 0.0  # six times that of the tetrahedra over the fan of the rim, as high as `facing`
    for (ax, ay, az), (bx, by, bz) in pairwise((px - x0, py - y0, pz - z0) for px, py, pz in rim[1:]):
        volume += x * (ay * bz - az * by) + y * (az * bx - ax * bz) + z * (ax * by - ay * bx)
    return volume > 0


def _fan(point: Array, rim: list[int]) -> list[tuple[int, int, int]]:
    """Return the triangles of a fan around the vertex of a rim that is nearest to all the others."""
    places = point[rim]
    middle = int(np.linalg.norm(places[:, None] - places, axis=2).sum(1).argmin())
    rim = rim[middle:] + rim[:middle]
    return [(rim[0], here, there) for here, there in pairwise(rim[1:])]
