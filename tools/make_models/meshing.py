"""Make a mesh of a signed distance field, and compute how much of the sky its vertices see."""

from dataclasses import replace

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import zoom
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from tools.make_models.model import Model, vertex_normals
from tools.make_models.sdf import Field

try:
    from skimage.measure import marching_cubes
except ImportError:
    raise SystemExit("scikit-image is not installed; pip install -e '.[models]' brings it") from None

_COARSE = 4  # fine cells per coarse cell
_CHUNK = 1 << 17  # points per evaluation: the temporaries stay in the processor's cache


def polygonise(field: Field, lower: ArrayLike, upper: ArrayLike, cell: float) -> Model:
    """Return the surface on which a signed distance field is zero, by marching cubes (Lorensen and Cline 1987).

    The field is evaluated on a coarse lattice, then with half its spacing near the surface, then finely very near it.
    So the field must not change faster than distance does (Lipschitz constant near 1).

    Parameters
    ----------
    field
        The field.
    lower, upper
        (3,) corners of the box in which the surface is sought, in the unit of the field. Where the solid leaves the
        box, the surface is open.
    cell
        Edge of a cube, in the same unit.

    Returns
    -------
    Model
        The largest connected part of the surface, white, in the same unit.
    """
    lower = np.asarray(lower, np.float32)
    blocks = np.ceil((np.asarray(upper, np.float32) - lower) / (cell * _COARSE)).astype(int)
    coarse = _evaluate(field, np.argwhere(np.ones(blocks + 1, bool)), lower, cell * _COARSE).reshape(blocks + 1)
    fine_shape = blocks * _COARSE + 1
    volume = zoom(coarse, fine_shape / (blocks + 1), order=1, mode="nearest")
    even = volume[::2, ::2, ::2]  # a view: what is written here is in the volume
    near = np.abs(even) < 3.0 * cell * _COARSE
    even[near] = _evaluate(field, np.argwhere(near), lower, 2 * cell)
    close = np.abs(zoom(even, np.array(fine_shape) / even.shape, order=1, mode="nearest")) < 4.0 * cell
    volume[close] = _evaluate(field, np.argwhere(close), lower, cell)
    clearance = np.float32(0.03 * cell)  # a surface through a lattice point would give faces without area
    volume = np.where(np.abs(volume) < clearance, np.copysign(clearance, volume), volume)
    vertices, faces, _, _ = marching_cubes(volume, 0.0, gradient_direction="descent")
    positions = (vertices * np.float32(cell) + lower).astype(np.float32)
    return largest_part(Model(positions, faces.astype(np.int32), np.ones_like(positions)))


def _evaluate(field: Field, cells: NDArray[np.intp], lower: NDArray[np.float32], cell: float) -> NDArray[np.float32]:
    values = np.empty(len(cells), np.float32)
    for start in range(0, len(cells), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        values[chunk] = field(cells[chunk].astype(np.float32) * np.float32(cell) + lower)
    return values


def tidy(model: Model) -> Model:
    """Return `model` without faces that repeat a corner, and without vertices that no face uses."""
    f = model.faces
    keep = (f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0])
    used, faces = np.unique(f[keep], return_inverse=True)
    normals = None if model.normals is None else model.normals[used]
    return Model(model.positions[used], faces.reshape(-1, 3).astype(np.int32), model.colours[used], normals)


def largest_part(model: Model) -> Model:
    """Return the connected part of `model` with the most vertices, without crumbs and enclosed hollows."""
    a, b = model.faces[:, [0, 1, 2]].ravel(), model.faces[:, [1, 2, 0]].ravel()
    count = len(model.positions)
    _, part = connected_components(coo_array((np.ones(len(a), bool), (a, b)), (count, count)), directed=False)
    keep = part[model.faces[:, 0]] == np.bincount(part).argmax()
    return tidy(replace(model, faces=model.faces[keep]))


def ambient_occlusion(
    model: Model, bounding_radius: float, rays: int = 48, ground: bool = True, at: NDArray[np.integer] | None = None
) -> NDArray[np.float32]:
    """Return for each vertex the part of the directions above the surface that no near surface blocks.

    Directions count by the cosine of their angle to the normal, as light from everywhere does.

    Parameters
    ----------
    model
        The model that light falls on, and that blocks light.
    bounding_radius
        Distance within which surfaces block light, in the unit of the model.
    rays
        Number of rays per vertex.
    ground
        Whether a floor at y = 0 blocks light, so that feet and bases darken.
    at
        (n,) numbers of the vertices; None is all.

    Returns
    -------
    NDArray[np.float32]
        (n,) parts, 0 to 1.
    """
    triangles = model.positions[model.faces]
    if ground:
        far, low = 50 * float(np.abs(model.positions).max()), -3e-3 * bounding_radius  # below the rays' origins
        corners = np.array([[-far, low, -far], [-far, low, far], [far, low, far], [far, low, -far]], np.float32)
        triangles = np.concatenate([triangles, corners[[[0, 1, 2], [0, 2, 3]]]])
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, np.ascontiguousarray(triangles))
    wanted = slice(None) if at is None else at
    normals = vertex_normals(model)[wanted]
    origins = model.positions[wanted] + normals * np.float32(1e-3 * bounding_radius)
    free = np.zeros(len(origins), np.float32)
    for direction in _sphere(rays):
        towards = normals + direction  # a unit vector plus the normal: cosine-distributed about the normal
        towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-6)
        hit = scene.run(
            origins,
            towards.astype(np.float32),
            dists=np.full(len(origins), bounding_radius, np.float32),
            query="OCCLUDED",
        )
        free += np.asarray(hit) < 0
    return free / np.float32(rays)


def interpolated_occlusion(
    model: Model, bounding_radius: float, rays: int = 48, ground: bool = True, samples: int = 60_000
) -> NDArray[np.float32]:
    """Return `ambient_occlusion` of all vertices (V,), computed at some of them and interpolated between.

    Most of the time goes to the rays, and on a mesh of a million triangles the values change little from vertex to
    vertex.

    Parameters
    ----------
    model, bounding_radius, rays, ground
        The values that `ambient_occlusion` takes.
    samples
        Number of vertices at which rays are cast; models with fewer are computed everywhere.

    Returns
    -------
    NDArray[np.float32]
        (V,) parts, 0 to 1.
    """
    count = len(model.positions)
    if count <= samples:
        return ambient_occlusion(model, bounding_radius, rays, ground)
    chosen = np.random.default_rng(count).choice(count, samples, replace=False)
    free = ambient_occlusion(model, bounding_radius, rays, ground, chosen)
    normals = vertex_normals(model)
    reach = 0.1 * bounding_radius  # a turn by 90° counts as this many metres
    distance, near = cKDTree(np.hstack([model.positions[chosen], reach * normals[chosen]])).query(
        np.hstack([model.positions, reach * normals]), k=4, workers=1
    )
    weight = 1 / (distance**2 + (0.02 * reach) ** 2)
    total: NDArray[np.float64] = (weight * free[near]).sum(axis=1) / weight.sum(axis=1)
    return total.astype(np.float32)


def _sphere(count: int) -> NDArray[np.float32]:
    """Return (count, 3) vectors of almost unit length, evenly spread (Fibonacci)."""
    k = np.arange(count) + 0.5
    y = 1 - 2 * k / count
    angle = k * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - y * y) * 0.999
    return np.stack([r * np.cos(angle), y * 0.999, r * np.sin(angle)], axis=1).astype(np.float32)
