"""Choose how finely each object is drawn: as a mesh near by, at which level of detail, with which of its pieces.

This is the one place where the renderer's own rules (geometric error, pieces by their normals) and those of the paper
(`lod.mode: paper`, `lod.cases: paper`; formulas in `render.lod.paper_lod`) differ.
"""

from typing import NamedTuple

import numpy as np

from depthwalk.cook.cases import ALL_PIECES, CAPS, CONE_EDGES, HORIZON_SLACK, SIDE_PIECES, seen_pieces
from depthwalk.render import kernels
from depthwalk.render.draw.plan_settings import PlanSettings
from depthwalk.render.lod.mesh_fallback import IsResident, MeshFallbackRule
from depthwalk.render.lod.paper_lod import CASE_PIECES, iter_step, paper_cases, paper_level
from depthwalk.render.lod.selection import affordable_level, error_at_a_metre, error_level
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.render_settings import LodParams
from depthwalk.types import Array, Ints, Mask, Rows

_WORTH = 2000  # triangles from which on leaving out pieces of an object's side saves more than an extra draw call costs


class _FrozenDetail(NamedTuple):
    """Hold how all n objects are drawn while `lod.freeze` is on.

    table: the assets that levels and pieces are those of. as_mesh: (n,), which are drawn as meshes, once these are
    resident. level, pieces: (n,), for the others.
    """

    table: AssetTable
    as_mesh: Mask
    level: Ints
    pieces: Ints


class DetailSelector:
    """Choose the detail of objects, frame by frame, and hold on to it while `lod.freeze` is on."""

    def __init__(self) -> None:
        self._frozen: _FrozenDetail | None = None

    def freeze_as_asked(self, view: View, scene: SceneArrays, settings: PlanSettings) -> None:
        """Freeze the detail of all objects when `lod.freeze` is switched on, and thaw it when that is switched off.

        Parameters
        ----------
        view : the view whose detail is frozen.
        scene : all objects.
        settings : the settings that decide the detail, with `lod.freeze` among them.
        """
        objects, table, lod = scene.objects, scene.table, settings.lod
        if not lod.freeze:
            self._frozen = None
        elif self._frozen is None or self._frozen.table is not table or len(self._frozen.level) != len(objects):
            as_mesh = _near_enough_for_mesh(view, scene, np.arange(len(objects)), settings, _all_resident)
            viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
            level = choose_levels(view, objects, scene.bounds, viewer, table, lod)
            pieces = choose_pieces(objects.asset, level, viewer, table, lod)
            self._frozen = _FrozenDetail(table, as_mesh, level, pieces)

    def as_mesh(
        self, view: View, scene: SceneArrays, rows: Rows, settings: PlanSettings, is_resident: IsResident
    ) -> Mask:
        """Return which objects are replaced by their meshes.

        Parameters
        ----------
        view : the view of the picture.
        scene : all objects.
        rows : (m,) rows of the objects in question, nearest first.
        settings : the settings that decide the detail.
        is_resident : tells which meshes are on the GPU.

        Returns
        -------
        (m,) whether each object is replaced.
        """
        if self._frozen is None:
            return _near_enough_for_mesh(view, scene, rows, settings, is_resident)
        as_mesh = self._frozen.as_mesh[rows]
        as_mesh[as_mesh] = is_resident(scene.table.mesh_fallbacks.mesh[scene.objects.asset[rows[as_mesh]]])
        return as_mesh

    def level_and_pieces(
        self, view: View, table: AssetTable, rows: Rows, objects: Objects, bounds: Bounds, viewer: Array, lod: LodParams
    ) -> tuple[Ints, Ints]:
        """Return the level of detail and the pieces of some objects.

        Parameters
        ----------
        view : the view of the picture.
        table : what is known of the assets.
        rows : (m,) rows of the objects among all of the scene.
        objects : those m objects.
        bounds : their bounding spheres, world.
        viewer : (m, 3) the viewer in the frames of the objects, metres.
        lod : the settings of detail.

        Returns
        -------
        (m,) levels, 0 the finest, and (m,) bit masks of the pieces; the caller may write into both arrays.
        """
        if self._frozen is not None:
            level, pieces = self._frozen.level[rows], self._frozen.pieces[rows]
        else:
            level = choose_levels(view, objects, bounds, viewer, table, lod)
            pieces = choose_pieces(objects.asset, level, viewer, table, lod)
        if lod.cases == "complete":  # silhouette lines of what is drawn directly are found once, for all viewers
            pieces[objects.representation == Representation.DMESH] = ALL_PIECES
        return level, pieces


def _near_enough_for_mesh(
    view: View, scene: SceneArrays, rows: Rows, settings: PlanSettings, is_resident: IsResident
) -> Mask:
    """Return which (m,) of the objects `rows` (m,) a mesh replaces, see `MeshFallbacks.near_by`."""
    rule = MeshFallbackRule(
        magnification=settings.lod.magnification, is_resident=is_resident, error=settings.polygons.error
    )
    return scene.table.mesh_fallbacks.near_by(view, scene.objects, rows, scene.table.meshes, rule)


def _all_resident(meshes: Rows) -> Mask:
    """Take every mesh to be resident; an `IsResident`."""
    return np.ones(len(meshes), bool)


def choose_levels(
    view: View, objects: Objects, bounds: Bounds, viewer: Array, table: AssetTable, lod: LodParams
) -> Ints:
    """Choose the level of detail of n objects.

    Parameters
    ----------
    view : the view of the picture.
    objects : the n objects.
    bounds : bounding spheres of the objects, world.
    viewer : (n, 3) the viewer in the frames of the objects, metres.
    table : what is known of the assets.
    lod : the settings of detail.

    Returns
    -------
    (n,) levels, 0 the finest.
    """
    loops = kernels.loaded()
    if loops is not None and lod.mode != "paper":
        seen = viewer, objects.asset, objects.scale, bounds.centre, bounds.bounding_radius, view.position
        limits = view.detail_pixels, error_at_a_metre(view, lod), float(lod.triangles_per_pixel)
        shape = table.centre, table.half_height, table.cylinder_radius, table.area
        return np.asarray(loops.levels(*seen, *limits, table.error, table.triangles, table.levels, *shape))
    asset, max_level = objects.asset, table.levels[objects.asset]
    distance = np.linalg.norm(bounds.centre - view.position, axis=1)
    if lod.mode == "paper":
        step = iter_step(distance, table.texel[asset] * objects.scale, view.half_extent[1], view.whole_size[1])
        max_level = np.minimum(max_level, int(np.log2(lod.max_step)))
        level = paper_level(step, lod.bias, max_level)
    else:
        level = error_level(table.error[asset], error_at_a_metre(view, lod) * table.nearest(asset, viewer))
    pixels = (
        table.area[asset] * objects.scale**2 * (view.detail_pixels / np.maximum(distance, bounds.bounding_radius)) ** 2
    )
    affordable = affordable_level(table.triangles[asset], pixels, lod.triangles_per_pixel)
    return np.maximum(level, np.minimum(affordable, max_level))


def choose_pieces(asset: Rows, level: Rows, viewer: Array, table: AssetTable, lod: LodParams) -> Ints:
    """Choose the pieces of n objects that the viewer may see.

    Objects of few triangles keep all pieces of their sides: leaving some out would save less than it costs to draw
    these objects apart from others of the same asset.

    Parameters
    ----------
    asset : (n,) number in `AssetStore` of each object's asset.
    level : (n,) level of detail of each object.
    viewer : (n, 3) the viewer in the frames of the objects, metres.
    table : what is known of the assets.
    lod : the settings of detail.

    Returns
    -------
    (n,) bit masks of the pieces.
    """
    if lod.cases != "complete":
        case = paper_cases(viewer, table.volumes.bottom[asset], table.volumes.top[asset])
        return CASE_PIECES[lod.cases][case]
    loops = kernels.loaded()
    if loops is not None:
        cones = table.triangles, table.horizon, CONE_EDGES, HORIZON_SLACK
        return np.asarray(loops.pieces(viewer, asset, level, *cones, float(_WORTH), SIDE_PIECES))
    caps = table.horizon[asset[:, None], level[:, None], CAPS]
    pieces = seen_pieces(caps, viewer, CAPS) | SIDE_PIECES
    large = np.flatnonzero(table.triangles[asset, level] >= _WORTH)
    pieces[large] = seen_pieces(table.horizon[asset[large], level[large]], viewer[large])
    return pieces


def lasting_pieces(asset: Rows, level: Rows, viewer: Array, table: AssetTable, lod: LodParams) -> Ints:
    """Choose pieces for n objects whose tiles outlive small moves of the viewer: all of them.

    The paper's cases are an exception, since they are defined for the present viewer only: then this is
    `choose_pieces`.

    Parameters
    ----------
    asset : (n,) number in `AssetStore` of each object's asset.
    level : (n,) level of detail of each object.
    viewer : (n, 3) the viewer in the frames of the objects, metres.
    table : what is known of the assets.
    lod : the settings of detail.

    Returns
    -------
    (n,) bit masks of the pieces.
    """
    if lod.cases != "complete":
        return choose_pieces(asset, level, viewer, table, lod)
    return np.full(len(asset), ALL_PIECES)
