"""One frame's work, decided in NumPy over all objects at once: what is seen, how, in which order.

`Planner.plan` yields draw groups (runs of instances that share an asset and an index range) and the instance records
that the shaders read. No GL here.
"""

from dataclasses import dataclass, field, replace
from operator import add
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.bounds import Bounds
from depthwalk.render.lod import (
    Case,
    LodParams,
    affordable_level,
    error_level,
    grid_level,
    iter_step,
    paper_cases,
)
from depthwalk.render.mesh_lod import MeshLodParams, mesh_level
from depthwalk.render.planes import MIN_PLANE_DISTANCE, Volumes, nearest_faces, viewer_in_object
from depthwalk.render.records import placed_records
from depthwalk.render.reuse import Shown, TilePlanner, TileWork
from depthwalk.render.tiles import TileParams
from depthwalk.render.view import View
from depthwalk.scene.arrays import MESHES, Objects, Representation

Array = NDArray[np.floating]

_OF_ROUNDS: dict[str, Any] = {  # how the counts of a frame's rounds make its own; others are added up
    "objects": max,
    "atlas_used": max,
    "tile_resolution": min,
    "tile_error": max,
}


@dataclass(frozen=True)
class AssetTable:
    """What the plan must know of each of a meshes and depth objects; arrays (a,) unless said otherwise.

    volumes: cylinders; texel: metres on the side image; levels: coarsest grid level; centre (a, 3), reach: bounding
    sphere about the asset's own centre, object frame; half_height, girth: half the height and the radius of an upright
    cylinder about it that holds all; index_first, index_count: (a, levels, cases, runs), see Grids; triangles:
    (a, levels), of all images; error: (a, levels), see Grids, +inf where there is no such level; mesh_error,
    mesh_triangles: (a, mesh levels), see `MeshLevel`, +inf and 0 where a mesh has no such level.
    """

    volumes: Volumes
    texel: Array
    levels: NDArray[np.int64]
    centre: Array
    reach: Array
    half_height: Array
    girth: Array
    index_first: NDArray[np.int64]
    index_count: NDArray[np.int64]
    triangles: NDArray[np.int64]
    error: Array
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

    @classmethod
    def joined(cls, drawings: list["Drawing"]) -> "Drawing":
        """One after the other."""
        starts = np.cumsum([0] + [len(each.records) for each in drawings]).tolist()
        pairs = zip(starts, drawings, strict=False)
        groups = [replace(group, first=start + group.first) for start, each in pairs for group in each.groups]
        return cls(np.concatenate([each.records for each in drawings]), groups)


@dataclass
class Rectangles:
    """What pass 2 draws: records of which the first `aligned` have texels that are pixels; of either, nearest first."""

    records: NDArray[np.void]
    aligned: int

    @classmethod
    def joined(cls, rectangles: list["Rectangles"]) -> "Rectangles":
        """All of them; those of one round after those of another."""
        first = [each.records[: each.aligned] for each in rectangles]
        others = [each.records[each.aligned :] for each in rectangles]
        return cls(np.concatenate(first + others), sum(each.aligned for each in rectangles))


@dataclass
class FramePlan:
    """What the passes draw. counts: numbers for HUD and benchmark; cleared: (n, 4), slots of the atlas, x, y, width and
    height, that pass 1 fills anew; numbered: (d,) rows of the objects that composite and dmesh draw, by the numbers
    that they write for them, from `first_number` on; tiled: (d,), whether composite does."""

    warp: Drawing
    composite: Rectangles
    dmesh: Drawing
    mesh: Drawing
    cleared: NDArray[np.integer]
    counts: dict[str, int | float]
    numbered: NDArray[np.integer]
    tiled: NDArray[np.bool_]
    first_number: int = 1

    @classmethod
    def joined(cls, rounds: list["FramePlan"]) -> "FramePlan":
        """All that the rounds of a frame draw."""
        if len(rounds) == 1:
            return rounds[0]
        drawings: dict[str, Any] = {
            name: Drawing.joined([getattr(each, name) for each in rounds]) for name in ("warp", "dmesh", "mesh")
        }
        counts: dict[str, int | float] = {}
        for each in rounds:
            for name, count in each.counts.items():
                counts[name] = _OF_ROUNDS.get(name, add)(counts[name], count) if name in counts else count
        drawings["composite"] = Rectangles.joined([each.composite for each in rounds])
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(each, name) for each in rounds]) for name in ("cleared", "numbered", "tiled")
        }
        return cls(**drawings, **columns, counts=counts)


class Planner:
    """Makes the plan of each frame; holds the intermediate images that are kept, and what `lod.freeze` keeps."""

    def __init__(self) -> None:
        self._frozen: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None  # level and case of every object
        self._tiles = TilePlanner()
        self._objects: Objects | None = None  # of the frame before, and what else its tiles were made for
        self._made_for: tuple[Any, ...] = ()

    def plan(
        self,
        view: View,
        objects: Objects,
        bounds: Bounds,
        visible: NDArray[np.integer],
        table: AssetTable,
        lod: LodParams,
        layout: TileParams,
        polygons: MeshLodParams,
        atlas_size: tuple[int, int],
        goes_on: bool = False,
        first_number: int = 1,
    ) -> FramePlan:
        """The frame that shows the objects `visible` (m,), nearest first, of all `objects`; or where it `goes_on`, its
        next round, when the one before is drawn. first_number: see `FramePlan`."""
        self._forget_if_changed(view, objects, table, lod, layout, atlas_size)
        placed, spheres = objects.take(visible), bounds.take(visible)
        viewer = viewer_in_object(view, placed.position, placed.rotation, placed.scale)
        if lod.freeze:
            level, case = self._frozen_levels(view, objects, bounds, table, lod)
            level, case = level[visible], case[visible]
        else:
            self._frozen = None
            level, case = choose_levels(view, placed, spheres, viewer, table, lod)
        imaged = np.flatnonzero(placed.representation == Representation.DPCI)
        volumes = table.volumes.take(placed.asset[imaged])
        _, distance = nearest_faces(viewer[imaged], volumes)
        usable = distance >= MIN_PLANE_DISTANCE * volumes.radius
        # Inside the cylinder or nearly so no plane serves. A planar image seen from behind is left out: it has no back
        # (Liu et al. 2007, §2).
        near = imaged[~usable & (volumes.has_side | (distance > 0))]
        case[near] = Case.ALL  # from inside, any image may be seen
        imaged = imaged[usable]
        triangles = table.triangles[placed.asset[imaged], level[imaged]]
        parts = placed.take(imaged), spheres.take(imaged), volumes.take(usable)
        shown = Shown(visible[imaged], *parts, viewer[imaged], level[imaged], case[imaged], triangles)
        work = self._tiles.plan(view, shown, layout, goes_on)

        anew = shown.take(work.anew)
        order = np.lexsort((~work.whole, anew.case, anew.level, anew.objects.asset))
        anew = anew.take(order)
        runs = draw_groups(table, anew.objects.asset, anew.level, anew.case, ~work.whole[order])
        warp = Drawing(work.warp[order], runs)
        composite = Rectangles(work.composite, work.aligned)

        direct = np.concatenate([np.flatnonzero(placed.representation == Representation.DMESH), near])
        direct = direct[np.lexsort((case[direct], level[direct], placed.asset[direct]))]
        runs = draw_groups(table, placed.asset[direct], level[direct], case[direct])
        dmesh = Drawing(placed_records(view.position, placed.take(direct)), runs)
        meshes = np.flatnonzero(np.isin(placed.representation, MESHES))
        fine = mesh_level(view, placed.take(meshes), spheres.take(meshes), table.mesh_error, polygons.error)
        order = np.lexsort((fine, placed.asset[meshes]))  # of equals, the nearest stays first
        meshes, fine = meshes[order], fine[order]
        mesh = Drawing(
            placed_records(view.position, placed.take(meshes)), draw_groups(table, placed.asset[meshes], fine)
        )
        counts = _counts(len(objects), warp, composite, dmesh, mesh, work)
        counts["mesh_triangles"] = int(table.mesh_triangles[placed.asset[meshes], fine].sum())
        numbered = visible[np.concatenate([imaged[work.drawn], direct])]
        tiled = np.arange(len(numbered)) < len(composite.records)
        return FramePlan(warp, composite, dmesh, mesh, work.slots, counts, numbered, tiled, first_number)

    def _forget_if_changed(
        self,
        view: View,
        objects: Objects,
        table: AssetTable,
        lod: LodParams,
        layout: TileParams,
        atlas_size: tuple[int, int],
    ) -> None:
        """Drops what is kept where it was made for other objects or with other settings. Where an object stands does
        not matter: it is compared by the viewer in its frame."""
        made_for = table, lod.model_dump(), layout.model_dump(), view.size, atlas_size
        before = self._objects
        same = before is not None and made_for[0] is self._made_for[0] and made_for[1:] == self._made_for[1:]
        self._objects, self._made_for = objects, made_for
        if same and (objects is before or _of_one_kind(objects, before)):
            return
        self._tiles.forget(len(objects), atlas_size)

    def _frozen_levels(
        self, view: View, objects: Objects, bounds: Bounds, table: AssetTable, lod: LodParams
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Grid level and Case (n,) of all objects, as they were when lod.freeze was switched on."""
        if self._frozen is None or len(self._frozen[0]) != len(objects):
            viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
            self._frozen = choose_levels(view, objects, bounds, viewer, table, lod)
        return self._frozen


def _of_one_kind(objects: Objects, before: Objects | None) -> bool:
    columns = ("asset", "representation")
    return all(np.array_equal(getattr(objects, name), getattr(before, name)) for name in columns)


def choose_levels(
    view: View, objects: Objects, bounds: Bounds, viewer: Array, table: AssetTable, lod: LodParams
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Level and Case (n,) of n objects, from their distance and the viewer (n, 3) in their frames."""
    asset, max_level = objects.asset, table.levels[objects.asset]
    distance = np.linalg.norm(bounds.centre - view.position, axis=1)
    if lod.mode == "paper":
        step = iter_step(distance, table.texel[asset] * objects.scale, view.half_extent[1], view.size[1])
        max_level = np.minimum(max_level, int(np.log2(lod.max_step)))
        level = grid_level(step, lod.bias, max_level)
    else:
        nearest = np.maximum(distance - bounds.reach, 0)
        level = error_level(table.error[asset], lod.error * 2**lod.bias * nearest / (view.focal_pixels * objects.scale))
    volumes = table.volumes.take(asset)
    area = 2 * volumes.radius * (volumes.top - volumes.bottom) * objects.scale**2
    pixels = area * (view.focal_pixels / np.maximum(distance, bounds.reach)) ** 2
    affordable = affordable_level(table.triangles[asset], pixels, lod.triangles_per_pixel)
    level = np.maximum(level, np.minimum(affordable, max_level))
    in_paper = lod.cases == "paper"
    case = paper_cases(viewer, volumes.bottom, volumes.top) if in_paper else np.full(len(asset), Case.ALL)
    return level, case.astype(np.int64)


def draw_groups(
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
    total: int, warp: Drawing, composite: Rectangles, dmesh: Drawing, mesh: Drawing, work: TileWork
) -> dict[str, int | float]:
    warped = sum(group.count * length for group in warp.groups + dmesh.groups for _, length in group.indices) // 3
    drawn: dict[str, int | float] = {
        "objects": total,
        "occluded": 0,
        "dpci": len(composite.records),
        "dmesh": len(dmesh.records),
        "mesh": len(mesh.records),
        "shadow_maps": 0,
        "shadow_triangles": 0,
        "warped": len(warp.records),
        "warped_triangles": warped,
        "draw_groups": len(warp.groups),
    }
    steps = {f"step_{1 << k}": int(n) for k, n in enumerate(np.bincount(work.level)) if n}
    cases = {f"case_{Case(k).name.lower()}": int(n) for k, n in enumerate(np.bincount(work.case)) if n}
    atlas = {
        "atlas_used": work.atlas_used,
        "tile_resolution": float(work.resolution.min(initial=1)),
        "tile_error": float(work.error.max(initial=0)),
    }
    return drawn | steps | cases | atlas
