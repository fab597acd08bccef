"""Close the small holes of a surface, which the depth images of an object leave where none of them has a sample.

The grids of an object's images end where a surface is seen edge-on or lies behind more layers than there are, as in the
grooves of hair. Where the next image begins farther off, a hole of a few texels is left, through which one looks into
the object. Its rim is a short closed walk along the surface's boundary.
"""

from collections.abc import Iterator
from math import dist

import numpy as np

from depthwalk.geometry.indexed_triangles import distinct_triangles, opposite_edges, vertex_directions
from depthwalk.geometry.vectors import lengths
from depthwalk.parallel import batches
from depthwalk.types import Array, Ints, Mask

_BATCH = 1 << 13  # edges that are searched from at a time: where many rims meet, there are seven walks from each


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
    facing = vertex_directions(point, triangles)
    begins = np.flatnonzero(_may_close(starts, ends, len(point), max_edges))
    rims: list[tuple[list[int], bool]] = []  # the edges of the shortest rims, and whether they are of holes to close
    for batch in batches(len(begins), _BATCH):
        for walks in _shortest_rims(point, starts, ends, begins[batch], max_perimeter, max_edges):
            closes = _closes(point, facing, ends[walks], max_perimeter)
            rims += zip(walks.tolist(), closes.tolist(), strict=True)
    boundary = _Boundary(starts, ends)
    added = [np.zeros((0, 3), np.int64)]
    for walk, is_hole in sorted(rims):
        if not boundary.has(walk[0]):
            continue
        if not boundary.is_whole(walk):  # a hole that has been closed shares an edge with this one
            walk = _shortest_rim(boundary, point, walk[0], max_perimeter, max_edges)
            is_hole = bool(walk) and bool(_closes(point, facing, ends[[walk]], max_perimeter)[0])
        if is_hole:
            boundary.drop(walk)
            added.append(_fan(point, ends[walk]))
    return distinct_triangles(np.concatenate([triangles, *added]))


class _Boundary:
    """Hold the edges along rims that are part of no closed hole.

    Several triangles may end at the same edge, which then counts as often; the number of the first stands for all.

    starts, ends: rows of the vertices of edges; follow: the numbers of the edges that leave each vertex.
    """

    def __init__(self, starts: Ints, ends: Ints) -> None:
        """Begin with all edges (b,)."""
        _, first, number = np.unique(np.stack([starts, ends]), axis=1, return_index=True, return_inverse=True)
        self._same: list[int] = first[number.ravel()].tolist()
        self._left: list[int] = np.bincount(first[number.ravel()], minlength=len(starts)).tolist()
        self._is_whole = [True] * len(starts)
        self.starts: list[int] = starts.tolist()
        self.ends: list[int] = ends.tolist()
        self.follow: dict[int, list[int]] = {}
        for edge, start in zip(self._same, self.starts, strict=True):
            self.follow.setdefault(start, []).append(edge)

    def has(self, edge: int) -> bool:
        """Return whether an edge is left."""
        return self._left[self._same[edge]] > 0

    def is_whole(self, walk: list[int]) -> bool:
        """Return whether all edges of `walk` are left, each as often as at first."""
        return all(self._is_whole[self._same[edge]] for edge in walk)

    def drop(self, walk: list[int]) -> None:
        """Drop the edges of `walk`, once each."""
        for edge in (self._same[edge] for edge in walk):
            self._left[edge] -= 1
            self._is_whole[edge] = False
            self.follow[self.starts[edge]].remove(edge)


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


def _shortest_rims(
    point: Array, starts: Ints, ends: Ints, begins: Ints, max_perimeter: float, max_edges: int
) -> Iterator[Ints]:
    """Yield, for each number k of edges, the rims (m, k) of k edges: a search in breadth from all edges at once.

    A rim is the closed walk of fewest edges that begins with one of the edges `begins`, whose walks have no more than
    `max_edges` edges and come no farther than half of the perimeter.

    point: (n, 3), metres; starts, ends: (b,), of the edges along rims; begins: ascending numbers of edges;
    max_perimeter: metres.
    """
    leaving = np.argsort(starts, kind="stable")
    count = np.bincount(starts, minlength=len(point))
    first = np.cumsum(count) - count  # in `leaving`, of the edges that leave a vertex
    origin = starts[begins]
    # Of each walk so far: the number of its beginning, its last edge, and its place among the walks one edge shorter.
    walk, last, before = np.arange(len(begins)), begins, [np.arange(0)]
    taken = [begins]
    for _ in range(max_edges - 1):
        repeats = count[ends[last]]
        shorter = np.repeat(np.arange(len(last)), repeats)
        place = np.arange(len(shorter)) - np.repeat(np.cumsum(repeats) - repeats, repeats)
        following = leaving[first[ends[last]][shorter] + place]
        vertex = ends[following]
        # What is farther off than half of the perimeter is not on a rim of that length.
        near = 2 * lengths(point[vertex] - point[origin[walk[shorter]]]) <= max_perimeter
        shorter, following, vertex = shorter[near], following[near], vertex[near]
        # Of several walks to the same vertex, the first is continued.
        is_first = np.zeros(len(vertex), bool)
        is_first[np.unique(walk[shorter] * len(point) + vertex, return_index=True)[1]] = True
        shorter, last = shorter[is_first], following[is_first]
        walk = walk[shorter]
        before.append(shorter)
        taken.append(last)
        closed = np.flatnonzero(ends[last] == origin[walk])
        yield _traced(taken, before, closed)
        is_closed = np.zeros(len(begins), bool)
        is_closed[walk[closed]] = True
        goes_on = np.flatnonzero(~is_closed[walk])
        walk, last = walk[goes_on], last[goes_on]
        before[-1], taken[-1] = before[-1][goes_on], last


def _traced(taken: list[Ints], before: list[Ints], at: Ints) -> Ints:
    """Return the edges (m, k) of walks.

    taken: the k-th edges of all walks; before: the place of each walk among those one edge shorter; at: (m,), places of
    the walks among those of k edges.
    """
    rims = np.empty((len(at), len(taken)), np.int64)
    for k in range(len(taken) - 1, -1, -1):
        rims[:, k] = taken[k][at]
        at = before[k][at] if k else at
    return rims


def _shortest_rim(boundary: _Boundary, point: Array, begin: int, max_perimeter: float, max_edges: int) -> list[int]:
    """Do the same as `_shortest_rims` for one edge, among those that are left. Returns [] if there is no rim."""
    starts, ends = boundary.starts, boundary.ends
    start = starts[begin]
    origin, before, reached = point[start].tolist(), {ends[begin]: begin}, [ends[begin]]
    for _ in range(max_edges - 1):
        further = []
        for vertex in reached:
            for edge in boundary.follow.get(vertex, ()):
                following = ends[edge]
                if following not in before and 2 * dist(origin, point[following]) <= max_perimeter:
                    before[following] = edge
                    further.append(following)
        if start in before:
            walk = [before[start]]
            while walk[-1] != begin:
                walk.append(before[starts[walk[-1]]])
            return walk[::-1]
        reached = further
    return []


def _closes(point: Array, facing: Array, rims: Ints, max_perimeter: float) -> Mask:
    """Return which rims (m, k) of k vertices are short enough, and would be closed facing as the surface around them.

    point: (n, 3), metres; facing: (n, 3), the surface's `vertex_directions`.
    """
    places = point[rims]
    perimeter = lengths(places - np.roll(places, -1, axis=1)).sum(1)
    spokes = places[:, 1:] - places[:, :1]
    across, along = np.cross(spokes[:, :-1], spokes[:, 1:]), facing[rims].sum(1)[:, None]
    # Six times the volume of the tetrahedra over the fan of the rim, as high as the surface's direction.
    volume = across[..., 0] * along[..., 0] + across[..., 1] * along[..., 1] + across[..., 2] * along[..., 2]
    return np.asarray((perimeter <= max_perimeter) & (np.ascontiguousarray(volume.T).sum(0) > 0))


def _fan(point: Array, rim: Ints) -> Ints:
    """Return the triangles (k - 2, 3) of a fan around the vertex of a rim (k,) that is nearest to all the others."""
    places = point[rim]
    rim = np.roll(rim, -int(np.linalg.norm(places[:, None] - places, axis=2).sum(1).argmin()))
    return np.stack([np.repeat(rim[:1], len(rim) - 2), rim[1:-1], rim[2:]], -1)
