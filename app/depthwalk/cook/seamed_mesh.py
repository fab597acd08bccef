"""Define a mesh whose appearance differs along seams: the places of its vertices, the vertices at each, and the edges.

Simplification moves and merges places; vertices that meet at them along a seam must be merged alike.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.geometry.soa import StructOfArrays
from depthwalk.types import Array, Ints, Mask


@dataclass(kw_only=True)
class Places(StructOfArrays):
    """Hold the p places at which a mesh has vertices, in a frame in which its size is about 1.

    Attributes
    ----------
    point : (p, 3) positions.
    normal : (p, 3) mean unit normals there, 0 where there is none.
    quadric : (p, 10) the planes that they represent, see `cook.quadrics`.
    weight : (p,) the area of those.
    tint : (p, 13) the colours of the triangles there, see `cook.colour_quadrics`; zeros where a place has several, and
        where colours do not count.
    """

    point: Array
    normal: Array
    quadric: Array
    weight: Array
    tint: Array


@dataclass(kw_only=True)
class Vertices(StructOfArrays):
    """Hold the v vertices of a mesh. Along seams, where the appearance differs, several share one place.

    Attributes
    ----------
    place : (v,) rows of `Places`.
    part : (v,) the part of the mesh that uses each; a vertex is never replaced by one of another part.
    look : (v, k) the values that are interpolated between vertices: normals, colours and so on.
    """

    place: Ints
    part: Ints
    look: Array


@dataclass(frozen=True)
class DirectedEdges:
    """Hold the directed edges between places, sorted by start, then end.

    key: (e,) start × places + end. start, end: (e,). count: (e,) triangles at each. first: (p + 1,) first by start.
    """

    key: Ints
    start: Ints
    end: Ints
    count: Ints
    first: Ints


def directed_edges(corners: Ints, count: int) -> DirectedEdges:
    """Return the edges of triangles with `corners` (t, 3), of `count` places, in both directions."""
    a, b, c = np.ascontiguousarray(corners.T)
    key = np.sort(np.concatenate([p * count + q for p, q in ((a, b), (b, a), (b, c), (c, b), (c, a), (a, c))]))
    begins = np.flatnonzero(np.diff(key, prepend=-1))
    key, triangles = key[begins], np.diff(begins, append=len(key))
    start, end = np.divmod(key, count)
    first = np.zeros(count + 1, np.int64)
    np.cumsum(np.bincount(start, minlength=count), out=first[1:])
    return DirectedEdges(key, start, end, triangles, first)


def special_places(edges: DirectedEdges) -> Mask:
    """Return which places (p,) lie on an open edge, or on one where more than two faces meet."""
    special = np.zeros(len(edges.first) - 1, bool)
    special[edges.start[edges.count != 2]] = True
    return special


def contains(known: Ints, keys: Ints) -> Mask:
    """Return which of the `keys` are in `known`, which is ascending."""
    return np.asarray(known[np.searchsorted(known, keys).clip(max=len(known) - 1)] == keys)
