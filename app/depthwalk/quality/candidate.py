"""Judge whether an object suits depth images at all, from its mesh and from how much of it the images hold."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from depthwalk.bake.coverage import measure_left_out
from depthwalk.bake.depth import Depth, deep_enough
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import BakedObject, Face
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import probed_depth
from depthwalk.bake.placement import Placement
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.sampling import sample_surface
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.geometry.quaternions import rotate
from depthwalk.geometry.triangles import face_normals
from depthwalk.ingest.mesh import Mesh, positions_only
from depthwalk.quality.views import SPHERE, away, bounding_sphere
from depthwalk.types import Array

SAMPLES = 4000  # points on the surface
LEAST_PART = 0.001  # of the surface; smaller parts are not counted
LOW_COVERAGE, MANY_PARTS, MUCH_THIN = 0.98, 16, 0.02  # least `coverage`, most `parts` and `thin` without a warning
FOLIAGE = 0.15  # part of the surface that is thin, from which the other criteria do not count if silhouettes are wrong
MUCH_DEEPER = 1.0  # texels², of the mean footprint


@dataclass(frozen=True)
class DeeperLayers:
    """Compare how much of a surface the present number of layers holds with what enough layers would hold.

    Attributes
    ----------
    now
        The result with the present layers.
    then
        The result with the smallest number of layers beyond which more gain next to nothing.
    """

    now: Depth
    then: Depth


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Describe how well an object suits depth images.

    Attributes
    ----------
    coverage
        Part of the surface visible from the 42 views, 0 to 1, that has a triangle of the depth images within the width
        of a texel.
    thin
        Part of the same surface, 0 to 1, with another surface less than a texel behind it.
    parts
        Number of connected pieces of at least `LEAST_PART` of the surface each.
    texel
        Side of the largest texel, metres.
    left_out
        Part of the visible surface that no depth image holds, 0 to 1, see `measure_left_out`.
    deeper
        The gain from more layers; None if that is less than `MUCH_DEEPER`.
    """

    coverage: float
    thin: float
    parts: int
    texel: float
    left_out: float = 0.0
    deeper: DeeperLayers | None = None


def examine(mesh: Mesh, model: BakedModel, params: ModelParams) -> Candidate:
    """Judge a mesh and its depth images by `SAMPLES` points spread evenly over its surface.

    Parameters
    ----------
    mesh
        The mesh, asset frame, metres.
    model
        The depth images of the mesh.
    params
        How `model` was baked.

    Returns
    -------
    Candidate
        How well the mesh suits depth images.
    """
    texel = max(map(_texel, model.parts))
    caster = RayCaster(mesh)
    points, normals = sample_surface(mesh, SAMPLES)
    seen = _visible(mesh, caster, points)
    if not seen.any():
        return Candidate(coverage=1.0, thin=0.0, parts=count_parts(mesh), texel=texel)
    points, normals = points[seen], normals[seen]
    held = RayCaster(_grid_mesh(model)).first(points + texel * normals, -normals).distance <= 2 * texel
    skin = 1e-5 * bounding_sphere(mesh).radius
    behind = caster.first(points - skin * normals, -normals)
    thin = behind.flipped & (behind.distance < texel)
    return Candidate(
        coverage=float(held.mean()),
        thin=float(thin.mean()),
        parts=count_parts(mesh),
        texel=texel,
        left_out=measure_left_out(mesh, model),
        deeper=_deeper(mesh, model, params),
    )


def warnings(candidate: Candidate, outlines: bool) -> list[str]:
    """Return why an object is poorly suited to depth images.

    Parameters
    ----------
    candidate
        The findings about the object.
    outlines
        Whether the object's silhouettes were found to be right. If so, it is not considered foliage, even if it is as
        thin, as a sheet that lies on something is.

    Returns
    -------
    list[str]
        One line for each reason; empty for a suitable object.
    """
    lines = []
    foliage = candidate.thin > FOLIAGE and not outlines
    if foliage:
        lines.append(
            f"foliage: {100 * candidate.thin:.1f} % of its surface is thinner than a texel "
            f"({1000 * candidate.texel:.3g} mm), and most of its pixels are edges; draw it as its mesh"
        )
    if candidate.coverage < LOW_COVERAGE:
        missing = 100 * (1 - candidate.coverage)
        lines.append(
            f"{missing:.1f} % of its visible surface is farther than a texel from all triangles of the depth images: "
            "more layers, or a finer resolution"
        )
    if candidate.deeper is not None:
        now, then = candidate.deeper.now, candidate.deeper.then
        lines.append(
            f"layers: {then.layers}, or auto: {100 * then.missing:.1f} % of its visible surface then lie too deep, not "
            f"{100 * now.missing:.1f}, and a texel covers {then.footprint:.1f} texels² of it on the mean, not "
            f"{now.footprint:.1f}"
        )
    if candidate.thin > MUCH_THIN and not foliage:
        lines.append(
            f"{100 * candidate.thin:.1f} % of its surface is thinner than a texel ({1000 * candidate.texel:.3g} mm): "
            "a finer resolution"
        )
    if candidate.parts > MANY_PARTS:
        lines.append(f"it has {candidate.parts} separate parts, which hide each other: more layers, or several objects")
    return lines


def count_parts(mesh: Mesh) -> int:
    """Return how many connected pieces `mesh` has, each of at least `LEAST_PART` of its surface's area.

    Triangles are connected if they share the position of a vertex.
    """
    _, welded = np.unique(mesh.positions, axis=0, return_inverse=True)
    faces = welded.reshape(-1)[mesh.faces]
    first, second = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    vertices = int(welded.max()) + 1
    graph = coo_array((np.ones(len(first), np.int8), (first, second)), (vertices, vertices))
    count, part = connected_components(graph, directed=False)
    _, areas = face_normals(mesh.positions[mesh.faces].astype(np.float64))
    share = np.bincount(part[faces[:, 0]], weights=areas, minlength=count) / areas.sum()
    return int((share >= LEAST_PART).sum())


def _deeper(mesh: Mesh, model: BakedModel, params: ModelParams) -> DeeperLayers | None:
    """Return the gain from more layers for one object with counted layers; None for several parts, which differ."""
    if params.layers == "auto" or params.by_six_views or len(model.parts) > 1:
        return None
    part = model.parts[0]
    placement = Placement(position=np.asarray(part.position), rotation=Rotation.from_quat(part.rotation))
    depths = probed_depth(mesh, placement, params)
    now, then = depths[params.layers - 1], deep_enough(depths)
    return DeeperLayers(now, then) if now.footprint - then.footprint >= MUCH_DEEPER else None


def _visible(mesh: Mesh, caster: RayCaster, points: Array) -> NDArray[np.bool_]:
    """Return which points (n, 3) of the surface are visible from at least one of the 42 views."""
    sphere = bounding_sphere(mesh)
    viewers = np.asarray(sphere.centre) + 4 * sphere.radius * np.array([away(viewpoint) for viewpoint in SPHERE])
    ray = (points[None] - viewers[:, None]).reshape(-1, 3)
    length = np.linalg.norm(ray, axis=1)
    met = caster.first(np.repeat(viewers, len(points), axis=0), ray / length[:, None]).distance
    return np.asarray((met >= length - 1e-4 * sphere.radius).reshape(len(viewers), -1).any(0))


def _texel(baked: BakedObject) -> float:
    image = next((image for image in baked.images if image.face is Face.SIDE), baked.images[0])
    return FaceGrid.of(baked.cylinder, image).longest_texel


def _grid_mesh(model: BakedModel) -> Mesh:
    """Return the surface of all depth images at full resolution as one mesh, in the asset's frame."""
    positions, faces = zip(*map(_grid_triangles, model.parts), strict=True)
    first = np.cumsum([0, *map(len, positions)])
    every = np.concatenate([part + start for part, start in zip(faces, first, strict=False)])
    return positions_only(np.concatenate(positions), every)


def _grid_triangles(baked: BakedObject) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return positions (v, 3), in the asset's frame, and triangles (t, 3) of one object."""
    grids = build_grid_lods(baked)
    turned = rotate(np.asarray(baked.rotation), grids.positions) + np.asarray(baked.position)
    return turned.astype(np.float32), grids.drawn(level=0)
