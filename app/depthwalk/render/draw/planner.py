"""Plan one occlusion phase of a frame, in NumPy over all its objects at once: what is drawn, how, in which order.

`Planner.plan` makes draw lists: batches of instances that share an asset and an index range, with the instance records
that the shaders read. Nothing here touches GL. Far clusters are planned by `far_cluster_planner`.
"""

from typing import Any, NamedTuple

import numpy as np

from depthwalk.cook.cases import ALL_PIECES
from depthwalk.render.draw.draw_lists import DrawList, FrameDrawLists, ImpostorQuads, draw_batches
from depthwalk.render.draw.frame_counts import phase_counts
from depthwalk.render.draw.object_detail import DetailSelector, choose_pieces
from depthwalk.render.draw.plan_settings import PlanSettings
from depthwalk.render.impostors.tile_placement import ImpostorObjects
from depthwalk.render.impostors.tile_records import warp_records
from depthwalk.render.impostors.tile_scheduler import TileScheduler, TileWork
from depthwalk.render.impostors.warp_planes import MIN_PLANE_DISTANCE, plane_distances
from depthwalk.render.lod.mesh_fallback import IsResident
from depthwalk.render.lod.mesh_lod import mesh_level
from depthwalk.render.lod.paper_lod import iter_step
from depthwalk.render.lod.selection import levels_within
from depthwalk.render.resources.placed_records import placed_records
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.render_settings import LodParams, MeshLodParams
from depthwalk.types import Array, Ints, Mask, Rows


def _none_resident(meshes: Rows) -> Mask:
    """Take no mesh to be resident; an `IsResident`."""
    return np.zeros(len(meshes), bool)


class Planner:
    """Plan the phases of frames, one after the other.

    Between frames it keeps the impostor tiles that may be reused, and the detail of objects while `lod.freeze` is on.

    Attributes
    ----------
    tiles : the scheduler of the impostor tiles, which the planner of far clusters shares.
    """

    def __init__(self) -> None:
        self.tiles = TileScheduler()
        self._detail = DetailSelector()
        self._objects: Objects | None = None  # for which, and under which circumstances, the tiles were made
        self._made_for: tuple[Any, ...] = ()

    def plan(
        self,
        view: View,
        scene: SceneArrays,
        visible: Rows,
        settings: PlanSettings,
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
        as_mesh = self._detail.as_mesh(view, scene, visible, settings, is_resident)
        fallbacks = table.mesh_fallbacks.meshes(objects, visible[as_mesh])
        seen = self._seen(view, scene, visible[~as_mesh], settings)
        tiled, too_near = _split_by_plane(seen, table)
        impostors = _impostors(seen, tiled, table)
        error = self.tiles.begin_phase(view, impostors, settings.layout, settings.warp_limit, continues)
        impostors = self._lightened(impostors, error, table, settings.lod)
        work = self.tiles.plan(view, impostors, error, settings.layout)

        warp = _warp_list(impostors, work, table, settings.atlas_size)
        composite = ImpostorQuads(records=work.composite, aligned=work.aligned)
        direct, dmesh = _direct_list(view, seen, too_near, table)
        traced, height_fields = _height_field_lists(view, seen, table)
        meshes = Objects.joined([seen.objects.take(seen.objects.polygonal), fallbacks])
        mesh = _mesh_list(view, meshes, table, settings.polygons)

        step = _iter_steps(view, impostors, table)[work.drawn]
        counts = phase_counts(len(objects), warp, composite, dmesh, mesh, work, step)
        counts["mesh_fallbacks"] = len(fallbacks)
        counts["mesh_triangles"] = sum(
            batch.count * int(table.meshes.triangles[batch.asset, batch.level]) for batch in mesh.batches
        )
        counts["height_fields"] = len(traced)
        object_rows = seen.rows[np.concatenate([tiled[work.drawn], direct, traced])]
        drawn_as = np.full(len(object_rows), Representation.DPCI, np.uint8)
        drawn_as[len(composite.records) :] = Representation.DMESH
        drawn_as[len(object_rows) - len(traced) :] = seen.objects.representation[traced]
        return FrameDrawLists(
            warp=warp,
            composite=composite,
            dmesh=dmesh,
            mesh=mesh,
            cleared=work.slots,
            counts=counts,
            object_rows=object_rows,
            drawn_as=drawn_as,
            height_fields=height_fields,
            first_object_id=first_object_id,
        )

    def _seen(self, view: View, scene: SceneArrays, rows: Rows, settings: PlanSettings) -> "_Seen":
        """Look up the objects `rows` (m,), and choose their detail."""
        objects, bounds = scene.objects.take(rows), scene.bounds.take(rows)
        viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
        detail = self._detail.level_and_pieces(view, scene.table, rows, objects, bounds, viewer, settings.lod)
        return _Seen(rows, objects, bounds, viewer, *detail)

    def _lightened(
        self, impostors: ImpostorObjects, error: Array, table: AssetTable, lod: LodParams
    ) -> ImpostorObjects:
        """Return the `impostors` (n,) with coarser levels where those that cannot wait have too many triangles."""
        allowed = self.tiles.allowed(error)
        if allowed is None or lod.freeze:
            return impostors
        forced, most = allowed
        asset, level = impostors.objects.asset[forced], impostors.level[forced]
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
        dumped = [group.model_dump() for group in groups]
        picture = view.whole_size[1], settings.atlas_size, settings.tile_light
        made_for = scene.table, scene.generation, dumped, *picture
        same = bool(self._made_for) and scene.table is self._made_for[0] and made_for[1:] == self._made_for[1:]
        same = same and self._objects is not None and _same_assets(objects, self._objects)
        self._objects, self._made_for = objects, made_for
        if not same:
            self.tiles.forget(len(objects), settings.atlas_size)


class _Seen(NamedTuple):
    """Hold the objects (m,) of a phase that no mesh replaces, nearest first.

    rows: (m,) of all objects. viewer: (m, 3) in the objects' frames, metres. level, pieces: (m,), the latter bit masks.
    """

    rows: Rows
    objects: Objects
    bounds: Bounds
    viewer: Array
    level: Ints
    pieces: Ints


def _same_assets(objects: Objects, before: Objects) -> bool:
    """Return whether the same assets are drawn in the same way, wherever their objects are."""
    if objects is before:
        return True
    return all(np.array_equal(getattr(objects, name), getattr(before, name)) for name in ("asset", "representation"))


def _split_by_plane(seen: _Seen, table: AssetTable) -> tuple[Rows, Rows]:
    """Return the numbers (k,) of the objects that impostors show, and those (j,) of which the viewer is too near.

    Within its cylinder, or nearly so, no plane serves an object: its depth samples are drawn straight into the picture,
    all pieces of it. Planar images seen from behind are in neither set: they have no back (Liu et al. 2007, §2).
    """
    imaged = np.flatnonzero(seen.objects.representation == Representation.DPCI)
    asset = seen.objects.asset[imaged]
    distance = plane_distances(seen.viewer[imaged], table.volumes, asset)
    has_plane = distance >= MIN_PLANE_DISTANCE * table.volumes.radius[asset]
    too_near = imaged[~has_plane & (table.volumes.has_side[asset] | (distance > 0))]
    seen.pieces[too_near] = ALL_PIECES  # from inside, any image may be seen
    return imaged[has_plane], too_near


def _impostors(seen: _Seen, tiled: Rows, table: AssetTable) -> ImpostorObjects:
    """Return the objects `tiled` (k,) of those `seen` with all that the tile scheduler needs of them."""
    asset, level = seen.objects.asset[tiled], seen.level[tiled]
    return ImpostorObjects(
        row=seen.rows[tiled],
        objects=seen.objects.take(tiled),
        bounds=seen.bounds.take(tiled),
        volumes=table.volumes,
        volume=asset,
        viewer=seen.viewer[tiled],
        level=level,
        pieces=seen.pieces[tiled],
        triangles=table.triangles[asset, level],
        provisional=np.zeros(len(tiled), bool),
    )


def _warp_list(impostors: ImpostorObjects, work: TileWork, table: AssetTable, atlas_size: tuple[int, int]) -> DrawList:
    """Return the draws of pass 1, which warp those of the `impostors` whose tiles are outdated."""
    columns = impostors.objects.asset, impostors.level, impostors.pieces
    asset, level, pieces = (column[work.warped] for column in columns)
    order = np.lexsort((~work.whole, pieces, level, asset))
    batches = draw_batches(table, asset[order], level[order], pieces[order], ~work.whole[order])
    rotation = impostors.objects.rotation[work.warped]
    records = warp_records(work.planes, work.tiles, work.slots[:, :2], atlas_size, rotation).take(order)
    return DrawList(records=records, batches=batches)


def _direct_list(view: View, seen: _Seen, too_near: Rows, table: AssetTable) -> tuple[Rows, DrawList]:
    """Return the numbers (d,) of the objects whose depth samples are drawn straight into the picture, and the draws."""
    direct = np.concatenate([np.flatnonzero(seen.objects.representation == Representation.DMESH), too_near])
    columns = seen.objects.asset, seen.level, seen.pieces
    direct = direct[np.lexsort([column[direct] for column in reversed(columns)])]
    batches = draw_batches(table, *(column[direct] for column in columns))
    return direct, DrawList(records=placed_records(view.position, seen.objects.take(direct)), batches=batches)


def _height_field_lists(view: View, seen: _Seen, table: AssetTable) -> tuple[Rows, dict[Representation, DrawList]]:
    """Return the numbers (d,) of the objects drawn by `HEIGHT_FIELDS`, and the draws of each representation.

    As by impostors, nothing is drawn of a planar image from behind.
    """
    traced = np.flatnonzero(seen.objects.as_height_field)
    if not len(traced):
        return traced, {}
    asset, kind = seen.objects.asset, seen.objects.representation.astype(np.int32)
    traced = traced[plane_distances(seen.viewer[traced], table.volumes, asset[traced]) > 0]
    traced = traced[np.lexsort([asset[traced], kind[traced]])]
    lists = {}
    for number in np.unique(kind[traced]).tolist():
        rows = traced[kind[traced] == number]
        records = placed_records(view.position, seen.objects.take(rows))
        lists[Representation(number)] = DrawList(records=records, batches=draw_batches(table, asset[rows]))
    return traced, lists


def _mesh_list(view: View, meshes: Objects, table: AssetTable, polygons: MeshLodParams) -> DrawList:
    """Return draws of the `meshes`, each at the coarsest level whose error the viewer cannot see.

    Objects of one asset and level stay in the order in which they are given.
    """
    if not len(meshes):
        return DrawList(records=placed_records(view.position, meshes))
    asset = meshes.asset
    viewer = viewer_in_object(view, meshes.position, meshes.rotation, meshes.scale)
    level = mesh_level(view, meshes, table.nearest(asset, viewer), table.meshes.error, polygons.error)
    order = np.lexsort((level, asset))
    return DrawList(
        records=placed_records(view.position, meshes.take(order)),
        batches=draw_batches(table, asset[order], level[order]),
    )


def _iter_steps(view: View, impostors: ImpostorObjects, table: AssetTable) -> Array:
    """Return the paper's Iter_step (k,) of the `impostors`."""
    distance = np.linalg.norm(impostors.bounds.centre - view.position, axis=1)
    texel = table.texel[impostors.objects.asset] * impostors.objects.scale
    return iter_step(distance, texel, view.half_extent[1], view.whole_size[1])
