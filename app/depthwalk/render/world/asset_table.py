"""The scene's objects and assets in the arrays that the plan works on."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.cases import PIECES, RANGES
from depthwalk.cook.cook import CookedObject
from depthwalk.geometry.quaternions import multiply, rotate
from depthwalk.geometry.spatial_order import within_runs
from depthwalk.geometry.support_function import DIRECTIONS
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.render.impostors.warp_planes import Volumes
from depthwalk.render.lod.mesh_fallback import MeshFallbacks
from depthwalk.render.lod.mesh_lod import MeshLevels
from depthwalk.render.resources.asset_store import AssetStore, Library
from depthwalk.render.view.bounds import outside
from depthwalk.scene.arrays import MESHES, Objects, Representation
from depthwalk.types import Array

if TYPE_CHECKING:
    from depthwalk.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class AssetTable:
    """What the plan must know of each of a meshes and depth objects; arrays (a,) unless said otherwise.

    volumes: cylinders; texel: metres on the side image; levels: coarsest grid level; centre (a, 3), reach: bounding
    sphere about the asset's own centre, object frame; half_height, girth: half the height and the radius of an upright
    cylinder about it that holds all; index_first, index_count: (a, levels, RANGES) and horizon:
    (a, levels, PIECES, 4), see LodGeometry; triangles: (a, levels), of all pieces; error: (a, levels), see LodGeometry, +inf where
    there is no such level; meshes: levels of detail; stand_ins: which of the meshes may stand in for which depth
    objects.
    """

    volumes: Volumes
    texel: Array
    levels: NDArray[np.int64]
    centre: Array
    bounding_radius: Array
    half_height: Array
    cylinder_radius: Array
    index_first: NDArray[np.int64]
    index_count: NDArray[np.int64]
    horizon: Array
    triangles: NDArray[np.int64]
    error: Array
    meshes: MeshLevels
    mesh_fallbacks: MeshFallbacks

    @cached_property
    def area(self) -> Array:
        """Of the cylinders' outlines from the side, square metres."""
        return 2 * self.volumes.radius * (self.volumes.top - self.volumes.bottom)

    def nearest(self, asset: NDArray[np.integer], viewer: Array) -> Array:
        """How far (n,) viewers (n, 3) are from the cylinders that hold the assets `asset` (n,), in their frames."""
        return outside(viewer, self.centre[asset], self.half_height[asset], self.cylinder_radius[asset])


def place_objects(
    scene: "Scene", library: Library, store: AssetStore, wanted: Representation | None, which: slice = slice(None)
) -> Objects:
    """The scene's objects `which` as the renderer draws them, by the representation `wanted` where their asset has it:
    as the mesh, or a row for each part of the depth images, in its frame. `asset` holds the numbers of `store`."""
    objects = scene.objects.take(which)
    representation, first, count = _rows(objects, library, store, wanted)
    row = np.repeat(np.arange(len(objects), dtype=np.int32), count)
    number = first[row] + within_runs(count)
    position, rotation, scale = objects.position[row], objects.rotation[row], objects.scale[row]
    offset, turn = _placements(library, store)
    moved = np.flatnonzero(((offset != 0).any(1) | (turn[:, 3] != 1))[number])
    position[moved] += scale[moved, None] * rotate(rotation[moved], offset[number[moved]])
    rotation[moved] = multiply(rotation[moved], turn[number[moved]])
    return Objects(asset=number, position=position, rotation=rotation, scale=scale, representation=representation[row])


def placed_rows(
    scene: "Scene", library: Library, store: AssetStore, wanted: Representation | None, which: slice
) -> slice:
    """The rows among those of all objects that `place_objects` makes of the objects `which`, a run of numbers."""
    before, within = (
        int(_rows(scene.objects.take(run), library, store, wanted)[2].sum()) for run in (slice(0, which.start), which)
    )
    return slice(before, before + within)


def _rows(
    objects: Objects, library: Library, store: AssetStore, wanted: Representation | None
) -> tuple[NDArray[np.uint8], NDArray[np.int32], NDArray[np.int32]]:
    """How each object (n,) is drawn, the first number of `store` that shows it, and how many do."""
    representation = objects.representation.copy()
    if wanted is not None:
        has = library.has_mesh if wanted in MESHES else library.has_baked
        able = np.array([has(asset) for asset in range(len(library))], bool)
        representation[able[objects.asset]] = wanted
    imaged = ~np.isin(representation, MESHES)
    first, count = np.arange(len(library), dtype=np.int32), np.ones(len(library), np.int32)
    shown = np.unique(objects.asset[imaged]).tolist()
    library.cook_object([asset for asset in shown if not store.knows(asset)])
    for asset in shown:
        numbers = store.depth_numbers(asset)
        first[asset], count[asset] = numbers.start, len(numbers)
    return (
        representation,
        np.where(imaged, first[objects.asset], objects.asset),
        np.where(imaged, count[objects.asset], np.int32(1)),
    )


def _placements(library: Library, store: AssetStore) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Position (numbers, 3) and rotation (numbers, 4) of all that `store` numbers, in the asset's frame."""
    offset, turn = np.zeros((len(store), 3), np.float32), np.zeros((len(store), 4), np.float32)
    turn[:, 3] = 1
    for number in range(len(library), len(store)):
        baked = store.prepared(number).outline
        offset[number], turn[number] = baked.position, baked.rotation
    return offset, turn


def asset_table(objects: Objects, library: Library, store: AssetStore) -> AssetTable:
    """Rows of all that `store` numbers, described where `objects` use it; rows of others stay zero."""
    count = len(store)
    numbers = {name: np.zeros(count) for name in ("radius", "bottom", "top")}
    footprint = np.zeros((count, DIRECTIONS))
    has_side = np.zeros(count, bool)
    texel, centre = np.ones(count), np.zeros((count, 3))
    bounding_radius, half_height, cylinder_radius = np.zeros((3, count))
    levels = np.zeros(count, np.int64)
    thinned = np.isin(np.arange(count), objects.asset[objects.representation == Representation.MESH_LOD])
    details: dict[int, tuple[MeshLevel, ...]] = {}
    imaged: dict[int, CookedObject] = {}
    for number in np.unique(objects.asset).tolist():
        if number < len(library):
            mesh = library.mesh(number)
            if mesh is not None:
                centre[number], bounding_radius[number] = _mesh_sphere(mesh)
                details[number] = library.mesh_levels(number) if thinned[number] else (MeshLevel(mesh, 0.0),)
                half_height[number], cylinder_radius[number] = _mesh_cylinder(details[number], centre[number])
            continue
        imaged[number] = prepared = store.prepared(number)
        baked = prepared.outline
        for name, column in numbers.items():
            column[number] = getattr(baked.cylinder, name)
        footprint[number] = prepared.footprint
        has_side[number] = any(image.face is Face.SIDE for image in baked.images)
        texel[number] = square_texel(baked)
        levels[number] = len(prepared.error) - 1
        centre[number], half_height[number], cylinder_radius[number] = _bounding_cylinder(baked)
        bounding_radius[number] = np.hypot(half_height[number], cylinder_radius[number])
    index_first, index_count, horizon, error = _level_columns(count, imaged)
    triangles = index_count[:, :, :PIECES].sum(-1) // 3
    volumes = Volumes(**numbers, footprint=footprint, has_side=has_side)
    meshes = MeshLevels.empty(count)
    for number, some in details.items():
        meshes.add(number, some)
    mesh_fallbacks = _stand_ins(objects, library, store)
    standing = np.flatnonzero((mesh_fallbacks.mesh >= 0) & ~np.isin(mesh_fallbacks.mesh, list(details)))
    bounds = centre, bounding_radius, half_height, cylinder_radius
    held = (
        mesh_fallbacks.centre,
        np.hypot(mesh_fallbacks.half_height, mesh_fallbacks.cylinder_radius),
        mesh_fallbacks.half_height,
        mesh_fallbacks.cylinder_radius,
    )
    for column, of_asset in zip(bounds, held, strict=True):
        column[mesh_fallbacks.mesh[standing]] = of_asset[standing]
    return AssetTable(
        volumes=volumes,
        texel=texel,
        levels=levels,
        centre=centre,
        bounding_radius=bounding_radius,
        half_height=half_height,
        cylinder_radius=cylinder_radius,
        index_first=index_first,
        index_count=index_count,
        horizon=horizon,
        triangles=triangles,
        error=error,
        meshes=meshes,
        mesh_fallbacks=mesh_fallbacks,
    )


def _level_columns(
    count: int, imaged: dict[int, CookedObject]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """`AssetTable.index_first`, `index_count`, `horizon` and `error` of `count` numbers, of which
    these are depth objects."""
    most = max((len(each.error) for each in imaged.values()), default=1)
    index_first, index_count = np.zeros((2, count, most, RANGES), np.int64)
    horizon, error = np.full((count, most, PIECES, 4), np.inf), np.full((count, most), np.inf)
    for number, each in imaged.items():
        levels = len(each.error)
        index_first[number, :levels], index_count[number, :levels] = each.first, each.count
        horizon[number, :levels], error[number, :levels] = each.horizon, each.error
    return index_first, index_count, horizon, error


def _stand_ins(objects: Objects, library: Library, store: AssetStore) -> MeshFallbacks:
    """For those of `objects` that are depth images of a mesh, and of nothing else that is laid over it."""
    found = MeshFallbacks.empty(len(store))
    imaged = np.unique(objects.asset[objects.asset >= store.first_depth])
    for asset in np.unique([store.asset_of(number) for number in imaged.tolist()]).astype(int).tolist():
        numbers = store.depth_numbers(asset)
        outlines = [store.prepared(number).outline for number in numbers]
        if library.has_mesh(asset) and all(outline.meso is None for outline in outlines):
            found.add(asset, numbers, outlines)
    return found


def _bounding_cylinder(baked: BakedObject) -> tuple[NDArray[np.float64], float, float]:
    """Its centre (3,), half its height and its radius."""
    cylinder = baked.cylinder
    corner = min(cylinder.radius, float(np.hypot(cylinder.half_width, cylinder.half_depth)))
    return np.array([0, (cylinder.bottom + cylinder.top) / 2, 0]), cylinder.height / 2, corner


def _mesh_sphere(mesh: Mesh) -> tuple[NDArray[np.float64], float]:
    low, high = mesh.bounds
    middle = np.asarray((low + high) / 2, np.float64)
    return middle, float(np.linalg.norm(mesh.positions - middle, axis=1).max())


def _mesh_cylinder(levels: tuple[MeshLevel, ...], centre: NDArray[np.float64]) -> tuple[float, float]:
    """Half the height and the radius of the upright cylinder about `centre` (3,) that holds all levels: simplified
    surfaces may lie outside the mesh."""
    x, y, z = np.abs(np.concatenate([level.mesh.positions for level in levels]) - centre).T
    return float(y.max()), float(np.hypot(x, z).max())
