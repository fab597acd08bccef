"""Close the slits between the sheets of a surface, such as along the edges of a box.

The images of an object show its surface in sheets that share no vertices. Where two of them meet, at an edge or in a
corner, each ends up to half a texel before the other, and simplification moves these ends: one looks into the object
through a slit. Holes inside a sheet have a rim (`hole_filling`); a slit has none. It is closed in two ways, unless
another sheet covers it:

- *Extension.* A sheet that ends a little before the inside of another one is extended along itself until they meet.
- *Bridges.* Between ends that lie ahead of each other, triangles are added: zippering (Turk and Levoy 1994, "Zippered
  Polygon Meshes from Range Images"), but without moving or cutting anything. The third corner of a triangle at an edge
  is the vertex that sees the edge at the largest angle. In a plane that is the Delaunay triangulation of the slit, so
  that triangles at one end fit those at the other.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.bake.raycast import RayCaster
from depthwalk.geometry.indexed_triangles import (
    distinct_triangles,
    normals_and_areas,
    open_edges,
    opposite_edges,
    vertex_directions,
)
from depthwalk.geometry.spatial_order import within_runs
from depthwalk.geometry.vectors import lengths
from depthwalk.ingest.mesh import positions_only
from depthwalk.types import Array, Ints, Mask

# Lengths are in texels.
_COVER = 2.0  # another sheet so near to a gap covers it: that sheet is seen, as at the bottom of a groove
_GAP = 0.75  # longest extension
_MARGIN = 0.05  # so far from its end an extension begins, past its own sheet, and so far it goes on into the other one
_STEEP = 0.5  # least sine of the angle between both: sheets that overlap meet at smaller ones
_WIDTH = 1.5  # of the widest slit that is bridged; no bridge's third corner is farther from its edge, or it is a chord
_BEYOND = 0.1  # distance from an edge at which another sheet may go on
_SAME_SIDE = -0.2  # least cosine between normals that a bridge joins: the two sides of a leaf stay apart
_NEAREST = 12  # points of ends, a texel apart, that are considered around each of them
_NUDGE = 1e-3  # by which vertices are moved at random, for comparing angles only
_MOST_POINTS = 16  # of an edge, one texel apart


@dataclass(frozen=True)
class _Ends:
    """Hold the m edges at which sheets end.

    start, end: (m,) vertices; normal: (m, 3) of the triangles there, unit; outward: (m, 3) along these, away, unit.
    """

    start: Ints
    end: Ints
    normal: Array
    outward: Array

    def away(self, count: int) -> Array:
        """Return the direction in which sheets end at each of `count` vertices, unit, 0 where none does: (n, 3)."""
        total = np.zeros((3, count))
        for column, values in zip(total, self.outward.T, strict=True):
            for side in self.start, self.end:
                column += np.bincount(side, values, count)
        return _unit(total.T)


def close_slits(point: Array, triangles: Ints, texel: float) -> tuple[Array, Ints]:
    """Extend the sheets of a surface, and add triangles between them, where one looks through between them.

    Parameters
    ----------
    point
        (n, 3) vertices, metres.
    triangles
        (t, 3) rows of `point`, each with three different corners.
    texel
        Side of a texel of the images that show the surface, metres.

    Returns
    -------
    tuple
        The vertices (n, 3), metres, some of them moved by less than a texel; and int64 triangles (u, 3): those of the
        surface, and after them the added ones.
    """
    opposite = opposite_edges(triangles)
    ends = _ends(point, triangles, opposite)
    if not len(ends.start):
        return point, triangles
    caster = RayCaster(positions_only(point, triangles), two_sided=True)
    facing = _unit(vertex_directions(point, triangles))
    point = _extended(point, facing, ends, caster, texel)
    bridges = _bridges(point, facing, _ends(point, triangles, opposite), caster, texel)
    return point, np.concatenate([triangles, bridges])


def _ends(point: Array, triangles: Ints, opposite: Ints) -> _Ends:
    """Return the ends of the sheets of a surface; opposite: the result of `opposite_edges` for its triangles."""
    normal, _ = normals_and_areas(point, triangles)
    start, end, outward = open_edges(point, triangles, normal, opposite)
    outward = _unit(outward)
    return _Ends(start, end, np.cross(outward, _unit(point[end] - point[start])), outward)


def _extended(point: Array, facing: Array, ends: _Ends, caster: RayCaster, texel: float) -> Array:
    """Return the vertices (n, 3), those moved that end before another sheet.

    facing: (n, 3) the surface's normals, unit; caster: of the surface.
    """
    rows = np.unique(np.concatenate([ends.start, ends.end]))
    away = ends.away(len(point))[rows]
    hits = caster.first(point[rows] + _MARGIN * texel * away, away)
    gap = _MARGIN * texel + hits.distance.astype(np.float64)
    meets = np.flatnonzero((gap < _GAP * texel) & (-_dot(hits.normal, away) > _STEEP))
    rows, away, gap = rows[meets], away[meets], gap[meets, None]
    upright = _unit(facing[rows] - _dot(facing[rows], away)[:, None] * away)
    free = ~_is_covered(point[rows] + gap / 2 * away, upright, caster, _COVER * texel)
    extended = point.copy()
    extended[rows[free]] += ((gap + _MARGIN * texel) * away)[free]
    return extended


def _bridges(point: Array, facing: Array, ends: _Ends, caster: RayCaster, texel: float) -> Ints:
    """Return the triangles (b, 3) that bridge slits; the parameters are those of `_extended`."""
    middle = (point[ends.start] + point[ends.end]) / 2
    beyond = middle + _BEYOND * texel * ends.outward
    edge, vertex = _pairs(point, ends, ~_is_covered(beyond, ends.normal, caster, _COVER * texel), texel)
    start, end, outward, apex = point[ends.start[edge]], point[ends.end[edge]], ends.outward[edge], point[vertex]
    along = end - start
    part = np.clip(_dot(apex - start, along) / np.maximum(_dot(along, along), 1e-30), 0, 1)
    normal = _unit(np.cross(start - end, apex - end))
    across = apex - start - part[:, None] * along
    fits = (_dot(across, outward) > 0) & (lengths(across) < _WIDTH * texel)
    fits &= (_dot(normal, ends.normal[edge]) > _SAME_SIDE) & (_dot(normal, facing[vertex]) > _SAME_SIDE)
    chosen = np.flatnonzero(fits)
    # Of four vertices on a circle, both sides of a slit must choose the same two triangles.
    nudged = point + _NUDGE * texel * np.random.default_rng(0).uniform(-1, 1, point.shape)
    start, end, apex = (nudged[rows[chosen]] for rows in (ends.start[edge], ends.end[edge], vertex))
    angle = -_dot(_unit(start - apex), _unit(end - apex))  # grows with it
    chosen = chosen[np.lexsort((-angle, edge[chosen]))]
    chosen = chosen[np.flatnonzero(np.diff(edge[chosen], prepend=-1))]
    bridges = np.stack([ends.end[edge[chosen]], ends.start[edge[chosen]], vertex[chosen]], -1)
    free = ~_is_covered(point[bridges].mean(1), normal[chosen], caster, _COVER * texel)
    return distinct_triangles(bridges[free])


def _pairs(point: Array, ends: _Ends, free: Mask, texel: float) -> tuple[Ints, Ints]:
    """Return edges (k,) of the mask `free` (m,), ascending, each with a vertex of another one that it faces nearby."""
    from scipy.spatial import cKDTree

    edges = np.flatnonzero(free)
    if not len(edges):
        return edges, edges
    begin, along = point[ends.start[edges]], point[ends.end[edges]] - point[ends.start[edges]]
    count = np.clip(np.ceil(lengths(along) / texel).astype(np.int64), 1, _MOST_POINTS)
    of = np.repeat(np.arange(len(edges)), count)
    places = begin[of] + ((within_runs(count) + 0.5) / count[of])[:, None] * along[of]
    _, nearest = cKDTree(places).query(places, k=_NEAREST, distance_upper_bound=_WIDTH * texel)
    place, number = np.nonzero(nearest < len(places))
    near = nearest[place, number]
    edge, other, towards = edges[of[place]], edges[of[near]], _unit(places[near] - places[place])
    facing = (_dot(towards, ends.outward[edge]) > 0) & (_dot(-towards, ends.outward[other]) > 0)
    edge, other = edge[facing], other[facing]
    key = np.unique(np.tile(edge * len(point), 2) + np.concatenate([ends.start[other], ends.end[other]]))
    edge, vertex = np.divmod(key, len(point))
    apart = (vertex != ends.start[edge]) & (vertex != ends.end[edge])
    return edge[apart], vertex[apart]


def _is_covered(place: Array, normal: Array, caster: RayCaster, height: float) -> Mask:
    """Return at which places (n, 3) a surface lies within a height, metres, along unit normals (n, 3) or against."""
    return np.asarray(caster.first(place + height * normal, -normal).distance < 2 * height)


def _dot(one: Array, other: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", one, other))


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(lengths(vectors), 1e-30)[:, None])
