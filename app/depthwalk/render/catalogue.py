"""The scene's objects and assets in the arrays that the plan works on."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, Face, square_texel
from depthwalk.ingest.mesh import Mesh
from depthwalk.render.assets import AssetStore, Library
from depthwalk.render.grids import RUNS_PER_CASE
from depthwalk.render.lod import Case
from depthwalk.render.plan import AssetTable
from depthwalk.render.planes import Volumes
from depthwalk.render.rotation import multiply, rotate
from depthwalk.scene.arrays import Objects, Representation

if TYPE_CHECKING:
    from depthwalk.scene.scene import Scene


def place_objects(scene: "Scene", library: Library, wanted: Representation | None) -> Objects:
    """The scene's objects, by the representation `wanted` where their asset has it, placed as the renderer draws them:
    by the frame of their depth images, or of their mesh."""
    objects = scene.objects
    representation = objects.representation.copy()
    if wanted is not None:
        has = library.has_mesh if wanted is Representation.MESH else library.has_baked
        able = np.array([has(asset) for asset in range(len(library))], bool)
        representation[able[objects.asset]] = wanted
    position, rotation = objects.position.copy(), objects.rotation.copy()
    imaged = np.flatnonzero(representation != Representation.MESH)
    for asset in np.unique(objects.asset[imaged]).tolist():
        baked = library.baked(asset)
        if baked is not None and (any(baked.position) or baked.rotation != (0.0, 0.0, 0.0, 1.0)):
            mine = imaged[objects.asset[imaged] == asset]
            offset = rotate(rotation[mine], np.asarray(baked.position, np.float32))
            position[mine] += objects.scale[mine, None] * offset
            rotation[mine] = multiply(rotation[mine], np.asarray(baked.rotation, np.float32))
    return Objects(objects.asset, position, rotation, objects.scale, representation)


def asset_table(objects: Objects, library: Library, store: AssetStore) -> AssetTable:
    """Rows of the assets that `objects` use, loaded for it; rows of others stay zero."""
    count = len(library)
    numbers = {name: np.zeros(count) for name in ("radius", "bottom", "top", "half_width", "half_depth")}
    has_side = np.zeros(count, bool)
    texel, reach, centre = np.ones(count), np.zeros(count), np.zeros((count, 3))
    levels = np.zeros(count, np.int64)
    runs: dict[int, tuple[NDArray[np.int64], NDArray[np.int64]]] = {}
    imaged = objects.representation != Representation.MESH
    for asset in np.unique(objects.asset[imaged]).tolist():
        drawn = store.depth_object(asset)
        baked = drawn.baked
        for name, column in numbers.items():
            column[asset] = getattr(baked.cylinder, name)
        has_side[asset] = any(image.face is Face.SIDE for image in baked.images)
        texel[asset] = square_texel(baked)
        levels[asset] = baked.steps - 1
        runs[asset] = drawn.first, drawn.count
        centre[asset], reach[asset] = _bounding_sphere(baked)
    for asset in np.unique(objects.asset[~imaged]).tolist():
        mesh = library.mesh(asset)
        if mesh is not None and asset not in runs:
            centre[asset], reach[asset] = _mesh_sphere(mesh)
    most = max((first.shape[0] for first, _ in runs.values()), default=1)
    index_first = np.zeros((count, most, len(Case), RUNS_PER_CASE), np.int64)
    index_count = np.zeros_like(index_first)
    for asset, (first, length) in runs.items():
        index_first[asset, : len(first)], index_count[asset, : len(length)] = first, length
    triangles = index_count[:, :, Case.ALL].sum(-1) // 3
    volumes = Volumes(**numbers, has_side=has_side)
    return AssetTable(volumes, texel, levels, centre, reach, index_first, index_count, triangles)


def _bounding_sphere(baked: BakedObject) -> tuple[NDArray[np.float64], float]:
    cylinder = baked.cylinder
    corner = min(cylinder.radius, float(np.hypot(cylinder.half_width, cylinder.half_depth)))
    return np.array([0, (cylinder.bottom + cylinder.top) / 2, 0]), float(np.hypot(corner, cylinder.height / 2))


def _mesh_sphere(mesh: Mesh) -> tuple[NDArray[np.float64], float]:
    low, high = mesh.bounds
    middle = np.asarray((low + high) / 2, np.float64)
    return middle, float(np.linalg.norm(mesh.positions - middle, axis=1).max())
