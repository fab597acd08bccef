"""One frame's work, decided in NumPy over all objects at once: what is seen, how, in which order.

`Planner.plan` yields draw groups (runs of instances that share an asset and an index range) and the instance records
that the shaders read. No GL here.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.atlas import pack_shelves
from depthwalk.render.bounds import Bounds
from depthwalk.render.lod import (
    Case,
    LodParams,
    affordable_level,
    grid_level,
    iter_step,
    paper_cases,
)
from depthwalk.render.mesh_lod import MeshLodParams, mesh_level
from depthwalk.render.planes import (
    MIN_PLANE_DISTANCE,
    Planes,
    Volumes,
    choose_planes,
    crop_to_frustum,
    viewer_in_object,
)
from depthwalk.render.records import composite_records, placed_records, warp_records
from depthwalk.render.tiles import TileParams, Tiles, plane_tiles, screen_tiles
from depthwalk.render.view import View
from depthwalk.scene.arrays import MESHES, Objects, Representation

Array = NDArray[np.floating]


@dataclass(frozen=True)
class AssetTable:
    """What the plan must know of each of a meshes and depth objects; arrays (a,) unless said otherwise.

    volumes: cylinders; texel: metres on the side image; levels: coarsest grid level; centre (a, 3), reach: bounding
    sphere about the asset's own centre, object frame; index_first, index_count: (a, levels, cases, runs), see Grids;
    triangles: (a, levels), of all images; mesh_error, mesh_triangles: (a, mesh levels), see `MeshLevel`, +inf and 0
    where a mesh has no such level.
    """

    volumes: Volumes
    texel: Array
    levels: NDArray[np.int64]
    centre: Array
    reach: Array
    index_first: NDArray[np.int64]
    index_count: NDArray[np.int64]
    triangles: NDArray[np.int64]
    mesh_error: Array
    mesh_triangles: NDArray[np.int64]


@dataclass(frozen=True)
class Group:
    """`count` instance records from `first` on are drawn with the same asset and indices."""

    asset: int
    first: int
    count: int
    indices: tuple[tuple[int, int], ...] = ()  # first index and number of indices of each run
    clipped: bool = False  # samples may fall outside their tile
    level: int = 0
    case: int = Case.ALL


@dataclass
class Drawing:
    """Instance records sorted so that each group is one run."""

    records: NDArray[np.void]
    groups: list[Group] = field(default_factory=list)


@dataclass
class FramePlan:
    """What the passes draw. counts: numbers for HUD and benchmark; atlas_height: rows of the atlas in use."""

    warp: Drawing
    composite: Drawing
    dmesh: Drawing
    mesh: Drawing
    atlas_height: int
    counts: dict[str, int | float]


class Planner:
    """Makes the plan of each frame; holds what `lod.freeze` keeps."""

    def __init__(self) -> None:
        self._frozen: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None  # level and case of every object

    def plan(
        self,
        view: View,
        objects: Objects,
        bounds: Bounds,
        visible: NDArray[np.intp],
        table: AssetTable,
        lod: LodParams,
        layout: TileParams,
        polygons: MeshLodParams,
        atlas_size: tuple[int, int],
    ) -> FramePlan:
        """The frame that shows the objects `visible` (m,), nearest first, of all `objects`."""
        shown, spheres = objects.take(visible), bounds.take(visible)
        viewer = viewer_in_object(view, shown.position, shown.rotation, shown.scale)
        if lod.freeze:
            level, case = self._frozen_levels(view, objects, bounds, table, lod)
            level, case = level[visible], case[visible]
        else:
            self._frozen = None
            level, case = choose_levels(view, shown, spheres, viewer, table, lod)
        imaged = np.flatnonzero(shown.representation == Representation.DPCI)
        volumes = table.volumes.take(shown.asset[imaged])
        planes = choose_planes(viewer[imaged], volumes)
        usable = planes.distance >= MIN_PLANE_DISTANCE * volumes.radius
        # Inside the cylinder or nearly so no plane serves. A planar image seen from behind is left out: it has no back
        # (Liu et al. 2007, §2).
        near = imaged[~usable & (volumes.has_side | (planes.distance > 0))]
        case[near] = Case.ALL  # from inside, any image may be seen
        kept, planes, tiles, whole = _place_tiles(
            view, shown.take(imaged[usable]), spheres.take(imaged[usable]), planes.take(usable), layout, min(atlas_size)
        )
        warped = imaged[usable][kept]
        tiles, corners, used, shrink = _pack(tiles, atlas_size)

        order = np.lexsort((~whole, case[warped], level[warped], shown.asset[warped]))
        warped, planes, tiles, corners = warped[order], planes.take(order), tiles.take(order), corners[order]
        runs = _groups(table, shown.asset[warped], level[warped], case[warped], ~whole[order])
        warp = Drawing(warp_records(planes, tiles, corners, atlas_size), runs)
        rectangles = composite_records(shown.take(warped), viewer[warped], planes, tiles, corners)
        composite = Drawing(rectangles, _groups(table, shown.asset[warped]))

        direct = np.concatenate([np.flatnonzero(shown.representation == Representation.DMESH), near])
        direct = direct[np.lexsort((case[direct], level[direct], shown.asset[direct]))]
        runs = _groups(table, shown.asset[direct], level[direct], case[direct])
        dmesh = Drawing(placed_records(view, shown.take(direct)), runs)
        meshes = np.flatnonzero(np.isin(shown.representation, MESHES))
        fine = mesh_level(view, shown.take(meshes), spheres.take(meshes), table.mesh_error, polygons.error)
        order = np.lexsort((fine, shown.asset[meshes]))  # of equals, the nearest stays first
        meshes, fine = meshes[order], fine[order]
        mesh = Drawing(placed_records(view, shown.take(meshes)), _groups(table, shown.asset[meshes], fine))
        counts = _counts(len(objects), warp, composite, dmesh, mesh, level[warped], case[warped])
        counts["mesh_triangles"] = int(table.mesh_triangles[shown.asset[meshes], fine].sum())
        counts |= {"atlas_used": used / atlas_size[1], "tile_resolution": shrink}
        return FramePlan(warp, composite, dmesh, mesh, used, counts)

    def _frozen_levels(
        self, view: View, objects: Objects, bounds: Bounds, table: AssetTable, lod: LodParams
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Grid level and Case (n,) of all objects, as they were when lod.freeze was switched on."""
        if self._frozen is None or len(self._frozen[0]) != len(objects):
            viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
            self._frozen = choose_levels(view, objects, bounds, viewer, table, lod)
        return self._frozen


def choose_levels(
    view: View, objects: Objects, bounds: Bounds, viewer: Array, table: AssetTable, lod: LodParams
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Grid level and Case (n,) of n objects, from their centres' distance and the viewer (n, 3) in their frames."""
    asset = objects.asset
    distance = np.linalg.norm(bounds.centre - view.position, axis=1)
    step = iter_step(distance, table.texel[asset] * objects.scale, view.half_extent[1], view.size[1])
    max_level = np.minimum(table.levels[asset], int(np.log2(lod.max_step)))
    level = grid_level(step, lod.bias, max_level)
    volumes = table.volumes.take(asset)
    area = 2 * volumes.radius * (volumes.top - volumes.bottom) * objects.scale**2
    pixels = area * (view.focal_pixels / np.maximum(distance, bounds.reach)) ** 2
    affordable = affordable_level(table.triangles[asset], pixels, lod.triangles_per_pixel)
    level = np.maximum(level, np.minimum(affordable, max_level))
    in_paper = lod.cases == "paper"
    case = paper_cases(viewer, volumes.bottom, volumes.top) if in_paper else np.full(len(asset), Case.ALL)
    return level, case.astype(np.int64)


def _place_tiles(
    view: View, objects: Objects, bounds: Bounds, planes: Planes, layout: TileParams, limit: int
) -> tuple[NDArray[np.intp], Planes, Tiles, NDArray[np.bool_]]:
    """Which of the objects are seen (m,), their planes cut to the frustum, their tiles, and which are whole (m,)."""
    planes, seen = crop_to_frustum(planes, view, objects.rotation)
    kept = np.flatnonzero(seen.visible)
    planes, seen = planes.take(kept), seen.take(kept)
    if layout.tiles == "plane":
        return kept, *plane_tiles(planes, view.focal_pixels * layout.tile_scale, limit), seen.whole
    nearest = (bounds.centre[kept] - view.position) @ view.axes[2] - bounds.reach[kept]
    depth = np.maximum(nearest, view.depth_range[0]) / objects.scale[kept]
    return kept, planes, screen_tiles(planes, seen, view, depth, layout.tile_scale, limit), seen.whole


def _pack(tiles: Tiles, atlas_size: tuple[int, int]) -> tuple[Tiles, NDArray[np.int64], int, float]:
    """The tiles, shrunk by a common factor if they would not fit; their corners (n, 2); rows used; that factor."""
    shrink = 1.0
    packed = tiles
    while True:
        corners, used = pack_shelves(packed.size, atlas_size[0])
        if used <= atlas_size[1]:
            return packed, corners, used, shrink
        shrink *= min(0.97, (atlas_size[1] / used) ** 0.5)
        packed = tiles.shrunk(shrink)


def _groups(
    table: AssetTable,
    asset: NDArray[np.integer],
    level: NDArray[np.integer] | None = None,
    case: NDArray[np.integer] | None = None,
    clipped: NDArray[np.bool_] | None = None,
) -> list[Group]:
    """Runs of equal asset (n,), and of equal level, case and clipped (n,) where given. The loop is over groups. With a
    case, they hold the runs of indices that a depth object has for it."""
    if not len(asset):
        return []
    keys = [key for key in (asset, level, case) if key is not None]
    clipped = np.zeros(len(asset), bool) if clipped is None else clipped
    changed = np.logical_or.reduce([key[1:] != key[:-1] for key in (*keys, clipped)])
    starts = np.concatenate([[0], np.flatnonzero(changed) + 1])
    counts = np.diff(np.append(starts, len(asset)))
    groups = []
    for start, count in zip(starts.tolist(), counts.tolist(), strict=True):
        key = tuple(int(k[start]) for k in keys)
        runs: tuple[tuple[int, int], ...] = ()
        if case is not None:
            pairs = zip(table.index_first[key].tolist(), table.index_count[key].tolist(), strict=True)
            runs = tuple((first, length) for first, length in pairs if length)
        groups.append(Group(key[0], start, count, runs, bool(clipped[start]), *key[1:]))
    return groups


def _counts(
    total: int,
    warp: Drawing,
    composite: Drawing,
    dmesh: Drawing,
    mesh: Drawing,
    level: NDArray[np.int64],
    case: NDArray[np.int64],
) -> dict[str, int | float]:
    drawn: dict[str, int | float] = {
        "objects": total,
        "dpci": len(composite.records),
        "dmesh": len(dmesh.records),
        "mesh": len(mesh.records),
    }
    warped = sum(group.count * length for group in warp.groups + dmesh.groups for _, length in group.indices) // 3
    drawn |= {"warped_triangles": warped, "draw_groups": len(warp.groups)}
    steps = {f"step_{1 << k}": int(n) for k, n in enumerate(np.bincount(level)) if n}
    cases = {f"case_{Case(k).name.lower()}": int(n) for k, n in enumerate(np.bincount(case)) if n}
    return drawn | steps | cases
