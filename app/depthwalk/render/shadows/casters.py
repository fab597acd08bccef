"""What is drawn into shadow maps: objects that may cast a shadow there, at the level that a texel shows."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import ALL_PIECES
from depthwalk.render.draw.draw_lists import DrawList, draw_batches
from depthwalk.render.lod.mesh_fallback import MeshFallbackRule
from depthwalk.render.lod.selection import affordable_level, error_level
from depthwalk.render.resources.placed_records import placed_records
from depthwalk.render.shadows.cascades import Cascade
from depthwalk.render.shadows.spot_maps import Spot
from depthwalk.render.view.bounds import Bounds, object_bounds
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.types import Array, Rows

MapView = Cascade | Spot


@dataclass(frozen=True, kw_only=True)
class ShadowMap:
    """What a shadow map sees and what casts shadows in it: grids of depth images, and polygons."""

    view: MapView
    grids: DrawList
    meshes: DrawList

    @property
    def triangles(self) -> int:
        """Of depth images."""
        return sum(group.count * length for group in self.grids.groups for _, length in group.indices) // 3

    def shows_same(self, other: "ShadowMap") -> bool:
        """Whether drawing either gives the same map."""
        mine, its = self.view, other.view
        return (
            (mine.centre, mine.resolution) == (its.centre, its.resolution)
            and mine.clip_from_centre == its.clip_from_centre
            and all(
                drawing.groups == before.groups and np.array_equal(drawing.records, before.records)
                for drawing, before in ((self.grids, other.grids), (self.meshes, other.meshes))
            )
        )

    def follows(self, before: "ShadowMap") -> bool:
        """Whether the map before this one may stand for it a few frames more: of the sun where it was, over nearly the
        same place."""
        mine, its = self.view, before.view
        if not (isinstance(mine, Cascade) and isinstance(its, Cascade)):
            return False
        moved = np.subtract(mine.centre, its.centre) @ mine.axes.T
        return mine.half == its.half and np.array_equal(mine.axes, its.axes) and bool((np.abs(moved) < mine.half).all())


@dataclass(frozen=True, kw_only=True)
class Shadows:
    """The shadow maps of a frame. sun: the nearest first, None where it casts no shadows; may_wait: whether its maps
    may be redrawn some frames later; lamps: by tile; tiles: the tile of each lamp that has one, by its number among the
    environment's lights."""

    sun: tuple[ShadowMap, ...] | None = None
    may_wait: bool = False
    lamps: dict[int, ShadowMap] = field(default_factory=dict)
    tiles: dict[int, int] = field(default_factory=dict)


def find_casters(view: MapView, bounds: Bounds) -> NDArray[np.intp]:
    """Rows (m,) of the spheres that may cast a shadow within the map and are not smaller than a texel."""
    texel, _ = view.texels(bounds)
    return np.flatnonzero(view.meets(bounds) & (2 * bounds.bounding_radius >= texel))


def shadow_map(
    view: MapView, rows: Rows, scene: SceneArrays, rule: MeshFallbackRule, triangles_per_texel: float
) -> ShadowMap:
    """The map with the objects `rows` (m,), each at the coarsest level that is off by `rule.error` texels at most, or
    at the finest that has no more triangles than it may. Light is a viewer like any other: where images would only be
    magnified, and a mesh has not too many triangles, that stands in by the `rule`, whose pixels are texels."""
    table = scene.table
    placed, spheres = _cast_as(view, rows, scene, rule, triangles_per_texel)
    nearest, middle = (texel / placed.scale for texel in view.texels(spheres))
    imaged = ~placed.polygonal
    level = np.where(imaged, _grid_level(nearest, middle, placed, table, rule.error, triangles_per_texel), 0)
    thinned = placed.representation == Representation.MESH_LOD
    level = np.where(thinned, error_level(table.meshes.error[placed.asset], rule.error * nearest), level)
    pieces = np.full(len(placed), ALL_PIECES)
    order = np.lexsort((level, placed.asset))
    grids, meshes = order[imaged[order]], order[~imaged[order]]
    centre = np.array(view.centre)
    return ShadowMap(
        view=view,
        grids=DrawList(
            records=placed_records(centre, placed.take(grids)),
            groups=draw_batches(table, placed.asset[grids], level[grids], pieces[grids]),
        ),
        meshes=DrawList(
            records=placed_records(centre, placed.take(meshes)),
            groups=draw_batches(table, placed.asset[meshes], level[meshes]),
        ),
    )


def _cast_as(
    view: MapView, rows: Rows, scene: SceneArrays, rule: MeshFallbackRule, triangles_per_texel: float
) -> tuple[Objects, Bounds]:
    """What casts the shadows of the objects `rows` (m,): those that no mesh stands in for, then the meshes. Near a lamp
    parts of one asset may disagree: then both cast."""
    objects, bounds, table = scene.objects, scene.bounds, scene.table
    nearest, middle = (texel / objects.scale[rows] for texel in view.texels(bounds.take(rows)))
    found = table.mesh_fallbacks.allowed(objects.asset[rows], nearest, middle, table.meshes, rule, triangles_per_texel)
    if not found.any():
        return objects.take(rows), bounds.take(rows)
    meshes, others = table.mesh_fallbacks.meshes(objects, rows[found]), rows[~found]
    spheres = object_bounds(meshes, table.centre, table.bounding_radius)
    return Objects.joined([objects.take(others), meshes]), Bounds.joined([bounds.take(others), spheres])


def _grid_level(
    nearest: Array, middle: Array, placed: Objects, table: AssetTable, error: float, triangles_per_texel: float
) -> NDArray[np.int64]:
    """The level (n,) of depth images: the coarsest that is off by so many texels at most, or the finest that has no
    more triangles than it may, if that is coarser. nearest, middle: what a texel covers (n,), metres in the frames of
    the objects."""
    texels = table.area[placed.asset] / middle**2
    affordable = affordable_level(table.triangles[placed.asset], texels, triangles_per_texel)
    allowed = error_level(table.error[placed.asset], error * nearest)
    return np.maximum(allowed, np.minimum(affordable, table.levels[placed.asset]))
