"""Whether an object suits depth images at all, judged from its mesh and what of it the images hold."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from depthwalk.bake.images import BakedObject, Face, texel_size
from depthwalk.bake.raycast import RayCaster
from depthwalk.ingest.mesh import Mesh
from depthwalk.quality.views import SPHERE, away, bounding_sphere
from depthwalk.render.grids import build_grids
from depthwalk.render.lod import Case
from depthwalk.render.rotation import rotate

SAMPLES = 4000
LEAST_PART = 0.001  # of the surface; smaller parts are not counted
LOW_COVERAGE, MANY_PARTS, MUCH_THIN = 0.98, 16, 0.02

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Candidate:
    """How an object suits depth images. coverage: the part of its surface, as seen from the 42 views, that some
    depth-image triangle comes within a texel of; thin: the part of it that has another surface less than a texel
    behind; parts: connected pieces of at least `LEAST_PART` of the surface; texel: metres."""

    coverage: float
    thin: float
    parts: int
    texel: float


def examine(mesh: Mesh, baked: BakedObject) -> Candidate:
    """Judges `mesh` and the depth images made of it, by `SAMPLES` points spread evenly over its surface."""
    image = next((image for image in baked.images if image.face is Face.SIDE), baked.images[0])
    texel = max(texel_size(baked.cylinder, image.face, (image.depth.shape[0], image.depth.shape[1])))
    caster = RayCaster(mesh)
    points, normals = sample_surface(mesh, SAMPLES)
    seen = _visible(mesh, caster, points)
    if not seen.any():
        return Candidate(1.0, 0.0, count_parts(mesh), texel)
    points, normals = points[seen], normals[seen]
    held = RayCaster(_grid_mesh(baked)).first(points + texel * normals, -normals).distance <= 2 * texel
    skin = 1e-5 * bounding_sphere(mesh).radius
    behind = caster.first(points - skin * normals, -normals)
    thin = behind.flipped & (behind.distance < texel)
    return Candidate(float(held.mean()), float(thin.mean()), count_parts(mesh), texel)


def warnings(candidate: Candidate) -> list[str]:
    """Why the object is a poor candidate, a line per reason; none for a good one."""
    lines = []
    if candidate.coverage < LOW_COVERAGE:
        missing = 100 * (1 - candidate.coverage)
        lines.append(f"{missing:.1f} % of its visible surface is in no depth image: more layers, or a finer resolution")
    if candidate.thin > MUCH_THIN:
        lines.append(
            f"{100 * candidate.thin:.1f} % of its surface is thinner than a texel ({1000 * candidate.texel:.3g} mm): "
            "a finer resolution"
        )
    if candidate.parts > MANY_PARTS:
        lines.append(f"it has {candidate.parts} separate parts, which hide each other: more layers, or several objects")
    return lines


def sample_surface(mesh: Mesh, count: int) -> tuple[Array, Array]:
    """Points (count, 3) spread evenly over the surface, always the same, and its unit normals (count, 3) there."""
    corners = mesh.positions[mesh.faces].astype(np.float64)
    normals, areas = _face_normals(corners)
    random = np.random.default_rng(0)
    ends = np.cumsum(areas)
    face = np.searchsorted(ends, (np.arange(count) + random.random(count)) / count * ends[-1]).clip(0, len(ends) - 1)
    u, v = random.random((2, count))
    over = u + v > 1
    u, v = np.where(over, 1 - u, u)[:, None], np.where(over, 1 - v, v)[:, None]
    a, b, c = corners[face].transpose(1, 0, 2)
    return a + u * (b - a) + v * (c - a), normals[face]


def count_parts(mesh: Mesh) -> int:
    """Pieces that share no vertex position with another, of at least `LEAST_PART` of the surface."""
    _, welded = np.unique(mesh.positions, axis=0, return_inverse=True)
    faces = welded.reshape(-1)[mesh.faces]
    first, second = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    vertices = int(welded.max()) + 1
    graph = coo_array((np.ones(len(first), np.int8), (first, second)), (vertices, vertices))
    count, part = connected_components(graph, directed=False)
    _, areas = _face_normals(mesh.positions[mesh.faces].astype(np.float64))
    share = np.bincount(part[faces[:, 0]], weights=areas, minlength=count) / areas.sum()
    return int((share >= LEAST_PART).sum())


def _face_normals(corners: Array) -> tuple[Array, Array]:
    """Unit normals (n, 3) and areas (n,) of triangles (n, 3, 3)."""
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(cross, axis=1)
    return cross / np.maximum(doubled, 1e-300)[:, None], doubled / 2


def _visible(mesh: Mesh, caster: RayCaster, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3) of the surface at least one of the 42 views sees."""
    sphere = bounding_sphere(mesh)
    viewers = np.asarray(sphere.centre) + 4 * sphere.radius * np.stack([away(viewpoint) for viewpoint in SPHERE])
    ray = (points[None] - viewers[:, None]).reshape(-1, 3)
    length = np.linalg.norm(ray, axis=1)
    met = caster.first(np.repeat(viewers, len(points), axis=0), ray / length[:, None]).distance
    return (met >= length - 1e-4 * sphere.radius).reshape(len(viewers), -1).any(0)


def _grid_mesh(baked: BakedObject) -> Mesh:
    """The triangles of all depth images at full resolution, in the asset's frame; nothing but shape."""
    grids = build_grids(baked)
    runs = zip(grids.first[0, Case.ALL].tolist(), grids.count[0, Case.ALL].tolist(), strict=True)
    faces = np.concatenate([grids.indices[first : first + count] for first, count in runs]).reshape(-1, 3)
    inside = grids.box_low + grids.vertices[:, :3] / np.float32(65535) * grids.box_size
    turned = rotate(np.asarray(baked.rotation), inside) + np.asarray(baked.position)
    none = np.zeros((0, 3), np.float32)
    return Mesh(turned.astype(np.float32), none, none.astype(np.uint8), none, faces.astype(np.int32), (), ())
