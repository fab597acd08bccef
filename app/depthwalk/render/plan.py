"""One frame's work, decided in NumPy over all objects at once: what is seen, how, in which order.

`plan_frame` yields draw groups (runs of instances that share an asset and an index range) and the instance records
that the shaders read. No GL here.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.atlas import pack_shelves
from depthwalk.render.lod import Case, LodParams, affordable_level, complete_cases, grid_level, iter_step, paper_cases
from depthwalk.render.planes import (
    MIN_PLANE_DISTANCE,
    Planes,
    Volumes,
    choose_planes,
    crop_to_frustum,
    viewer_in_object,
)
from depthwalk.render.rotation import rotate
from depthwalk.render.tiles import TileParams, Tiles, plane_tiles, screen_tiles
from depthwalk.render.view import View
from depthwalk.scene.arrays import Objects, Representation

Array = NDArray[np.floating]

# What warp.vert reads per object: plane axes with the epipole or the plane's offset in w; the viewer's distance to the
# plane and the tile's nearest w / λ; rows that map plane coordinates to the atlas in clip space; its corners there.
WARP_RECORD = np.dtype(
    [
        ("right", "4f4"),
        ("up", "4f4"),
        ("normal", "4f4"),
        ("depths", "2f4"),
        ("to_x", "3f4"),
        ("to_y", "3f4"),
        ("to_w", "3f4"),
        ("bounds", "4f4"),
    ]
)
# What composite.vert reads per object: rays from the viewer to the rectangle's corner and along its edges (world), and
# the tile's homogeneous texels there; the viewer in the object's frame, the object's rotation, the tile in texels,
# the object's scale and the tile's nearest w / λ.
COMPOSITE_RECORD = np.dtype(
    [
        ("corner", "3f4"),
        ("edge_u", "3f4"),
        ("edge_v", "3f4"),
        ("texel", "3f4"),
        ("texel_u", "3f4"),
        ("texel_v", "3f4"),
        ("viewer", "3f4"),
        ("rotation", "4f4"),
        ("tile", "4f4"),
        ("scales", "2f4"),
    ]
)
# What mesh.vert and dmesh.vert read per object: where it stands relative to the viewer, and how it is turned.
PLACED_RECORD = np.dtype([("origin", "3f4"), ("rotation", "4f4"), ("scale", "f4")])


@dataclass(frozen=True)
class AssetTable:
    """What the plan must know of each of a assets; arrays (a,) unless said otherwise.

    volumes: cylinders; texel: metres on the side image; levels: coarsest grid level; centre (a, 3), reach: bounding
    sphere about the asset's own centre, object frame; index_first, index_count: (a, levels, cases, runs), see Grids.
    """

    volumes: Volumes
    texel: Array
    levels: NDArray[np.int64]
    centre: Array
    reach: Array
    index_first: NDArray[np.int64]
    index_count: NDArray[np.int64]


@dataclass(frozen=True)
class Group:
    """`count` instance records from `first` on are drawn with the same asset and indices."""

    asset: int
    first: int
    count: int
    indices: tuple[tuple[int, int], ...] = ()  # first index and number of indices of each run
    clipped: bool = False  # samples may fall outside their tile


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
        self._frozen: dict[str, NDArray[np.int64]] | None = None

    def plan(
        self,
        view: View,
        objects: Objects,
        table: AssetTable,
        lod: LodParams,
        layout: TileParams,
        atlas_size: tuple[int, int],
    ) -> FramePlan:
        visible = visible_objects(view, objects, table)
        level, case = self._levels_and_cases(view, objects, table, lod)
        kind = objects.representation[visible]
        imaged = visible[kind == Representation.DPCI]
        near = _too_near(objects, table, view, imaged)
        case[near] = Case.ALL  # from inside, any image may be seen
        direct = np.concatenate([visible[kind == Representation.DMESH], near])
        warped, planes, tiles, clipped = _place_tiles(view, objects, table, imaged, layout, atlas_size)
        tiles, corners, used, shrink = _pack(tiles, atlas_size)

        order = _group_order(objects.asset[warped], level[warped], case[warped], clipped.astype(np.int64))
        warped, planes, tiles, corners = warped[order], planes.select(order), tiles.select(order), corners[order]
        groups = _groups(warped, objects, table, level, case, clipped[order])
        warp = Drawing(_warp_records(planes, tiles, corners, atlas_size), groups)
        rectangles = _composite_records(view, objects, warped, planes, tiles, corners)
        composite = Drawing(rectangles, _groups(warped, objects))
        dmesh = _placed_drawing(view, objects, direct, table, level, case)
        mesh = _placed_drawing(view, objects, visible[kind == Representation.MESH])
        counts = _counts(len(objects), warp, composite, dmesh, mesh, level[warped], case[warped])
        counts |= {"atlas_used": used / atlas_size[1], "tile_resolution": shrink}
        return FramePlan(warp, composite, dmesh, mesh, used, counts)

    def _levels_and_cases(
        self, view: View, objects: Objects, table: AssetTable, lod: LodParams
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Grid level and Case (n,) of every object; those of the moment it was switched on while lod.freeze is set."""
        if lod.freeze and self._frozen is not None and len(self._frozen["level"]) == len(objects):
            return self._frozen["level"].copy(), self._frozen["case"].copy()
        asset = objects.asset
        offset = rotate(objects.rotation, table.centre[asset] * objects.scale[:, None])
        distance = np.linalg.norm(objects.position + offset - view.position, axis=1)
        step = iter_step(distance, table.texel[asset] * objects.scale, view.half_extent[1], view.size[1])
        max_level = np.minimum(table.levels[asset], int(np.log2(lod.max_step)))
        level = grid_level(step, lod.bias, max_level)
        tall = (table.volumes.top - table.volumes.bottom)[asset] * objects.scale
        wide = 2 * table.volumes.radius[asset] * objects.scale
        pixels = wide * tall * (view.focal_pixels / np.maximum(distance, view.near)) ** 2
        triangles = table.index_count[asset, :, Case.ALL].sum(-1) // 3
        level = np.maximum(level, np.minimum(affordable_level(triangles, pixels, lod.triangles_per_pixel), max_level))
        volumes = select_volumes(table.volumes, asset)
        viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
        if lod.cases == "paper":
            case = paper_cases(viewer, volumes.bottom, volumes.top)
        else:
            case = complete_cases(viewer, volumes.bottom, volumes.top, volumes.radius)
        case = case.astype(np.int64)
        self._frozen = {"level": level.copy(), "case": case.copy()} if lod.freeze else None
        return level, case


def visible_objects(view: View, objects: Objects, table: AssetTable) -> NDArray[np.intp]:
    """Indices of the objects whose bounding sphere meets the view frustum, nearest first."""
    centre = objects.position + rotate(objects.rotation, table.centre[objects.asset] * objects.scale[:, None])
    reach = table.reach[objects.asset] * objects.scale
    right, up, forward = ((centre - view.position) @ view.axes.T).T
    seen = (forward > view.near - reach) & (forward < view.far + reach)
    for tangent, sideways in zip(view.half_extent, (right, up), strict=True):
        seen &= np.abs(sideways) - tangent * forward < reach * np.hypot(1, tangent)
    indices = np.flatnonzero(seen)
    return indices[np.argsort(forward[indices], kind="stable")]


def select_volumes(volumes: Volumes, asset: NDArray[np.integer]) -> Volumes:
    return Volumes(*(getattr(volumes, name)[asset] for name in volumes.__dataclass_fields__))


def _planes_of(view: View, objects: Objects, table: AssetTable, chosen: NDArray[np.intp]) -> Planes:
    viewer = viewer_in_object(view, objects.position[chosen], objects.rotation[chosen], objects.scale[chosen])
    return choose_planes(viewer, select_volumes(table.volumes, objects.asset[chosen]))


def _too_near(objects: Objects, table: AssetTable, view: View, chosen: NDArray[np.intp]) -> NDArray[np.intp]:
    """Those of `chosen` that no plane serves: the viewer is inside the cylinder or nearly so.

    A planar image seen from behind is left out: it has no back (Liu et al. 2007, §2).
    """
    distance = _planes_of(view, objects, table, chosen).distance
    volumes = select_volumes(table.volumes, objects.asset[chosen])
    return chosen[(distance < MIN_PLANE_DISTANCE * volumes.radius) & (volumes.has_side | (distance > 0))]


def _place_tiles(
    view: View,
    objects: Objects,
    table: AssetTable,
    chosen: NDArray[np.intp],
    layout: TileParams,
    atlas_size: tuple[int, int],
) -> tuple[NDArray[np.intp], Planes, Tiles, NDArray[np.bool_]]:
    """Which of `chosen` are warped onto a plane (m,), their planes cut to the frustum, their tiles, and which were cut
    (m,)."""
    planes = _planes_of(view, objects, table, chosen)
    usable = np.flatnonzero(planes.distance >= MIN_PLANE_DISTANCE * table.volumes.radius[objects.asset[chosen]])
    planes, seen = crop_to_frustum(planes.select(usable), view, objects.rotation[chosen[usable]])
    kept = np.flatnonzero(seen.visible)
    warped, planes, seen = chosen[usable][kept], planes.select(kept), seen.select(kept)
    limit = min(atlas_size)
    if layout.tiles == "plane":
        return warped, *plane_tiles(planes, view.focal_pixels * layout.tile_scale, limit), ~seen.whole
    centre = objects.position[warped] + rotate(
        objects.rotation[warped], table.centre[objects.asset[warped]] * objects.scale[warped, None]
    )
    reach = table.reach[objects.asset[warped]] * objects.scale[warped]
    depth = np.maximum((centre - view.position) @ view.axes[2] - reach, view.near) / objects.scale[warped]
    return warped, planes, screen_tiles(planes, seen, view, depth, layout.tile_scale, limit), ~seen.whole


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


def _group_order(*keys: NDArray[np.integer]) -> NDArray[np.intp]:
    """Sorts by the first key, then the second and so on; equal ones stay nearest first."""
    return np.lexsort(keys[::-1])


def _groups(
    chosen: NDArray[np.intp],
    objects: Objects,
    table: AssetTable | None = None,
    level: NDArray[np.int64] | None = None,
    case: NDArray[np.int64] | None = None,
    clipped: NDArray[np.bool_] | None = None,
) -> list[Group]:
    """Runs of equal asset, and of equal level and case (of all objects) and clipped (of `chosen`) where they are given.

    The loop is over groups.
    """
    if not len(chosen):
        return []
    if clipped is None:
        clipped = np.zeros(len(chosen), bool)
    keys: list[NDArray[np.integer]] = [objects.asset[chosen]]
    if level is not None and case is not None:
        keys += [level[chosen], case[chosen]]
    changed = np.logical_or.reduce([key[1:] != key[:-1] for key in (*keys, clipped)])
    starts = np.concatenate([[0], np.flatnonzero(changed) + 1])
    counts = np.diff(np.append(starts, len(chosen)))
    groups = []
    for start, count in zip(starts.tolist(), counts.tolist(), strict=True):
        key = tuple(int(k[start]) for k in keys)
        runs: tuple[tuple[int, int], ...] = ()
        if table is not None:
            pairs = zip(table.index_first[key].tolist(), table.index_count[key].tolist(), strict=True)
            runs = tuple((first, length) for first, length in pairs if length)
        groups.append(Group(key[0], start, count, runs, bool(clipped[start])))
    return groups


def _warp_records(
    planes: Planes, tiles: Tiles, corners: NDArray[np.int64], atlas_size: tuple[int, int]
) -> NDArray[np.void]:
    records = np.zeros(len(corners), WARP_RECORD)
    records["right"] = np.column_stack([planes.right, planes.epipole[:, 0]])
    records["up"] = np.column_stack([planes.up, planes.epipole[:, 1]])
    records["normal"] = np.column_stack([planes.normal, planes.offset])
    records["depths"] = np.column_stack([planes.distance, tiles.nearest])
    atlas = np.asarray(atlas_size, float)
    w = tiles.texel[:, 2]
    for axis, name in enumerate(("to_x", "to_y")):
        records[name] = 2 * (tiles.texel[:, axis] + corners[:, axis, None] * w) / atlas[axis] - w
    records["to_w"] = w
    records["bounds"] = np.column_stack([2 * corners / atlas - 1, 2 * (corners + tiles.size) / atlas - 1])
    return records


def _composite_records(
    view: View, objects: Objects, chosen: NDArray[np.intp], planes: Planes, tiles: Tiles, corners: NDArray[np.int64]
) -> NDArray[np.void]:
    records = np.zeros(len(chosen), COMPOSITE_RECORD)
    rotation, scale = objects.rotation[chosen], objects.scale[chosen]
    corner = planes.low[:, :1] * planes.right + planes.low[:, 1:] * planes.up - planes.distance[:, None] * planes.normal
    extent = planes.high - planes.low
    vectors = (("corner", corner), ("edge_u", extent[:, :1] * planes.right), ("edge_v", extent[:, 1:] * planes.up))
    for name, vector in vectors:
        records[name] = rotate(rotation, vector) * scale[:, None]
    records["texel"] = np.einsum("nij,nj->ni", tiles.texel, np.column_stack([planes.low, np.ones(len(chosen))]))
    records["texel_u"] = tiles.texel[..., 0] * extent[:, :1]
    records["texel_v"] = tiles.texel[..., 1] * extent[:, 1:]
    records["viewer"] = viewer_in_object(view, objects.position[chosen], rotation, scale)
    records["rotation"] = rotation
    records["tile"] = np.column_stack([corners, tiles.size])
    records["scales"] = np.column_stack([scale, tiles.nearest])
    return records


def _placed_drawing(
    view: View,
    objects: Objects,
    chosen: NDArray[np.intp],
    table: AssetTable | None = None,
    level: NDArray[np.int64] | None = None,
    case: NDArray[np.int64] | None = None,
) -> Drawing:
    keys: list[NDArray[np.integer]] = [objects.asset[chosen]]
    if level is not None and case is not None:
        keys += [level[chosen], case[chosen]]
    chosen = chosen[_group_order(*keys)]
    records = np.zeros(len(chosen), PLACED_RECORD)
    records["origin"] = objects.position[chosen] - view.position
    records["rotation"], records["scale"] = objects.rotation[chosen], objects.scale[chosen]
    return Drawing(records, _groups(chosen, objects, table, level, case))


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
