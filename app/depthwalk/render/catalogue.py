"""The scene's objects and assets in the arrays that the plan works on."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.images import BakedObject, Face
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.render.assets import AssetStore, Library
from depthwalk.render.cases import PIECES, RANGES
from depthwalk.render.cells import within_runs
from depthwalk.render.footprint import DIRECTIONS
from depthwalk.render.frame_plan import AssetTable
from depthwalk.render.mesh_lod import MeshLevels
from depthwalk.render.planes import Volumes
from depthwalk.render.prepared import Prepared
from depthwalk.render.rotation import multiply, rotate
from depthwalk.render.stand_ins import StandIns
from depthwalk.scene.arrays import MESHES, Objects, Representation

if TYPE_CHECKING:
    from depthwalk.scene.scene import Scene


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
    return Objects(number, position, rotation, scale, representation[row])


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
    library.prepare([asset for asset in shown if not store.knows(asset)])
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
    reach, half_height, girth = np.zeros((3, count))
    levels = np.zeros(count, np.int64)
    thinned = np.isin(np.arange(count), objects.asset[objects.representation == Representation.MESH_LOD])
    details: dict[int, tuple[MeshLevel, ...]] = {}
    imaged: dict[int, Prepared] = {}
    for number in np.unique(objects.asset).tolist():
        if number < len(library):
            mesh = library.mesh(number)
            if mesh is not None:
                centre[number], reach[number] = _mesh_sphere(mesh)
                details[number] = library.mesh_levels(number) if thinned[number] else (MeshLevel(mesh, 0.0),)
                half_height[number], girth[number] = _mesh_cylinder(details[number], centre[number])
            continue
        imaged[number] = prepared = store.prepared(number)
        baked = prepared.outline
        for name, column in numbers.items():
            column[number] = getattr(baked.cylinder, name)
        footprint[number] = prepared.footprint
        has_side[number] = any(image.face is Face.SIDE for image in baked.images)
        texel[number] = square_texel(baked)
        levels[number] = len(prepared.error) - 1
        centre[number], half_height[number], girth[number] = _bounding_cylinder(baked)
        reach[number] = np.hypot(half_height[number], girth[number])
    index_first, index_count, horizon, error = _level_columns(count, imaged)
    triangles = index_count[:, :, :PIECES].sum(-1) // 3
    volumes = Volumes(**numbers, footprint=footprint, has_side=has_side)
    meshes = MeshLevels.empty(count)
    for number, some in details.items():
        meshes.add(number, some)
    stand_ins = _stand_ins(objects, library, store)
    standing = np.flatnonzero((stand_ins.mesh >= 0) & ~np.isin(stand_ins.mesh, list(details)))
    bounds = centre, reach, half_height, girth
    held = stand_ins.centre, np.hypot(stand_ins.half_height, stand_ins.girth), stand_ins.half_height, stand_ins.girth
    for column, of_asset in zip(bounds, held, strict=True):
        column[stand_ins.mesh[standing]] = of_asset[standing]
    return AssetTable(
        volumes=volumes,
        texel=texel,
        levels=levels,
        centre=centre,
        reach=reach,
        half_height=half_height,
        girth=girth,
        index_first=index_first,
        index_count=index_count,
        horizon=horizon,
        triangles=triangles,
        error=error,
        meshes=meshes,
        stand_ins=stand_ins,
    )


def _level_columns(
    count: int, imaged: dict[int, Prepared]
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


def _stand_ins(objects: Objects, library: Library, store: AssetStore) -> StandIns:
    """For those of `objects` that are depth images of a mesh, and of nothing else that is laid over it."""
    found = StandIns.empty(len(store))
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
