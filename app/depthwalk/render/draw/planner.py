"""Plan one occlusion phase of a frame, in NumPy for all its objects at once: what is drawn, how, in which order.

`Planner.plan` makes draw lists: batches of instances that share an asset and an index range, with the instance records
that the shaders read. Nothing here touches GL. Far clusters are planned by `far_cluster_planner`.
"""

from typing import Any, NamedTuple

import numpy as np

from depthwalk.render.draw.cluster_draws import cluster_draws, cluster_triangles
from depthwalk.render.draw.draw_lists import ClusterDraws, DrawList, FrameDrawLists, ImpostorDraws, draw_batches
from depthwalk.render.draw.frame_counts import Counts, DrawnTiles
from depthwalk.render.draw.object_detail import (
    DIRECT,
    POLYGONS,
    TILE,
    DetailSelector,
    ObjectDetail,
    choose_pieces,
    fallback_rule,
)
from depthwalk.render.draw.plan_settings import PlanSettings
from depthwalk.render.impostors.tile_placement import ImpostorObjects
from depthwalk.render.impostors.tile_records import WARP_RECORD, warp_records
from depthwalk.render.impostors.tile_scheduler import TileScheduler, TileWork
from depthwalk.render.impostors.warp_planes import warp_faces
from depthwalk.render.lod.fallback_rule import IsResident
from depthwalk.render.lod.mesh_lod import mesh_level
from depthwalk.render.lod.selection import levels_within, stretch
from depthwalk.render.resources.placed_records import PLACED_RECORD, captured_records, placed_records
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import CAPTURED, Objects, Representation
from depthwalk.scene.object_settings import LodParams, MeshLodParams
from depthwalk.types import Array, Ints, Mask, Rows

# Least distance at which captured views show an object, in radii of its bounding sphere. Nearer, a viewer might be
# within its box, whose corners are at most √3 radii from the middle.
_CAPTURED_FROM = 1.75
_NO_WARP, _NOT_PLACED = np.zeros(0, WARP_RECORD), np.zeros(0, PLACED_RECORD)


def _none_resident(meshes: Rows) -> Mask:
    """Treat no mesh as resident; an `IsResident`."""
    return np.zeros(len(meshes), bool)


class Planner:
    """Plan the phases of frames, one after the other.

    Keeps from frame to frame the impostor tiles that may be reused, and the detail of objects while `lod.freeze` is on.

    Attributes
    ----------
    tiles : the scheduler of the impostor tiles, which the planner of far clusters shares.
    """

    def __init__(self) -> None:
        self.tiles = TileScheduler()
        self._detail = DetailSelector()
        self._objects: Objects | None = None  # the objects, and below the settings, that the tiles were made for
        self._made_for: tuple[Any, ...] = ()

    def plan(
        self,
        view: View,
        scene: SceneArrays,
        visible: Rows,
        settings: PlanSettings,
        *,
        continues: bool = False,
        first_object_id: int = 1,
        is_resident: IsResident = _none_resident,
    ) -> FrameDrawLists:
        """Return what a phase of a frame draws.

        Parameters
        ----------
        view : the view of the picture, near and far plane fitted.
        scene : all objects.
        visible : (m,) rows of the objects that the phase shows, nearest first.
        settings : the settings that decide how detail is chosen and tiles are laid out.
        continues : whether an earlier phase of the same frame has drawn other objects already.
        first_object_id : the number that passes write for the first object, see `FrameDrawLists`.
        is_resident : tells which meshes are on the GPU and may replace depth images.

        Returns
        -------
        The draw lists of the phase.
        """
        objects, table = scene.objects, scene.table
        if not continues:
            self._forget_if_changed(view, scene, settings)
        self._detail.freeze_as_asked(view, scene, settings)
        rows = visible.astype(np.int64, copy=False)
        replaced = self._detail.replaced(view, scene, rows, settings, is_resident)
        fallbacks = table.mesh_fallbacks.meshes(objects, rows[replaced])
        seen = self._detail.describe(view, scene, np.delete(rows, replaced) if len(replaced) else rows, settings.lod)
        tiled = (seen.method == TILE).nonzero()[0]
        impostors = _impostors(seen, tiled, scene)
        error = self.tiles.begin_phase(view, impostors, settings.layout, settings.warp_limit, continues)
        impostors = self._lightened(impostors, error, table, settings.lod)
        work = self.tiles.plan(view, impostors, error, settings.layout)

        warp = _warp_list(impostors, work, table, settings.atlas_size)
        direct, dmesh = _direct_list(view, scene, seen)
        others = _by_representation(scene, seen)
        near, captured = _captured_lists(view, scene, seen, others.captured)
        polygons = np.concatenate([others.meshes, near]) if len(near) else others.meshes
        rule = fallback_rule(settings, is_resident)
        levels = rule.placed_levels(table.mesh_fallbacks, table.meshes, view, fallbacks)
        mesh = _mesh_list(view, scene, seen.row[polygons], fallbacks, levels, settings.polygons)
        clusters = cluster_draws(view, objects, seen.row[others.clustered], table, settings.polygons.error)
        from_the_front, height_fields = _height_field_lists(view, scene, seen, others.height_fields)
        drawn = impostors.row[work.drawn], seen.row[direct], seen.row[from_the_front]
        representations = Representation.DPCI, Representation.DMESH, objects.representation[drawn[2]]
        return FrameDrawLists(
            warp=warp,
            composite=ImpostorDraws(records=work.composite, aligned=work.aligned, rows=impostors.row[work.drawn]),
            dmesh=dmesh,
            mesh=mesh,
            clusters=clusters,
            cleared=work.slots,
            noted={"objects": len(objects), "mesh_fallbacks": len(fallbacks)} | _noted(mesh, clusters, work, table),
            tiles=drawn_tiles(work, seen.step[tiled]),
            object_rows=np.concatenate(drawn),
            drawn_as=np.concatenate(
                [np.full(len(rows), kind, np.uint8) for rows, kind in zip(drawn, representations, strict=True)]
            ),
            height_fields=height_fields,
            captured=captured,
            first_object_id=first_object_id,
            continues=continues,
        )

    def _lightened(
        self, impostors: ImpostorObjects, error: Array, table: AssetTable, lod: LodParams
    ) -> ImpostorObjects:
        """Return the `impostors` (n,), at coarser levels where the tiles that cannot wait exceed the warp limit."""
        allowed = self.tiles.allowed(error)
        if allowed is None or lod.freeze:
            return impostors
        forced, most = allowed
        if not len(forced):
            return impostors
        asset, level = impostors.asset[forced], impostors.level[forced]
        coarser = levels_within(table.triangles[asset], level, table.levels[asset], most)
        changed = np.flatnonzero(coarser > level)
        rows, asset, level = forced[changed], asset[changed], coarser[changed]
        return impostors.coarsened(
            rows, level, choose_pieces(asset, level, impostors.viewer[rows], table, lod), table.triangles[asset, level]
        )

    def _forget_if_changed(self, view: View, scene: SceneArrays, settings: PlanSettings) -> None:
        """Drop all tiles if they were made for other objects or with other settings.

        Where single objects stand does not matter: a tile depends on where the viewer is in its object's frame.
        """
        objects, groups = scene.objects, (settings.lod, settings.layout)
        dumped = [dict(group.__dict__) for group in groups]  # copies, as settings may be changed in place
        picture = view.whole_size[1], settings.atlas_size, settings.tile_light
        made_for = scene.table, scene.generation, dumped, *picture
        same = made_for == self._made_for and self._objects is not None and _same_assets(objects, self._objects)
        self._objects, self._made_for = objects, made_for
        if not same:
            self.tiles.forget(len(objects), settings.atlas_size)


def _noted(mesh: DrawList, clusters: ClusterDraws, work: TileWork, table: AssetTable) -> Counts:
    """Return the numbers of a phase's meshes and tiles that the HUD and `bench` show, by name."""
    of_meshes = sum(batch.count * int(table.meshes.triangles[batch.asset, batch.level]) for batch in mesh.batches)
    return {
        "mesh_triangles": of_meshes + cluster_triangles(clusters, table),
        "mesh_clusters": len(clusters.cluster),
        "provisional": work.provisional,
        "atlas_used": work.atlas_used,
    }


def _same_assets(objects: Objects, before: Objects) -> bool:
    """Return whether the objects have the same assets and representations, wherever they are."""
    if objects is before:
        return True
    return all(np.array_equal(getattr(objects, name), getattr(before, name)) for name in ("asset", "representation"))


def _impostors(seen: ObjectDetail, tiled: Rows, scene: SceneArrays) -> ImpostorObjects:
    """Return the objects `tiled` (k,) among those `seen`, as the tile scheduler takes them."""
    row = seen.row[tiled]
    return ImpostorObjects(
        row=row,
        at=row,
        objects=scene.objects,
        bounds=scene.bounds,
        volumes=scene.table.volumes,
        volume=scene.objects.asset,
        viewer=seen.viewer.take(tiled, 0),
        level=seen.level[tiled],
        pieces=seen.pieces[tiled],
        triangles=seen.triangles[tiled],
        provisional=np.zeros(len(tiled), bool),
    )


def drawn_tiles(work: TileWork, step: Array, members: Rows | None = None) -> DrawnTiles:
    """Describe the tiles that pass 2 draws.

    Parameters
    ----------
    work : the tiles that are warped and drawn.
    step : (m,) the paper's Iter_step of each of the `ImpostorObjects`.
    members : (d,) how many objects each tile shows that is drawn; None: one.

    Returns
    -------
    The d tiles that are drawn, for counting.
    """
    return DrawnTiles(
        level=work.level,
        pieces=work.pieces,
        resolution=work.resolution,
        error=work.error,
        step=step[work.drawn],
        members=np.ones(len(work.drawn), np.int64) if members is None else members,
    )


def _warp_list(impostors: ImpostorObjects, work: TileWork, table: AssetTable, atlas_size: tuple[int, int]) -> DrawList:
    """Return the draws of pass 1 that warp those `impostors` whose tiles are out of date."""
    warped = work.warped
    if not len(warped):
        return DrawList(records=_NO_WARP)
    at, cut = impostors.at[warped], ~work.whole
    asset, level, pieces = impostors.objects.asset[at], impostors.level[warped], impostors.pieces[warped]
    order = np.lexsort((pieces, level, cut, asset))  # what is clipped is drawn together, as that is GL state
    batches = draw_batches(table, asset[order], level[order], pieces[order], cut[order])
    rotation = impostors.objects.rotation.take(at, 0)
    records = warp_records(work.planes, work.tiles, work.slots[:, :2], atlas_size, rotation).take(order)
    return DrawList(records=records, batches=batches)


def _direct_list(view: View, scene: SceneArrays, seen: ObjectDetail) -> tuple[Rows, DrawList]:
    """Return the objects (d,), as indices into `seen`, drawn straight into the picture, and their draws."""
    direct = (seen.method == DIRECT).nonzero()[0]
    if not len(direct):
        return direct, DrawList(records=_NOT_PLACED)
    asset, level, pieces = scene.objects.asset[seen.row[direct]], seen.level[direct], seen.pieces[direct]
    order = np.lexsort((pieces, level, asset))
    direct = direct[order]
    batches = draw_batches(scene.table, asset[order], level[order], pieces[order])
    return direct, DrawList(
        records=placed_records(view.position, scene.objects.take(seen.row[direct])), batches=batches
    )


class _ByRepresentation(NamedTuple):
    """Hold indices into an `ObjectDetail` of what is not drawn by its depth samples, by its representation.

    meshes; clustered: meshes drawn by clusters; height_fields: one of `HEIGHT_FIELDS`; captured: one of `CAPTURED`.
    """

    meshes: Rows
    clustered: Rows
    height_fields: Rows
    captured: Rows


def _by_representation(scene: SceneArrays, seen: ObjectDetail) -> _ByRepresentation:
    """Return what is `seen` and not drawn by its depth samples, by its representation."""
    others = (seen.method == POLYGONS).nonzero()[0]
    kind = scene.objects.representation[seen.row[others]]
    if kind.max(initial=0) < Representation.MESH_CLUSTERS:  # as in nearly every scene
        return _ByRepresentation(others, others[:0], others[:0], others[:0])
    clustered, captured = kind == Representation.MESH_CLUSTERS, kind >= CAPTURED[0]
    height_field = (kind > Representation.MESH_CLUSTERS) & ~captured
    is_mesh = ~(clustered | height_field | captured)
    return _ByRepresentation(others[is_mesh], others[clustered], others[height_field], others[captured])


def _captured_lists(
    view: View, scene: SceneArrays, seen: ObjectDetail, captured: Rows
) -> tuple[Rows, dict[Representation, DrawList]]:
    """Return which of `captured` (indices into `seen`) are drawn as meshes, and the draws of the others.

    Drawn as meshes are those so near that the viewer may be within their boxes.
    """
    if not len(captured):
        return captured, {}
    objects, table, rows = scene.objects, scene.table, seen.row[captured]
    asset = objects.asset[rows]
    distance = np.linalg.norm(seen.viewer[captured] - table.centre[asset], axis=1)
    is_near = distance < _CAPTURED_FROM * table.bounding_radius[asset]
    near, rows = captured[is_near], rows[~is_near]
    kind, asset = objects.representation[rows], objects.asset[rows]
    lists = {}
    for number in np.unique(kind).tolist():
        of_kind = (kind == number).nonzero()[0]
        order = of_kind[np.argsort(asset[of_kind], kind="stable")]
        records = captured_records(view.position, objects, rows[order])
        lists[Representation(number)] = DrawList(records=records, batches=draw_batches(table, asset[order]))
    return near, lists


def _height_field_lists(
    view: View, scene: SceneArrays, seen: ObjectDetail, fields: Rows
) -> tuple[Rows, dict[Representation, DrawList]]:
    """Return those of `fields` (indices into `seen`), (d,), that are seen from the front, and their draws.

    These are drawn by one of `HEIGHT_FIELDS`. As with impostors, planar images are not drawn from behind.
    """
    if not len(fields):
        return fields, {}
    objects, table = scene.objects, scene.table
    _, distance = warp_faces(seen.viewer[fields], table.volumes.take(objects.asset[seen.row[fields]]))
    fields = fields[distance > 0]
    kind, asset = (column[seen.row[fields]].astype(np.int32) for column in (objects.representation, objects.asset))
    order = np.lexsort([asset, kind])
    fields, kind, asset = fields[order], kind[order], asset[order]
    lists = {}
    for number in np.unique(kind).tolist():
        records = placed_records(view.position, objects.take(seen.row[fields[kind == number]]))
        lists[Representation(number)] = DrawList(records=records, batches=draw_batches(table, asset[kind == number]))
    return fields, lists


def _mesh_list(
    view: View, scene: SceneArrays, rows: Rows, fallbacks: Objects, levels: Ints, polygons: MeshLodParams
) -> DrawList:
    """Return draws of meshes, each at the coarsest level whose error the viewer cannot see.

    Objects of one asset and level stay in the given order.

    Parameters
    ----------
    rows : (k,) rows of the objects that are meshes.
    fallbacks, levels : the meshes that are drawn in place of depth images, and the level of each.
    """
    if not len(rows) and not len(fallbacks):
        return DrawList(records=_NOT_PLACED)
    table, meshes, level = scene.table, fallbacks, levels
    if len(rows):
        own = scene.objects.take(rows)
        viewer = viewer_in_object(view, own.position, own.rotation, own.scale)
        nearest = table.nearest(own.asset, viewer) / stretch(view, scene.bounds.centre[rows])
        own_level = mesh_level(view, own, nearest, table.meshes.error, polygons.error)
        meshes, level = Objects.joined([own, fallbacks]), np.concatenate([own_level, levels])
    asset = meshes.asset
    order = np.lexsort((level, asset))
    return DrawList(
        records=placed_records(view.position, meshes.take(order)),
        batches=draw_batches(table, asset[order], level[order]),
    )
