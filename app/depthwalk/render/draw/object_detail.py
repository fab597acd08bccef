"""Choose how finely each object is drawn: as a mesh near by, at which level of detail, with which of its pieces.

This is the one place where the renderer's own rules (geometric error, pieces by their normals) and those of the paper
(`lod.mode: paper`, `lod.cases: paper`; formulas in `render.lod.paper_lod`) differ.
"""

from dataclasses import dataclass
from enum import IntEnum
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import ALL_PIECES, CAPS, CONE_EDGES, HORIZON_SLACK, SIDE_PIECES, seen_pieces
from depthwalk.render import kernels
from depthwalk.render.draw.plan_settings import PlanSettings
from depthwalk.render.impostors.warp_planes import MIN_PLANE_DISTANCE, warp_faces
from depthwalk.render.lod.fallback_rule import IsResident, MeshFallbackRule
from depthwalk.render.lod.mesh_choice import MESH_TEXELS, TRIANGLES_PER_PIXEL, MeshChooser
from depthwalk.render.lod.paper_lod import CASE_PIECES, iter_step, paper_cases, paper_level
from depthwalk.render.lod.selection import affordable_level, error_at_a_metre, error_level, greatest_stretch, stretch
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.object_settings import LodParams
from depthwalk.types import Array, Ints, Mask, Rows

_WORTH = 2000  # triangles above which culling pieces of an object's side saves more than an extra draw call costs
_DPCI, _DMESH = int(Representation.DPCI), int(Representation.DMESH)


class DrawMethod(IntEnum):
    """Enumerate how a phase draws an object that no mesh replaces; the loop `describe` returns the same numbers."""

    POLYGONS = 0
    TILE = 1  # warped into an impostor tile
    DIRECT = 2  # its depth samples are drawn straight into the picture
    NOTHING = 3  # a planar image seen from behind: it has no back (Liu et al. 2007, §2)


# Plain numbers, since those of an IntEnum are slow to look up and to compare arrays with.
POLYGONS, TILE, DIRECT, NOTHING = (int(method) for method in DrawMethod)


@dataclass(frozen=True, kw_only=True)
class ObjectDetail:
    """Describe how m objects of a scene are drawn, those that no mesh replaces.

    Attributes
    ----------
    row : (m,) rows of the objects among all.
    viewer : (m, 3) the viewer in the objects' frames, metres.
    level : (m,) level of detail, 0 the finest.
    pieces : (m,) bit masks of the pieces, see `cook.cases`.
    triangles : (m,) number of triangles in all pieces of that level.
    method : (m,) `DrawMethod` of each.
    step : (m,) the paper's Iter_step, see `iter_step`.
    """

    row: Rows
    viewer: Array
    level: Ints
    pieces: Ints
    triangles: Ints
    method: NDArray[np.uint8]
    step: Array


class _FrozenDetail(NamedTuple):
    """Hold how all n objects are drawn while `lod.freeze` is on.

    table: the assets that levels and pieces refer to. as_mesh: (n,), which are drawn as meshes, once these are
    resident. level, pieces: (n,), for the others.
    """

    table: AssetTable
    as_mesh: Mask
    level: Ints
    pieces: Ints


class DetailSelector:
    """Choose the detail of objects for each frame, and keep it while `lod.freeze` is on."""

    def __init__(self) -> None:
        self._frozen: _FrozenDetail | None = None
        self._chooser = MeshChooser()

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
            as_mesh = np.zeros(len(objects), bool)
            as_mesh[self._as_mesh(view, scene, np.arange(len(objects)), settings, _all_resident)] = True
            viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
            level = choose_levels(view, objects, scene.bounds, viewer, table, lod)
            pieces = choose_pieces(objects.asset, level, viewer, table, lod)
            self._frozen = _FrozenDetail(table, as_mesh, level, pieces)

    def replaced(
        self, view: View, scene: SceneArrays, rows: Rows, settings: PlanSettings, is_resident: IsResident
    ) -> Rows:
        """Return which of the objects `rows` are replaced by their meshes.

        Parameters
        ----------
        view : the view of the picture.
        scene : all objects.
        rows : (m,) rows of the objects in question, nearest first.
        settings : the settings that decide the detail.
        is_resident : tells which meshes are on the GPU.

        Returns
        -------
        (k,) indices into `rows`, rising.
        """
        if self._frozen is None:
            return self._as_mesh(view, scene, rows, settings, is_resident)
        able = self._frozen.as_mesh[rows].nonzero()[0]
        return able[is_resident(scene.table.mesh_fallbacks.mesh[scene.objects.asset[rows[able]]])]

    def _as_mesh(
        self, view: View, scene: SceneArrays, rows: Rows, settings: PlanSettings, is_resident: IsResident
    ) -> Rows:
        """Return the indices (k,) of those `rows` (m,) that are near enough for a mesh, or quicker as one."""
        table = scene.table
        return self._chooser.as_meshes(
            view,
            scene.objects,
            rows,
            choice=scene.choice,
            fallbacks=table.mesh_fallbacks,
            levels=table.meshes,
            rule=fallback_rule(settings, is_resident),
        )

    def describe(self, view: View, scene: SceneArrays, rows: Rows, lod: LodParams) -> ObjectDetail:
        """Return how the objects `rows` are drawn, frozen or not; see the function `describe`."""
        if self._frozen is None:
            return describe(view, scene, rows, lod)
        viewer = _viewers(view, scene, rows)
        return _described(view, scene, rows, lod, viewer, self._frozen.level[rows], self._frozen.pieces[rows])


def fallback_rule(settings: PlanSettings, is_resident: IsResident) -> MeshFallbackRule:
    """Return when meshes replace depth images in the picture; see `MeshFallbackRule.is_resident`."""
    return MeshFallbackRule(
        magnification=settings.lod.magnification,
        is_resident=is_resident,
        error=settings.polygons.error,
        triangles_per_pixel=TRIANGLES_PER_PIXEL,
        texels=MESH_TEXELS,
    )


def _all_resident(meshes: Rows) -> Mask:
    """Treat every mesh as resident; an `IsResident`."""
    return np.ones(len(meshes), bool)


def describe(view: View, scene: SceneArrays, rows: Rows, lod: LodParams) -> ObjectDetail:
    """Choose how the objects `rows` are drawn.

    Parameters
    ----------
    view : the view of the picture.
    scene : all objects.
    rows : (m,) rows of the objects.
    lod : the settings of detail.

    Returns
    -------
    The detail of the m objects.
    """
    loops = kernels.loaded()
    usual = lod.mode != "paper" and lod.cases == "complete" and greatest_stretch(view) == 1
    if loops is not None and usual:
        return _describe_compiled(loops, view, scene, rows, lod)
    viewer, objects = _viewers(view, scene, rows), scene.objects.take(rows)
    level = choose_levels(view, objects, scene.bounds.take(rows), viewer, scene.table, lod)
    pieces = choose_pieces(objects.asset, level, viewer, scene.table, lod)
    return _described(view, scene, rows, lod, viewer, level, pieces)


def _viewers(view: View, scene: SceneArrays, rows: Rows) -> Array:
    """Return where the viewer stands (m, 3) in the frames of the objects `rows` (m,), metres."""
    objects = scene.objects
    return viewer_in_object(
        view, *(column.take(rows, 0) for column in (objects.position, objects.rotation, objects.scale))
    )


def _described(
    view: View, scene: SceneArrays, rows: Rows, lod: LodParams, viewer: Array, level: Ints, pieces: Ints
) -> ObjectDetail:
    """Complete the detail of the objects `rows` (m,), whose viewer, level and pieces (m, …) are chosen already."""
    table, objects = scene.table, scene.objects.take(rows)
    volumes = table.volumes.take(objects.asset)
    _, distance = warp_faces(viewer, volumes)
    # A viewer inside the cylinder, or nearly so, has no plane in front of the object to warp onto.
    near = (distance < MIN_PLANE_DISTANCE * volumes.radius) & (volumes.has_side | (distance > 0))
    imaged, direct = objects.representation == _DPCI, objects.representation == _DMESH
    pieces = np.where(imaged & near, ALL_PIECES, pieces)  # from inside, any image may be seen
    if lod.cases == "complete":  # all pieces: their edges, for silhouette lines, are then built once for all viewers
        pieces = np.where(direct, ALL_PIECES, pieces)
    method = np.full(len(rows), POLYGONS, np.uint8)
    method[imaged] = NOTHING
    method[imaged & (distance >= MIN_PLANE_DISTANCE * volumes.radius)] = TILE
    method[direct | (imaged & near)] = DIRECT
    metres = np.linalg.norm(scene.bounds.centre[rows] - view.position, axis=1)
    return ObjectDetail(
        row=rows,
        viewer=viewer,
        level=level,
        pieces=pieces,
        triangles=table.triangles[objects.asset, level],
        method=method,
        step=iter_step(metres, table.texel[objects.asset] * objects.scale, view.half_extent[1], view.whole_size[1]),
    )


def _describe_compiled(loops: ModuleType, view: View, scene: SceneArrays, rows: Rows, lod: LodParams) -> ObjectDetail:
    """Choose detail as `describe` does, by compiled `loops`; not for the paper's rules, nor for very wide pictures."""
    objects, bounds, table = scene.objects, scene.bounds, scene.table
    volumes = table.volumes
    viewer, level, pieces, triangles, method, step = loops.describe(
        rows=rows,
        position=objects.position,
        rotation=objects.rotation,
        scale=objects.scale,
        asset=objects.asset,
        representation=objects.representation,
        centre=bounds.centre,
        bounding_radius=bounds.bounding_radius,
        eye=view.position,
        detail_pixels=view.detail_pixels,
        error_at_a_metre=error_at_a_metre(view, lod),
        triangles_per_pixel=float(lod.triangles_per_pixel),
        step_at_a_metre=2 * view.half_extent[1] / view.whole_size[1],
        error=table.error,
        triangles=table.triangles,
        max_level=table.levels,
        asset_centre=table.centre,
        half_height=table.half_height,
        cylinder_radius=table.cylinder_radius,
        area=table.area,
        texel=table.texel,
        horizon=table.horizon,
        edges=CONE_EDGES,
        slack=HORIZON_SLACK,
        worth=float(_WORTH),
        side_pieces=SIDE_PIECES,
        all_pieces=ALL_PIECES,
        radius=volumes.radius,
        bottom=volumes.bottom,
        top=volumes.top,
        has_side=volumes.has_side,
        least_distance=MIN_PLANE_DISTANCE,
    )
    return ObjectDetail(
        row=rows, viewer=viewer, level=level, pieces=pieces, triangles=triangles, method=method, step=step
    )


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
    table : the levels of detail of the assets.
    lod : the settings of detail.

    Returns
    -------
    (n,) levels, 0 the finest.
    """
    asset, max_level = objects.asset, table.levels[objects.asset]
    distance, longer = np.linalg.norm(bounds.centre - view.position, axis=1), stretch(view, bounds.centre)
    if lod.mode == "paper":
        step = iter_step(distance, table.texel[asset] * objects.scale, view.half_extent[1], view.whole_size[1])
        max_level = np.minimum(max_level, int(np.log2(lod.max_step)))
        level = paper_level(step, lod.bias, max_level)
    else:
        nearest = table.nearest(asset, viewer) / longer
        level = error_level(table.error[asset], error_at_a_metre(view, lod) * nearest)
    pixels = (
        table.area[asset] * objects.scale**2 * (view.detail_pixels / np.maximum(distance, bounds.bounding_radius)) ** 2
    ) * longer**1.5  # as 1/cos³ of the angle off the axis
    affordable = affordable_level(table.triangles[asset], pixels, lod.triangles_per_pixel)
    return np.maximum(level, np.minimum(affordable, max_level))


def choose_pieces(asset: Rows, level: Rows, viewer: Array, table: AssetTable, lod: LodParams) -> Ints:
    """Choose the pieces of n objects that the viewer may see.

    Objects with few triangles keep all pieces of their sides: culling some would save less than an extra draw call
    costs. With the paper's cases, objects that were not cooked for them keep all pieces.

    Parameters
    ----------
    asset : (n,) number in `CookedParts` of each object's asset.
    level : (n,) level of detail of each object.
    viewer : (n, 3) the viewer in the frames of the objects, metres.
    table : the pieces of the assets and where they are seen from.
    lod : the settings of detail.

    Returns
    -------
    (n,) bit masks of the pieces.
    """
    if lod.cases != "complete":
        case = paper_cases(viewer, table.volumes.bottom[asset], table.volumes.top[asset])
        return np.where(table.has_paper_cases[asset], CASE_PIECES[lod.cases][case], ALL_PIECES)
    caps = table.horizon[asset[:, None], level[:, None], CAPS]
    pieces = seen_pieces(caps, viewer, CAPS) | SIDE_PIECES
    large = np.flatnonzero(table.triangles[asset, level] >= _WORTH)
    pieces[large] = seen_pieces(table.horizon[asset[large], level[large]], viewer[large])
    return pieces


def lasting_pieces(asset: Rows, level: Rows, viewer: Array, table: AssetTable, lod: LodParams) -> Ints:
    """Choose pieces for n objects whose tiles are reused after small moves of the viewer: all pieces.

    Except with the paper's cases, which are defined for the present viewer only: then this is `choose_pieces`, which
    has the same parameters.

    Returns
    -------
    (n,) bit masks of the pieces.
    """
    if lod.cases != "complete":
        return choose_pieces(asset, level, viewer, table, lod)
    return np.full(len(asset), ALL_PIECES)
