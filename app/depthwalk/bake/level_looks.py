"""Fit normals and colours of simplified meshes to their original.

A large triangle stands for many vertices of the original, so copying the normal of the nearest one is not enough.
Normals and colours are fitted by least squares instead: they differ least from the original wherever shaders
interpolate them. Far away, where a pixel shows many of the original's triangles, such a level has their average look,
and so less aliasing.
"""

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.soa import StructOfArrays
from depthwalk.geometry.triangles import face_normals, sample_batches
from depthwalk.ingest.mesh import Mesh
from depthwalk.types import Array, Ints

# A level with edges of one metre whose normals or colours are off by 1 looks as wrong as one whose surface is off by
# this many metres: within a pixel of either, pictures of five models are as good as their depth images
# (docs/measurements.md).
LOOKS_WRONG = 8.0
_MOST_SAMPLES = 100_000  # of a mesh: eight per vertex for a level of 25,000 triangles
_SAMPLES_PER_TRIANGLE = 8
STAYS = 0.05  # weight of a vertex's initial normal and colour, where a sample has 1: for vertices with few samples
# How a `cKDTree` of samples spread evenly is built: in half the time, and hardly slower to search.
OF_SAMPLES: Final[dict[str, Any]] = {"leafsize": 32, "compact_nodes": False, "balanced_tree": False}
SHORT = 0.1  # length below which a fitted normal is meaningless, as where both sides of a leaf are merged


@dataclass(frozen=True, kw_only=True)
class SurfaceSamples(StructOfArrays):
    """Hold the appearance of a mesh at n points spread evenly over it.

    Attributes
    ----------
    place
        (n, 4) positions, metres, with the chart of each along the fourth axis, as in `chart_places`.
    facing
        (n, 3) unit normals of the triangles.
    normal
        (n, 3) unit normals as shaders interpolate them.
    colour
        (n, 3) sRGB, 0 to 255.
    """

    place: Array
    facing: Array
    normal: Array
    colour: Array


def sample_looks(mesh: Mesh, chart: Ints, apart: float) -> SurfaceSamples:
    """Spread samples over a mesh.

    Parameters
    ----------
    mesh
        The mesh.
    chart
        (V,) the connected piece of surface that each vertex belongs to.
    apart
        Distance between charts along the fourth axis of places, metres.
    """
    corners = mesh.positions[mesh.faces].astype(np.float64)
    normals, areas = face_normals(corners)
    count = min(_SAMPLES_PER_TRIANGLE * len(corners), _MOST_SAMPLES)
    points, triangles = (np.concatenate(parts) for parts in zip(*sample_batches(corners, areas, count), strict=True))
    weights, vertices = barycentric(points, corners[triangles]), mesh.faces[triangles]
    normal = _interpolated(weights, mesh.normals[vertices])
    return SurfaceSamples(
        place=chart_places(points, chart[vertices[:, 0]], apart),
        facing=normals[triangles],
        normal=unit(normal),
        colour=_interpolated(weights, mesh.colours[vertices]),
    )


def chart_places(points: Array, chart: Ints, apart: float) -> NDArray[np.float64]:
    """Return points (n, 3) with their charts (n,) along a fourth axis, `apart` metres from each other: (n, 4)."""
    return np.column_stack([points, apart * chart])


def fitted_looks(level: Mesh, samples: SurfaceSamples, chart: Ints, apart: float) -> tuple[Mesh, float]:
    """Fit the normals and colours of a simplified mesh to samples of the original; return the mesh and the residual.

    Solves least squares over the vertices for the differences at those points of the level that are nearest to the
    samples. A sample counts if its nearest point is on the same chart and the same side of the surface.

    Parameters
    ----------
    level
        The simplified mesh, with normals and colours of nearby vertices.
    samples
        The appearance of the original.
    chart
        (v,) the chart of the original that each vertex of the level takes its appearance from.
    apart
        Distance between charts, as in `samples`.

    Returns
    -------
    tuple
        The mesh, and the root mean square difference of its unit normals from those of the samples, or of its colours,
        0 to 1, whichever is larger. A smooth pot with a pattern has coarse levels with good normals and no pattern.
    """
    from scipy.sparse import coo_array, diags_array
    from scipy.sparse.linalg import splu

    triangle, weights, used = _nearest_points(level, samples, chart, apart)
    vertices = level.faces[triangle]
    count, total = len(vertices), len(level.positions)
    rows = np.repeat(np.arange(count), 3)
    at = coo_array((weights.ravel(), (rows, vertices.ravel())), (count, total)).tocsr()
    before = np.column_stack([level.normals, level.colours]).astype(np.float64)
    wanted = np.column_stack([samples.normal[used], samples.colour[used]])
    normal_equations = (at.T @ at + diags_array(np.full(total, STAYS))).tocsc()
    fitted = splu(normal_equations, permc_spec="MMD_AT_PLUS_A").solve(at.T @ wanted + STAYS * before)
    length = np.linalg.norm(fitted[:, :3], axis=1, keepdims=True)
    normals = np.where(length > SHORT, fitted[:, :3] / np.maximum(length, SHORT), level.normals)
    colours = np.clip(np.round(fitted[:, 3:]), 0, 255).astype(np.uint8)
    shown = unit(_interpolated(weights, normals[vertices]))
    off = (_interpolated(weights, colours[vertices]) - samples.colour[used]) / 255
    left = max(_root_mean_square(shown - samples.normal[used]), _root_mean_square(off)) if count else 2.0
    return replace(level, normals=normals.astype(np.float32), colours=colours), left


def _nearest_points(
    level: Mesh, samples: SurfaceSamples, chart: Ints, apart: float
) -> tuple[Ints, NDArray[np.float64], Ints]:
    """Return the points of a level nearest to samples: triangles (k,), weights (k, 3) and rows (k,) of the samples.

    As many points are spread over the level, and the nearest of them determines the triangle.
    """
    from scipy.spatial import cKDTree

    corners = level.positions[level.faces].astype(np.float64)
    normals, areas = face_normals(corners)
    found = zip(*sample_batches(corners, areas, len(samples.place)), strict=True)
    points, owner = (np.concatenate(parts) for parts in found)
    places = chart_places(points, chart[level.faces[owner, 0]], apart)
    away, nearest = cKDTree(places, **OF_SAMPLES).query(samples.place)
    triangle = owner[nearest]
    same_side = np.einsum("ij,ij->i", normals[triangle], samples.facing) > 0
    used = np.flatnonzero(same_side & (away < apart / 2))
    triangle = triangle[used]
    weights = np.maximum(barycentric(samples.place[used, :3], corners[triangle]), 0)
    return triangle, weights / weights.sum(1, keepdims=True), used


def barycentric(points: Array, corners: Array) -> NDArray[np.float64]:
    """Return the barycentric coordinates (n, 3) of points (n, 3) in triangles (n, 3, 3), metres.

    Points beside a triangle get negative ones; for a triangle without area the result is its first corner.
    """
    a, b, c = corners.transpose(1, 0, 2)
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = (np.einsum("ij,ij->i", *pair) for pair in ((u, u), (u, v), (v, v)))
    uw, vw = np.einsum("ij,ij->i", u, w), np.einsum("ij,ij->i", v, w)
    doubled = uu * vv - uv * uv
    along = np.stack([vv * uw - uv * vw, uu * vw - uv * uw], -1)
    along = np.divide(along, doubled[:, None], out=np.zeros_like(along), where=doubled[:, None] > 0)
    return np.column_stack([1 - along.sum(1), along])


def _root_mean_square(vectors: Array) -> float:
    """Return the root mean square length of vectors (n, 3)."""
    return float(np.sqrt(np.mean(np.sum(vectors**2, 1))))


def unit(vectors: Array) -> Array:
    """Return vectors (n, 3) normalised to unit length; zero vectors stay 0."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9))


def _interpolated(weights: Array, values: NDArray[np.generic]) -> NDArray[np.float64]:
    """Return values (n, 3, k) at the corners of n triangles, interpolated by `weights` (n, 3): (n, k)."""
    return np.asarray(np.einsum("ij,ijk->ik", weights, values.astype(np.float64)))
