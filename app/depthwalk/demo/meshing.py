"""From a signed distance field to a mesh: sampling, marching cubes, decimation to a count, ambient occlusion."""

import fast_simplification
import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import zoom
from skimage.measure import marching_cubes

from depthwalk.demo.model import Model, boundary_edges, vertex_normals
from depthwalk.demo.sdf import Field

_COARSE = 4  # fine cells per coarse cell
_CHUNK = 1 << 17  # points per evaluation: the temporaries stay in the processor's cache


def polygonise(field: Field, lower: ArrayLike, upper: ArrayLike, cell: float) -> Model:
    """The zero surface of `field` within the box, sampled every `cell`; it is open where the solid leaves the box.

    The field is evaluated finely only near the surface, so it must not change faster than distance does (Lipschitz
    constant near 1).
    """
    lower = np.asarray(lower, np.float32)
    blocks = np.ceil((np.asarray(upper, np.float32) - lower) / (cell * _COARSE)).astype(int)
    coarse = _evaluate(field, np.argwhere(np.ones(blocks + 1, bool)), lower, cell * _COARSE).reshape(blocks + 1)
    fine_shape = blocks * _COARSE + 1
    volume = zoom(coarse, fine_shape / (blocks + 1), order=1, mode="nearest")
    near = np.abs(volume) < 3.0 * cell * _COARSE
    volume[near] = _evaluate(field, np.argwhere(near), lower, cell)
    vertices, faces, _, _ = marching_cubes(volume, 0.0, gradient_direction="descent")
    positions = (vertices * np.float32(cell) + lower).astype(np.float32)
    return tidy(Model(positions, faces.astype(np.int32), np.ones_like(positions)))


def _evaluate(field: Field, cells: NDArray[np.intp], lower: NDArray[np.float32], cell: float) -> NDArray[np.float32]:
    values = np.empty(len(cells), np.float32)
    for start in range(0, len(cells), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        values[chunk] = field(cells[chunk].astype(np.float32) * np.float32(cell) + lower)
    return values


def tidy(model: Model) -> Model:
    """Without zero-area faces' repeated corners and without unreferenced vertices."""
    f = model.faces
    keep = (f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0])
    used, faces = np.unique(f[keep], return_inverse=True)
    normals = None if model.normals is None else model.normals[used]
    return Model(model.positions[used], faces.reshape(-1, 3).astype(np.int32), model.colours[used], normals)


def simplified(model: Model, count: int) -> Model:
    """Decimated by quadric error to at most `count` faces; colours are lost (white)."""
    for target in (count, count - 8, count - 64, count - 512):
        positions, faces = fast_simplification.simplify(model.positions, model.faces, target_count=target, agg=4)
        result = tidy(Model(positions.astype(np.float32), faces.astype(np.int32), np.ones_like(positions, np.float32)))
        if len(result.faces) <= count:
            return result
    raise ValueError(f"decimation stopped at {len(result.faces)} faces, above {count}")


def with_exact_count(model: Model, count: int) -> Model:
    """`count` faces exactly: decimated to just below it, then edges are halved.

    Halving an inner edge adds two faces, halving a boundary edge one; a closed surface therefore has an even count.
    Raises ValueError where an odd number is missing and the surface has no boundary.
    """
    result = simplified(model, count)
    missing = count - len(result.faces)
    if missing % 2:
        rim = boundary_edges(result)
        if not len(rim):
            raise ValueError(f"{count} faces are impossible: the surface is closed and has {len(result.faces)}")
        result = halved(result, _longest(result, rim))
    for _ in range(missing // 2):
        result = halved(result, _longest(result, result.faces[:, [0, 1]], inner=True))
    return result


def _longest(model: Model, edges: NDArray[np.int32], inner: bool = False) -> tuple[int, int]:
    if inner:
        rim = boundary_edges(model)
        edges = edges[~np.isin(edges, rim).any(axis=1)]
    ends = model.positions[edges]
    a, b = edges[np.argmax(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1))]
    return int(a), int(b)


def halved(model: Model, edge: tuple[int, int]) -> Model:
    """With a vertex in the middle of the edge; each face at the edge becomes two."""
    a, b = edge
    touched = ((model.faces == a).sum(axis=1) + (model.faces == b).sum(axis=1)) == 2
    old = model.faces[touched]
    middle = len(model.positions)
    faces = np.concatenate([model.faces[~touched], np.where(old == a, middle, old), np.where(old == b, middle, old)])
    ends = np.array([a, b])
    return Model(
        np.vstack([model.positions, model.positions[ends].mean(axis=0, keepdims=True)]).astype(np.float32),
        faces.astype(np.int32),
        np.vstack([model.colours, model.colours[ends].mean(axis=0, keepdims=True)]).astype(np.float32),
    )


def ambient_occlusion(model: Model, reach: float, rays: int = 48, ground: bool = True) -> NDArray[np.float32]:
    """(V,) float32 in 0–1: the cosine-weighted share of directions that are free within `reach` metres.

    `ground` adds a floor at y = 0, so that feet and bases darken.
    """
    triangles = model.positions[model.faces]
    if ground:
        far = 50 * np.float32(np.abs(model.positions).max())
        corners = np.array([[-far, -1e-4, -far], [-far, -1e-4, far], [far, -1e-4, far], [far, -1e-4, -far]], np.float32)
        triangles = np.concatenate([triangles, corners[[[0, 1, 2], [0, 2, 3]]]])
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, np.ascontiguousarray(triangles))
    normals = vertex_normals(model)
    origins = model.positions + normals * np.float32(1e-3 * reach)
    free = np.zeros(len(origins), np.float32)
    for direction in _sphere(rays):
        towards = normals + direction  # a unit vector plus the normal: cosine-distributed about the normal
        towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-6)
        hit = scene.run(origins, towards.astype(np.float32), dists=np.full(len(origins), reach, np.float32), query="OCCLUDED")
        free += np.asarray(hit) < 0
    return free / np.float32(rays)


def _sphere(count: int) -> NDArray[np.float32]:
    """(count, 3) unit vectors, evenly spread (Fibonacci)."""
    k = np.arange(count) + 0.5
    y = 1 - 2 * k / count
    angle = k * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - y * y) * 0.999
    return np.stack([r * np.cos(angle), y * 0.999, r * np.sin(angle)], axis=1).astype(np.float32)
