"""One frame's work, decided in NumPy over all objects at once: what is seen, how, in which order.

`Planner.plan` yields draw groups (runs of instances that share an asset and an index range) and the instance records
that the shaders read. No GL here.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import ALL_PIECES, CAPS, PAPER_PIECES, SIDE_PIECES, Case, drawn_cases, seen_pieces
from depthwalk.cook.lod_geometry import IMAGE_BITS
from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.geometry.spatial_order import within_runs
from depthwalk.render.draw.draw_lists import DrawList, FrameDrawLists, ImpostorQuads, draw_batches
from depthwalk.render.impostors.tile_mapping import Tiles
from depthwalk.render.impostors.tile_records import warp_records
from depthwalk.render.impostors.tile_scheduler import Shown, TileScheduler, TileWork
from depthwalk.render.impostors.warp_planes import MIN_PLANE_DISTANCE, Planes, nearest_faces
from depthwalk.render.lod.mesh_fallback import IsResident, MeshFallbackRule
from depthwalk.render.lod.mesh_lod import mesh_level
from depthwalk.render.lod.selection import (
    affordable_level,
    error_at_a_metre,
    error_level,
    grid_level,
    iter_step,
    paper_cases,
)
from depthwalk.render.resources.placed_records import placed_records
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.render_settings import LodParams, MeshLodParams, TileParams
from depthwalk.types import Array, Rows


def member_records(
    planes: Planes,
    tiles: Tiles,
    corners: Rows,
    atlas_size: tuple[int, int],
    members: Objects,
    viewer: Array,
    number: Rows,
) -> NDArray[np.void]:
    """Warp records of n members, of whose clusters the planes, tiles and their `corners` (n, 2) are given. viewer:
    (n, 3) in their frames; number: (n,) within the cluster.

    A plane is the same in whatever frame: directions turn, lengths shrink by the object's scale, λ stays.
    """
    turned, scale = conjugate(members.rotation), members.scale[:, None]
    right, up, normal = (rotate(turned, axis) for axis in (planes.right, planes.up, planes.normal))
    epipole = np.stack([np.einsum("ni,ni->n", viewer, axis) for axis in (right, up)], -1)
    distance = planes.distance / members.scale
    offset = np.einsum("ni,ni->n", viewer, normal) - distance
    own = Planes(
        face=planes.face,
        right=right,
        up=up,
        normal=normal,
        distance=distance,
        epipole=epipole,
        offset=offset,
        low=planes.low / scale,
        high=planes.high / scale,
    )
    texel = tiles.texel * np.concatenate([scale, scale, np.ones_like(scale)], 1)[:, None]
    records = warp_records(
        own, Tiles(texel=texel, nearest=tiles.nearest, size=tiles.size, pixel=tiles.pixel), corners, atlas_size
    )
    records["depths"][:, 2] = number << IMAGE_BITS
    return records


_WORTH = 2000  # triangles of an object of which pieces of the side are left out


@dataclass(frozen=True, kw_only=True)
class PlanSettings:
    """What plans follow. layout: of tiles; polygons: how coarse meshes may be; atlas_size: width and height, texels."""

    lod: LodParams
    layout: TileParams
    polygons: MeshLodParams
    atlas_size: tuple[int, int]


class _Frozen(NamedTuple):
    """How all n objects are drawn while `lod.freeze` is on. near_by: (n,), whether as meshes, where these have come;
    level, pieces: (n,) else."""

    near_by: NDArray[np.bool_]
    level: NDArray[np.int64]
    pieces: NDArray[np.int64]


class Planner:
    """Makes the plan of each frame; holds the intermediate images that are kept, and what `lod.freeze` keeps."""

    def __init__(self) -> None:
        self._frozen: _Frozen | None = None
        self._tiles = TileScheduler()
        self._objects: Objects | None = None  # of the frame before, and what else its tiles were made for
        self._made_for: tuple[Any, ...] = ()
        self._versions = np.zeros(0, np.int64)  # of the clusters whose tiles are kept

    def plan(
        self,
        view: View,
        scene: SceneArrays,
        visible: Rows,
        settings: PlanSettings,
        continues: bool = False,
        first_object_id: int = 1,
        is_resident: IsResident = lambda meshes: np.zeros(len(meshes), bool),
    ) -> FrameDrawLists:
        """The frame that shows the objects `visible` (m,), nearest first, of the `scene`; or where it `continues`, its
        next round, when the one before is drawn. first_number: see `FrameDrawLists`; has_come: which meshes may stand in for
        depth images."""
        objects, table, lod = scene.objects, scene.table, settings.lod
        if not continues:
            self._forget_if_changed(view, scene, settings)
        self._frozen = self._freeze(view, scene, settings) if lod.freeze else None
        near_by = self._near_by(view, scene, visible, settings, is_resident)
        mesh_fallbacks = table.mesh_fallbacks.meshes(objects, visible[near_by])
        visible = visible[~near_by]
        placed, spheres = objects.take(visible), scene.bounds.take(visible)
        viewer = viewer_in_object(view, placed.position, placed.rotation, placed.scale)
        if self._frozen is None:
            level = choose_levels(view, placed, spheres, viewer, table, lod)
            pieces = choose_pieces(placed.asset, level, viewer, table, lod)
        else:
            level, pieces = self._frozen.level[visible], self._frozen.pieces[visible]
        imaged = np.flatnonzero(placed.representation == Representation.DPCI)
        volumes = table.volumes.take(placed.asset[imaged])
        _, distance = nearest_faces(viewer[imaged], volumes)
        usable = distance >= MIN_PLANE_DISTANCE * volumes.radius
        # Inside the cylinder or nearly so no plane serves. A planar image seen from behind is left out: it has no back
        # (Liu et al. 2007, §2).
        near = imaged[~usable & (volumes.has_side | (distance > 0))]
        pieces[near] = ALL_PIECES  # from inside, any image may be seen
        imaged = imaged[usable]
        triangles = table.triangles[placed.asset[imaged], level[imaged]]
        shown = Shown(
            row=visible[imaged],
            objects=placed.take(imaged),
            bounds=spheres.take(imaged),
            volumes=volumes.take(usable),
            viewer=viewer[imaged],
            level=level[imaged],
            pieces=pieces[imaged],
            triangles=triangles,
        )
        work = self._tiles.plan(view, shown, settings.layout, continues)

        warp = draw_anew(shown, work, table, settings.atlas_size)
        composite = ImpostorQuads(records=work.composite, aligned=work.aligned)

        direct = np.concatenate([np.flatnonzero(placed.representation == Representation.DMESH), near])
        if lod.cases != "paper":
            pieces[direct] = ALL_PIECES  # their outlines are found once, for all viewers
        direct = direct[np.lexsort((pieces[direct], level[direct], placed.asset[direct]))]
        runs = draw_batches(table, placed.asset[direct], level[direct], pieces[direct])
        dmesh = DrawList(records=placed_records(view.position, placed.take(direct)), groups=runs)
        meshes = Objects.joined([placed.take(placed.polygonal), mesh_fallbacks])
        mesh = draw_meshes(view, meshes, table, settings.polygons)
        distance = np.linalg.norm(spheres.centre[imaged] - view.position, axis=1)
        texel = table.texel[placed.asset[imaged]] * placed.scale[imaged]
        step = iter_step(distance, texel, view.half_extent[1], view.size[1])[work.drawn]
        counts = _counts(len(objects), warp, composite, dmesh, mesh, work, step) | {
            "mesh_fallbacks": len(mesh_fallbacks)
        }
        counts["mesh_triangles"] = sum(
            group.count * int(table.meshes.triangles[group.asset, group.level]) for group in mesh.groups
        )
        numbered = visible[np.concatenate([imaged[work.drawn], direct])]
        tiled = np.arange(len(numbered)) < len(composite.records)
        return FrameDrawLists(
            warp=warp,
            composite=composite,
            dmesh=dmesh,
            mesh=mesh,
            cleared=work.slots,
            counts=counts,
            numbered=numbered,
            tiled=tiled,
            first_object_id=first_object_id,
        )

    def plan_clusters(
        self,
        view: View,
        scene: SceneArrays,
        numbers: Rows,
        settings: PlanSettings,
        first_object_id: int,
    ) -> FrameDrawLists:
        """The round of a frame, after others, that shows the clusters `numbers` (m,), nearest first."""
        objects, bounds, table, clusters, lod = scene.objects, scene.bounds, scene.table, scene.clusters, settings.lod
        changed = numbers[clusters.version[numbers] != self._versions[numbers]]
        self._tiles.spoil(len(objects) + changed)
        self._versions[changed] = clusters.version[changed]
        some = clusters.order[clusters.first[numbers]]  # of each, what its members cost is guessed by
        like = objects.take(some)
        viewer = viewer_in_object(view, like.position, like.rotation, like.scale)
        level = choose_levels(view, like, bounds.take(some), viewer, table, lod)
        shown = clusters.shown(view, numbers, like, level, table.triangles[like.asset, level])
        work = self._tiles.plan(view, shown, settings.layout, continues=True)

        rows, count = clusters.members(numbers[work.anew])
        tile = np.repeat(np.arange(len(count)), count)
        members = objects.take(rows)
        viewer = viewer_in_object(view, members.position, members.rotation, members.scale)
        level = choose_levels(view, members, bounds.take(rows), viewer, table, lod)
        # Members keep their pieces as long as their tile, whatever the viewer comes round meanwhile.
        pieces = np.full(len(rows), ALL_PIECES)
        if lod.cases == "paper":
            pieces = choose_pieces(members.asset, level, viewer, table, lod)
        whole = work.whole[tile]
        order = np.lexsort((~whole, pieces, level, members.asset))
        tile, members = tile[order], members.take(order)
        planes, tiles, corners = work.planes.take(tile), work.tiles.take(tile), work.slots[tile, :2]
        place = within_runs(count)[order]
        records = member_records(planes, tiles, corners, settings.atlas_size, members, viewer[order], place)
        warp = DrawList(
            records=records, groups=draw_batches(table, members.asset, level[order], pieces[order], ~whole[order])
        )

        numbered, count = clusters.members(numbers[work.drawn])
        work.composite["objects"] = np.column_stack([np.cumsum(count) - count, count])
        composite, nothing = (
            ImpostorQuads(records=work.composite, aligned=work.aligned),
            DrawList(records=placed_records(view.position, members.take(slice(0)))),
        )
        distance = np.linalg.norm(shown.bounds.centre - view.position, axis=1)
        step = iter_step(distance, table.texel[like.asset] * like.scale, view.half_extent[1], view.size[1])
        counts = _counts(len(objects), warp, composite, nothing, nothing, work, step[work.drawn])
        counts |= {"dpci": len(numbered), "clusters": len(composite.records), "mesh_triangles": 0}
        tiled = np.ones(len(numbered), bool)
        return FrameDrawLists(
            warp=warp,
            composite=composite,
            dmesh=nothing,
            mesh=nothing,
            cleared=work.slots,
            counts=counts,
            numbered=numbered,
            tiled=tiled,
            first_object_id=first_object_id,
        )

    def _forget_if_changed(self, view: View, scene: SceneArrays, settings: PlanSettings) -> None:
        """Drops what is kept where it was made for other objects or with other settings. Where an object stands does
        not matter: it is compared by the viewer in its frame."""
        objects, clusters, groups = scene.objects, scene.clusters, (settings.lod, settings.layout)
        made_for = scene.table, clusters, [group.model_dump() for group in groups], view.size, settings.atlas_size
        before = self._objects
        same = before is not None and all(a is b for a, b in zip(made_for[:2], self._made_for[:2], strict=True))
        same = same and made_for[2:] == self._made_for[2:]
        self._objects, self._made_for = objects, made_for
        if same and (objects is before or _of_one_kind(objects, before)):
            return
        self._tiles.forget(len(objects) + len(clusters), settings.atlas_size)
        self._versions = np.zeros(len(clusters), np.int64)

    def _near_by(
        self, view: View, scene: SceneArrays, rows: Rows, settings: PlanSettings, is_resident: IsResident
    ) -> NDArray[np.bool_]:
        """Whether (m,) meshes stand in for the objects `rows` (m,), nearest first."""
        if self._frozen is None:
            return _may_stand_in(view, scene, rows, settings, is_resident)
        near_by = self._frozen.near_by[rows]
        near_by[near_by] = is_resident(scene.table.mesh_fallbacks.mesh[scene.objects.asset[rows[near_by]]])
        return near_by

    def _freeze(self, view: View, scene: SceneArrays, settings: PlanSettings) -> _Frozen:
        """What is frozen already, or how `view` shows the objects."""
        objects = scene.objects
        if self._frozen is not None and len(self._frozen.level) == len(objects):
            return self._frozen
        near_by = _may_stand_in(view, scene, np.arange(len(objects)), settings, _all_have)
        viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
        level = choose_levels(view, objects, scene.bounds, viewer, scene.table, settings.lod)
        return _Frozen(near_by, level, choose_pieces(objects.asset, level, viewer, scene.table, settings.lod))


def _may_stand_in(
    view: View, scene: SceneArrays, rows: Rows, settings: PlanSettings, is_resident: IsResident
) -> NDArray[np.bool_]:
    """See `MeshFallbacks.near_by`."""
    rule = MeshFallbackRule(
        magnification=settings.lod.magnification, is_resident=is_resident, error=settings.polygons.error
    )
    return scene.table.mesh_fallbacks.near_by(view, scene.objects, rows, scene.table.meshes, rule)


def _all_have(meshes: Rows) -> NDArray[np.bool_]:
    """See `IsResident`."""
    return np.ones(len(meshes), bool)


def _of_one_kind(objects: Objects, before: Objects | None) -> bool:
    columns = ("asset", "representation")
    return all(np.array_equal(getattr(objects, name), getattr(before, name)) for name in columns)


def draw_anew(shown: Shown, work: TileWork, table: AssetTable, atlas_size: tuple[int, int]) -> DrawList:
    """Warps those of `shown` whose tiles the `work` makes anew."""
    asset, level, pieces = (each[work.anew] for each in (shown.objects.asset, shown.level, shown.pieces))
    order = np.lexsort((~work.whole, pieces, level, asset))
    groups = draw_batches(table, asset[order], level[order], pieces[order], ~work.whole[order])
    return DrawList(
        records=warp_records(work.planes, work.tiles, work.slots[:, :2], atlas_size).take(order), groups=groups
    )


def draw_meshes(view: View, meshes: Objects, table: AssetTable, polygons: MeshLodParams) -> DrawList:
    """Draws the objects `meshes` (n,), of an asset and a level in their order, as coarsely as nobody sees."""
    if not len(meshes):
        return DrawList(records=placed_records(view.position, meshes))
    asset = meshes.asset
    viewer = viewer_in_object(view, meshes.position, meshes.rotation, meshes.scale)
    level = mesh_level(view, meshes, table.nearest(asset, viewer), table.meshes.error, polygons.error)
    order = np.lexsort((level, asset))  # of equals, the nearest stays first
    return DrawList(
        records=placed_records(view.position, meshes.take(order)),
        groups=draw_batches(table, asset[order], level[order]),
    )


def choose_levels(
    view: View, objects: Objects, bounds: Bounds, viewer: Array, table: AssetTable, lod: LodParams
) -> NDArray[np.int64]:
    """Return the level (n,) of n objects, from their distance and the viewer (n, 3) in their frames."""
    asset, max_level = objects.asset, table.levels[objects.asset]
    distance = np.linalg.norm(bounds.centre - view.position, axis=1)
    if lod.mode == "paper":
        step = iter_step(distance, table.texel[asset] * objects.scale, view.half_extent[1], view.size[1])
        max_level = np.minimum(max_level, int(np.log2(lod.max_step)))
        level = grid_level(step, lod.bias, max_level)
    else:
        level = error_level(table.error[asset], error_at_a_metre(view, lod) * table.nearest(asset, viewer))
    pixels = (
        table.area[asset] * objects.scale**2 * (view.focal_pixels / np.maximum(distance, bounds.bounding_radius)) ** 2
    )
    affordable = affordable_level(table.triangles[asset], pixels, lod.triangles_per_pixel)
    return np.maximum(level, np.minimum(affordable, max_level))


def choose_pieces(asset: Rows, level: Rows, viewer: Array, table: AssetTable, lod: LodParams) -> NDArray[np.int64]:
    """Return which pieces of n objects viewers (n, 3), in their frames, may see, as bit masks (n,).

    Objects of few triangles keep all pieces of their sides: leaving these out would save less than it costs to draw
    them apart from others of the same asset.
    """
    if lod.cases == "paper":
        return PAPER_PIECES[paper_cases(viewer, table.volumes.bottom[asset], table.volumes.top[asset])]
    caps = table.horizon[asset[:, None], level[:, None], CAPS]
    pieces = seen_pieces(caps, viewer, CAPS) | SIDE_PIECES
    some = np.flatnonzero(table.triangles[asset, level] >= _WORTH)
    pieces[some] = seen_pieces(table.horizon[asset[some], level[some]], viewer[some])
    return pieces


def _counts(
    total: int, warp: DrawList, composite: ImpostorQuads, dmesh: DrawList, mesh: DrawList, work: TileWork, step: Array
) -> dict[str, int | float]:
    """Return what HUD and benchmark tell of a round. step: (d,), the Iter_step of each object with a tile."""
    warped = sum(group.count * length for group in warp.groups + dmesh.groups for _, length in group.indices) // 3
    drawn: dict[str, int | float] = {
        "objects": total,
        "occluded": 0,
        "dpci": len(composite.records),
        "clusters": 0,
        "dmesh": len(dmesh.records),
        "mesh": len(mesh.records),
        "mesh_fallbacks": 0,
        "shadow_maps": 0,
        "shadow_triangles": 0,
        "warped": len(warp.records),
        "warped_triangles": warped,
        "draw_batches": len(warp.groups),
    }
    levels = {f"level_{k}": int(n) for k, n in enumerate(np.bincount(work.level)) if n}
    halvings = np.floor(np.log2(step)).astype(np.int64)
    steps = {f"step_{1 << k}": int(n) for k, n in enumerate(np.bincount(halvings)) if n}
    cases = {f"case_{Case(k).name.lower()}": int(n) for k, n in enumerate(np.bincount(drawn_cases(work.pieces))) if n}
    atlas = {
        "atlas_used": work.atlas_used,
        "tile_resolution": float(work.resolution.min(initial=1)),
        "tile_error": float(work.error.max(initial=0)),
    }
    return drawn | levels | steps | cases | atlas
