"""Choose what is drawn into a shadow map: the objects that may cast a shadow in it, at the detail of its texels.

A light is a viewer like any other: the error of a level of detail and the magnification of a depth image are measured
in texels of the map, as they are in pixels of the picture.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import ALL_PIECES
from depthwalk.render.draw.draw_lists import DrawList, draw_batches
from depthwalk.render.lod.fallback_rule import MeshFallbackRule
from depthwalk.render.lod.selection import affordable_level, error_level
from depthwalk.render.resources.placed_records import placed_records
from depthwalk.render.shadows.cascades import DEPTH, Cascade
from depthwalk.render.shadows.scrolled_map import MapOrigin
from depthwalk.render.shadows.spot_maps import Spot
from depthwalk.render.view.bounds import Bounds, object_bounds
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import SIMPLIFIED, Objects
from depthwalk.types import Array, Rows

Rectangle = tuple[int, int, int, int]
"""Left, bottom, width and height of a part of a shadow map, texels."""
LightView = Cascade | Spot
"""What a shadow map is seen through; `render.view.view_block.MapView` defines what shaders need of it."""


@dataclass(frozen=True, kw_only=True)
class MovingCasters:
    """Hold what moves by itself and casts shadows in a map, which is drawn anew in each frame.

    Attributes
    ----------
    map
        The draws.
    rectangle
        Where in the map it may be.
    """

    map: "ShadowMap"
    rectangle: Rectangle


@dataclass(frozen=True, kw_only=True)
class EnteringCasters:
    """Hold what is drawn into a map of the sun beside the texels that it keeps of an earlier one.

    Attributes
    ----------
    map
        The draws.
    moved
        By how many texels the map has moved to the right and up.
    """

    map: "ShadowMap"
    moved: tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class ShadowMap:
    """Hold what a shadow map sees and what is drawn into it.

    Attributes
    ----------
    view
        What the map sees.
    grids
        The depth images that cast shadows in the map, drawn as grids of polygons.
    meshes
        The meshes that cast shadows in the map.
    provisional
        Whether its casters are coarser than they should be, so that the first picture appears soon.
    moving
        Plans those of its casters that move by themselves, for the view of the map that is shown; None: none does, or
        they are among the others.
    origin
        What it was planned from; None for maps of which no later one keeps a part.
    entering
        Plans what is drawn beside the texels that this one keeps of an earlier map; its result is None where it can
        keep none.
    """

    view: LightView
    grids: DrawList
    meshes: DrawList
    provisional: bool = False
    moving: Callable[[LightView], MovingCasters] | None = field(default=None, compare=False)
    origin: MapOrigin | None = field(default=None, compare=False)
    entering: Callable[["ShadowMap"], EnteringCasters | None] | None = field(default=None, compare=False)

    @property
    def triangles(self) -> int:
        """Return how many triangles of depth images are drawn into the map."""
        return sum(batch.count * batch.triangles for batch in self.grids.batches)

    def shows_same(self, other: "ShadowMap") -> bool:
        """Return whether an earlier map is equal to this one, so that this one need not be drawn.

        Parameters
        ----------
        other
            The earlier map.

        Returns
        -------
        bool
            True where both see the same and have the same draws.
        """
        return self.sees_same(other) and all(
            drawn is before or (drawn.batches == before.batches and np.array_equal(drawn.records, before.records))
            for drawn, before in ((self.grids, other.grids), (self.meshes, other.meshes))
        )

    def sees_same(self, other: "ShadowMap") -> bool:
        """Return whether another map has the same place and size, whatever is drawn into the two."""
        return sees_same(self.view, other.view)

    def follows(self, before: "ShadowMap", from_afar: bool = False) -> bool:
        """Return whether an earlier map may be shown in place of this one for a few more frames.

        It may if both are maps of the sun, the sun has not moved, and the map has moved by less than half its width and
        half its depth.

        Parameters
        ----------
        before
            The earlier map.
        from_afar
            Whether the map may have moved farther, because another map covers what the earlier one does not reach.

        Returns
        -------
        bool
            Whether it may be shown.
        """
        mine, its = self.view, before.view
        if not (isinstance(mine, Cascade) and isinstance(its, Cascade)):
            return False
        moved = np.subtract(mine.centre, its.centre) @ mine.axes.T
        near = np.abs(moved) < mine.half * np.array([1, 1, DEPTH])
        return mine.half == its.half and np.array_equal(mine.axes, its.axes) and (from_afar or bool(near.all()))


@dataclass(frozen=True, kw_only=True)
class Shadows:
    """Hold the shadow maps of a frame.

    Attributes
    ----------
    sun
        The maps of the sun, the nearest first; None where the sun casts no shadows.
    may_wait
        Whether maps of the sun may be redrawn some frames later, as long as they follow what is shown
        (`ShadowMap.follows`).
    portion
        About how many triangles of a map that may wait are drawn per frame, to keep the frame rate even; None: one
        whole map per frame.
    interactive
        Whether the viewer moves, so that even maps that have moved far may wait, except the last.
    lamps
        The maps of lamps, by the tile of the atlas that each lies in.
    tiles
        The tile of each lamp that has a map, by its number among the environment's lights.
    """

    sun: tuple[ShadowMap, ...] | None = None
    may_wait: bool = False
    portion: int | None = None
    interactive: bool = False
    lamps: dict[int, ShadowMap] = field(default_factory=dict)
    tiles: dict[int, int] = field(default_factory=dict)


def sees_same(view: LightView, other: LightView) -> bool:
    """Return whether two maps have the same place, projection and size."""
    return view is other or (view.centre, view.resolution, view.clip_from_centre) == (
        other.centre,
        other.resolution,
        other.clip_from_centre,
    )


def find_casters(view: LightView, bounds: Bounds) -> NDArray[np.intp]:
    """Return which spheres may cast a shadow within a map and are at least as large as a texel.

    Parameters
    ----------
    view
        What the map sees.
    bounds
        Bounding spheres of n objects, metres, world.

    Returns
    -------
    NDArray[np.intp]
        (m,) rows of these spheres.
    """
    texel, _ = view.texels(bounds)
    return np.flatnonzero(view.meets(bounds) & (2 * bounds.bounding_radius >= texel))


def shadow_map(
    view: LightView,
    rows: Rows,
    scene: SceneArrays,
    rule: MeshFallbackRule,
    chooses: bool = True,
) -> ShadowMap:
    """Plan what is drawn into a shadow map.

    Every object is drawn at the coarsest level with an error of at most `rule.error` texels, or at the finest with
    affordable triangles, if that is coarser. The mesh is drawn instead where depth images would only be magnified and
    the mesh does not have too many triangles, and where `auto` may choose and the mesh has fewer triangles.

    Parameters
    ----------
    view
        What the map sees.
    rows
        (m,) rows of the objects that cast shadows in the map, as `find_casters` returns them.
    scene
        All objects and their assets.
    rule
        When meshes replace depth images, and how many triangles an object may have; its pixels are texels here.
    chooses
        Whether `auto` may choose meshes that have fewer triangles.

    Returns
    -------
    ShadowMap
        The map, with the draws of its casters.
    """
    table = scene.table
    placed, spheres = _cast_as(view, rows, scene, rule, chooses)
    nearest, middle = (texel / placed.scale for texel in view.texels(spheres))
    as_grid = ~placed.of_mesh
    level = np.where(as_grid, _grid_level(nearest, middle, placed.asset, table, rule), 0)
    simplified = np.isin(placed.representation, SIMPLIFIED)
    level = np.where(simplified, error_level(table.meshes.error[placed.asset], rule.error * nearest), level)
    pieces = np.full(len(placed), ALL_PIECES)
    order = np.lexsort((level, placed.asset))
    grids, meshes = order[as_grid[order]], order[~as_grid[order]]
    centre = np.array(view.centre)
    return ShadowMap(
        view=view,
        grids=DrawList(
            records=placed_records(centre, placed.take(grids)),
            batches=draw_batches(table, placed.asset[grids], level[grids], pieces[grids]),
        ),
        meshes=DrawList(
            records=placed_records(centre, placed.take(meshes)),
            batches=draw_batches(table, placed.asset[meshes], level[meshes]),
        ),
    )


def _cast_as(
    view: LightView,
    rows: Rows,
    scene: SceneArrays,
    rule: MeshFallbackRule,
    chooses: bool,
) -> tuple[Objects, Bounds]:
    """Return what casts the shadows of the objects `rows` (m,), and its bounding spheres.

    First come the objects whose depth images or own meshes cast, then the meshes that replace depth images: where these
    would be magnified and, for objects that choose, where the mesh has fewer triangles, as only triangles cost anything
    here. Near a lamp parts of one asset may decide differently; then both cast.
    """
    objects, bounds, table = scene.objects, scene.bounds, scene.table
    nearest, middle = (texel / objects.scale[rows] for texel in view.texels(bounds.take(rows)))
    number = objects.asset[rows]
    texels = table.mesh_fallbacks.pixels(number, middle)
    quicker = None
    if chooses and scene.choice is not None:
        level = _grid_level(nearest, middle, number, table, rule)
        quicker = scene.choice.chooses[rows] & table.mesh_fallbacks.has_fewer_triangles(
            number, table.triangles[number, level]
        )
    found = rule.allowed(
        table.mesh_fallbacks, table.meshes, number=number, pixel_length=nearest, pixels=texels, quicker=quicker
    )
    if not found.any():
        return objects.take(rows), bounds.take(rows)
    meshes, others = table.mesh_fallbacks.meshes(objects, rows[found]), rows[~found]
    spheres = object_bounds(meshes, table.centre, table.bounding_radius)
    return Objects.joined([objects.take(others), meshes]), Bounds.joined([bounds.take(others), spheres])


def _grid_level(
    nearest: Array, middle: Array, number: Rows, table: AssetTable, rule: MeshFallbackRule
) -> NDArray[np.int64]:
    """Return the level (n,) at which depth images are drawn.

    That is the coarsest with an error of at most `rule.error` texels, or the finest with affordable triangles, if that
    is coarser. nearest, middle: length that a texel covers (n,) where the objects are nearest to the light and at their
    middles, metres in the frames of the objects. number: (n,) of the objects in `CookedParts`.
    """
    texels = table.area[number] / middle**2
    affordable = affordable_level(table.triangles[number], texels, rule.triangles_per_pixel)
    allowed = error_level(table.error[number], rule.error * nearest)
    return np.maximum(allowed, np.minimum(affordable, table.levels[number]))
