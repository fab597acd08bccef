"""Simplify the groups of one level of a mesh's clusters, some at a time, and divide them into new clusters.

All that a batch of groups needs is copied to arrays of its own, which are small whatever the size of the mesh.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.level_looks import unit
from depthwalk.cook.cluster_division import divided
from depthwalk.cook.cluster_error import Colours, group_errors
from depthwalk.cook.cluster_normals import fit_normals, normal_errors
from depthwalk.cook.cluster_table import Bounds, cluster_bounds
from depthwalk.cook.group_collapse import collapse_groups
from depthwalk.cook.seamed_mesh import Vertices
from depthwalk.geometry.distinct import sorted_distinct
from depthwalk.parallel import batches
from depthwalk.types import Array, Ints, Mask, Rows

# Columns of a vertex's look, which is its normal, its colour and its texture coordinates.
NORMALS, COLOURS = slice(3), slice(3, 6)
_PROGRESS = 0.85  # part of a group's triangles: if more are left, its clusters are grouped differently next time
_BATCH = 1 << 20  # triangles at a time

_Numbers = NDArray[np.int32]
_Values = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Hold the triangles of a level, cluster by cluster, with the vertices that they use.

    point: (p, 3) places, in a frame in which the mesh has size 1; place, part: (v,) of each vertex, see `Vertices`;
    look: (v, k) float32; number: (v,) among the vertices of all levels; triangles: (t, 3) rows of the vertices.
    """

    point: _Values
    place: _Numbers
    part: _Numbers
    look: _Values
    number: NDArray[np.uint32]
    triangles: _Numbers

    def corners(self, rows: slice | Rows = slice(None)) -> _Numbers:
        """Return the places (n, 3) of some triangles."""
        return np.asarray(self.place[self.triangles[rows]])


class Batch(NamedTuple):
    """Hold a batch of g groups, and what those that could be simplified became.

    simplified: (g,) which could be; error: (g,) how far they are from the mesh, see `simplify`. triangles: (t, 3) rows
    of the surface's vertices, and beyond those rows of the v new ones; size, part, group: (n,) triangles, part and
    group of each cluster; bounds: theirs; probe: (m,) cluster of each probe, −1 where its group is not simplified.
    point: (p, 3) new places; vertex_place, vertex_part, vertex_look: (v, …) new vertices.
    """

    simplified: Mask
    triangles: Ints
    size: Ints
    part: Ints
    group: Ints
    bounds: Bounds
    error: Array
    probe: Ints
    point: _Values
    vertex_place: _Numbers
    vertex_part: _Numbers
    vertex_look: _Values


def shared_places(surface: Surface, group: Rows) -> Mask:
    """Return which places (p,) triangles of several groups share, given the group (t,) of each triangle."""
    one = np.zeros(len(surface.point), group.dtype)
    for batch in batches(len(group), _BATCH):
        one[surface.corners(batch)] = group[batch, None]  # any one of the groups
    shared = np.zeros(len(one), bool)
    for batch in batches(len(group), _BATCH):
        corners = surface.corners(batch)
        shared[corners[one[corners] != group[batch, None]]] = True
    return shared


def simplify(
    surface: Surface,
    rows: Ints,
    group: Ints,
    locked: Mask,
    probe: Array,
    probe_normal: Array,
    probe_colour: Array,
    probe_group: Ints,
) -> Batch:
    """Simplify groups to half of their triangles, and divide them into clusters.

    Parameters
    ----------
    surface
        The surface of the level.
    rows, group
        (t,) the triangles of the groups, and the group of each, from 0 on, ascending.
    locked
        (p,) places of the surface that stay where they are.
    probe, probe_normal, probe_colour, probe_group
        (m, 3) points of the mesh, their unit normals (m, 3) and colours (m, 3), 0 to 1, and the group (m,) of each,
        ascending. Without colours, (0, 3), the mesh is taken to have one colour everywhere.

    Returns
    -------
    Batch
        The simplified groups. Their error is the greatest distance of the points from them, in place and in colour, or
        that by which their normals are off, if this is larger.
    """
    used, triangles = _renumbered(surface.triangles[rows])
    at, place = _renumbered(surface.place[used])
    vertices = Vertices(place=place, part=surface.part[used].astype(np.int64), look=surface.look[used].astype(float))
    before = np.bincount(group)
    fine, normal = surface.point[at].astype(np.float64), vertices.look[:, NORMALS].copy()
    coarse, of, point, look = collapse_groups(
        fine,
        vertices,
        triangles,
        group,
        before // 2,
        locked[at],
        COLOURS.start if len(probe_colour) else None,
    )
    left = np.bincount(of, minlength=len(before))
    simplified = (left <= _PROGRESS * before) & (left > 0)
    coarse, of = coarse[simplified[of]], of[simplified[of]]
    order, count = divided(point, place[coarse], vertices.part[coarse[:, 0]], of)
    coarse, of = coarse[order], of[order]
    free = ~locked[at][place] & _mask(coarse, len(used))
    replaced = triangles[simplified[group]]
    look[:, NORMALS] = fit_normals(
        unit(look[:, NORMALS]), place, ~free, point[place[coarse]], coarse, fine[place[replaced]], normal[replaced]
    )
    follows = np.flatnonzero(simplified[probe_group])
    colours = Colours(probe_colour[follows], look[coarse, COLOURS]) if len(probe_colour) else None
    error, near = group_errors(probe[follows], probe_group[follows], point[place[coarse]], of, len(before), colours)
    shown = coarse[near]
    corners, normals = point[place[shown]], look[shown, NORMALS]
    off = normal_errors(probe[follows], probe_normal[follows], probe_group[follows], corners, normals, len(before))
    followed = np.full(len(probe), -1)
    followed[follows] = np.repeat(np.arange(len(count)), count)[near]
    first = np.cumsum(count) - count
    # Vertices inside of groups are new ones, since finer clusters still use the old ones.
    new = np.flatnonzero(free)
    new_at, new_place = _renumbered(place[new])
    number = used.astype(np.int64)
    number[new] = len(surface.place) + np.arange(len(new))
    return Batch(
        simplified=simplified,
        triangles=number[coarse],
        size=count,
        part=vertices.part[coarse[first, 0]],
        group=of[first],
        bounds=cluster_bounds(point, place[coarse], count),
        error=np.maximum(error, off),
        probe=followed,
        point=point[new_at].astype(np.float32),
        vertex_place=new_place.astype(np.int32),
        vertex_part=vertices.part[new].astype(np.int32),
        vertex_look=look[new].astype(np.float32),
    )


def _renumbered(numbers: Rows) -> tuple[Rows, Ints]:
    """Return the numbers that occur, ascending, and each as a row of those."""
    used = sorted_distinct(numbers)
    return used, np.searchsorted(used, numbers)


def _mask(rows: Rows, count: int) -> Mask:
    """Return which of `count` numbers occur."""
    found = np.zeros(count, bool)
    found[rows] = True
    return found
