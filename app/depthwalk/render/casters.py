"""What is drawn into the sun's shadow maps: objects that may cast a shadow there, at the level that a texel shows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.bounds import Bounds
from depthwalk.render.cascades import Cascade, ShadowParams
from depthwalk.render.frame_plan import AssetTable, Drawing, draw_groups
from depthwalk.render.lod import Case, affordable_level, error_level
from depthwalk.render.records import placed_records
from depthwalk.scene.arrays import MESHES, Objects, Representation

Array = NDArray[np.floating]
Rows = NDArray[np.integer]


@dataclass(frozen=True)
class ShadowMap:
    """A cascade and what casts shadows in it: grids of depth images, and polygons."""

    cascade: Cascade
    grids: Drawing
    meshes: Drawing

    @property
    def triangles(self) -> int:
        """Of depth images."""
        return sum(group.count * length for group in self.grids.groups for _, length in group.indices) // 3

    def shows_same(self, other: "ShadowMap") -> bool:
        """Whether drawing either gives the same map."""
        mine, its = self.cascade, other.cascade
        return (
            (mine.centre, mine.half, mine.resolution) == (its.centre, its.half, its.resolution)
            and np.array_equal(mine.axes, its.axes)
            and all(
                drawing.groups == before.groups and np.array_equal(drawing.records, before.records)
                for drawing, before in ((self.grids, other.grids), (self.meshes, other.meshes))
            )
        )


def find_casters(cascade: Cascade, bounds: Bounds) -> NDArray[np.intp]:
    """Rows (m,) of the spheres that may cast a shadow within the cascade: all that meet the prism from its far side
    towards the sun, and are not smaller than a texel."""
    right, up, toward = ((bounds.centre - np.array(cascade.centre, np.float32)) @ cascade.axes.T.astype(np.float32)).T
    most = cascade.half + bounds.reach
    casts = (np.abs(right) < most) & (np.abs(up) < most) & (toward > -most) & (2 * bounds.reach >= cascade.texel)
    return np.flatnonzero(casts)


def shadow_map(cascade: Cascade, rows: Rows, objects: Objects, table: AssetTable, params: ShadowParams) -> ShadowMap:
    """The cascade with the objects `rows` (m,), each at the coarsest level that `params` allow."""
    placed = objects.take(rows)
    imaged = ~np.isin(placed.representation, MESHES)
    level = np.where(imaged, _grid_level(cascade, placed, table, params), 0)
    thinned = placed.representation == Representation.MESH_LOD
    allowed = params.error * cascade.texel / placed.scale
    level = np.where(thinned, error_level(table.mesh_error[placed.asset], allowed), level)
    case = np.full(len(rows), int(Case.ALL))
    order = np.lexsort((level, placed.asset))
    grids, meshes = order[imaged[order]], order[~imaged[order]]
    centre = np.array(cascade.centre)
    return ShadowMap(
        cascade,
        Drawing(
            placed_records(centre, placed.take(grids)),
            draw_groups(table, placed.asset[grids], level[grids], case[grids]),
        ),
        Drawing(placed_records(centre, placed.take(meshes)), draw_groups(table, placed.asset[meshes], level[meshes])),
    )


def _grid_level(cascade: Cascade, placed: Objects, table: AssetTable, params: ShadowParams) -> NDArray[np.int64]:
    """The level (n,) of depth images, as `plan.choose_levels` finds it for a viewer."""
    volumes = table.volumes.take(placed.asset)
    texel = cascade.texel / placed.scale
    level = error_level(table.error[placed.asset], params.error * texel)
    texels = 2 * volumes.radius * (volumes.top - volumes.bottom) / texel**2
    affordable = affordable_level(table.triangles[placed.asset], texels, params.triangles_per_texel)
    return np.maximum(level, np.minimum(affordable, table.levels[placed.asset]))
