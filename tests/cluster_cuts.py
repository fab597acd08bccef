"""Surfaces that mesh clusters are built of, and what is drawn of those: cuts through their levels."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from depthwalk.cook import kernels
from depthwalk.cook.cluster_builder import build_clusters
from depthwalk.cook.cluster_error import nearest_shares, squared_distances
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.geometry.triangles import row_ids, sample_triangles
from depthwalk.ingest.mesh import Mesh
from depthwalk.render.lod.cluster_selection import select_clusters
from depthwalk.types import Array, Ints, Rows
from shapes import shared, sphere

Point = tuple[float, float, float]


def seamless(mesh: Mesh) -> Mesh:
    """With the two ends of the seam at exactly the same places."""
    return replace(mesh, positions=np.round(mesh.positions, 5))


def bumpy(columns: int = 64, rows: int = 32) -> Mesh:
    """A closed ball with bumps, which is flat nowhere."""
    ball = sphere(1.0, columns, rows)
    around = ball.positions - [0, 1, 0]
    out = 1 + 0.1 * np.sin(9 * around[:, [0]]) * np.cos(7 * around[:, [2]])
    return seamless(replace(ball, positions=(around * out + [0, 1.2, 0]).astype(np.float32)))


def numpy_clusters(mesh: Mesh) -> MeshClusters:
    """The clusters of a mesh that NumPy builds, loops or not; of an equal one as before, those."""
    return shared(_built_by_numpy, mesh)


def _built_by_numpy(mesh: Mesh) -> MeshClusters:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernels, "_loops", None)
        patch.setattr(kernels, "load_for", lambda triangles: None)
        return build_clusters(mesh)


def triangles_of(clusters: MeshClusters, chosen: Rows) -> Rows:
    """The triangles of some clusters, rows of vertices."""
    runs = [np.arange(clusters.first[k], clusters.first[k + 1]) for k in chosen]
    return clusters.faces[np.concatenate(runs)].astype(np.int64) if runs else np.zeros((0, 3), np.int64)


def cut(clusters: MeshClusters, viewer: Point, allowed: float) -> Rows:
    return select_clusters(clusters, np.array([viewer]), np.zeros(1), allowed).clusters


def directed_edges(clusters: MeshClusters, triangles: Rows) -> Rows:
    """The edges (n, 2) of triangles, between places, each in the direction in which its triangle has it."""
    places = row_ids(clusters.positions)[0][triangles]
    return np.concatenate([places[:, [0, 1]], places[:, [1, 2]], places[:, [2, 0]]])


def is_watertight(clusters: MeshClusters, triangles: Rows) -> bool:
    """Whether each edge has exactly one triangle on either side."""
    one, other = directed_edges(clusters, triangles).T
    places = len(clusters.positions)
    there, count = np.unique(one * places + other, return_counts=True)
    back = np.unique(other * places + one)
    return bool((count == 1).all() and np.array_equal(there, back))


WHITE, BLUE = (255, 255, 255), (20, 40, 150)


def bordered(ball: Mesh) -> Mesh:
    """A ball of radius 1 about (0, 1, 0), white above a wavy line, blue below it."""
    x, y, z = (ball.positions - [0, 1, 0]).T
    above = y > 0.3 * np.sin(4 * np.arctan2(z, x))
    return replace(ball, colours=np.where(above[:, None], WHITE, BLUE).astype(np.uint8))


def border_width(ball: Mesh, clusters: MeshClusters, chosen: Rows) -> float:
    """How wide the strip along the border is, on the mean, that a cut shows in the other colour, metres.

    A strip twice as wide in a colour half-way between both counts the same.
    """
    points = sample_triangles(ball.positions[ball.faces].astype(float), 1500)[0]
    drawn = _colours_at(points, clusters.positions, clusters.colours, triangles_of(clusters, chosen))
    off = np.abs(drawn - _colours_at(points, ball.positions, ball.colours, ball.faces)).sum(1)
    length = 2 * np.pi  # that of the line is larger
    return float(4 * np.pi * (off / np.abs(np.subtract(WHITE, BLUE)).sum()).mean() / length)


def _colours_at(points: Array, positions: Array, colours: Rows, faces: Rows) -> Array:
    """The colours (n, 3) of a surface where it is nearest to points (n, 3)."""
    nearest, shares = nearest_on(points, positions[faces].astype(float))
    return np.asarray(np.einsum("nk,nkd->nd", shares, colours[faces[nearest]].astype(float)))


def nearest_on(points: Array, corners: Array) -> tuple[Rows, Array]:
    """The triangle (n,) of a surface (t, 3, 3) that is nearest to each point (n, 3), and the shares (n, 3) there.

    Of those that may be: with a sphere around each, no farther off than the nearest corner is.
    """
    middle = corners.mean(1)
    radius = np.sqrt(np.square(corners - middle[:, None]).sum(-1).max(1))
    nearest_corner = cKDTree(corners.reshape(-1, 3)).query(points)[0]
    nearest = np.empty(len(points), np.int64)
    for some in np.array_split(np.arange(len(points)), 8):
        point, triangle = np.nonzero(cdist(points[some], middle) - radius <= nearest_corner[some, None] + 1e-9)
        distance = np.full((len(some), len(corners)), np.inf)
        distance[point, triangle] = squared_distances(points[some[point]], corners[triangle])
        nearest[some] = distance.argmin(1)
    return nearest, nearest_shares(points, corners[nearest])


def grid(side: int) -> tuple[Array, Ints]:
    """Points and triangles of a flat unit square with `side` squares along each edge."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(side + 1), np.arange(side + 1)))
    corner = np.flatnonzero((x < side) & (y < side))
    square = np.stack([corner, corner + 1, corner + side + 2, corner, corner + side + 2, corner + side + 1], 1)
    return np.stack([x, y, 0 * x], 1) / side, square.reshape(-1, 3)


def wavy(point: Array) -> Array:
    """Unit normals (n, 3) of a surface with waves, at points (n, 3) of a flat square."""
    normal = np.stack([0.5 * np.sin(9 * point[:, 0]), 0.5 * np.cos(7 * point[:, 1]), np.ones(len(point))], 1)
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))


def normals_off(mesh: Mesh, clusters: MeshClusters, allowed: float) -> tuple[float, int]:
    """Root mean square difference of the normals of a cut from the mesh's, and how many triangles it has."""
    chosen = triangles_of(clusters, cut(clusters, (0, 1, 1e6), allowed / 1e6))
    point = mesh.positions[mesh.faces].astype(float).mean(1)[::4]
    wanted = mesh.normals[mesh.faces].astype(float).mean(1)[::4]
    nearest, shares = nearest_on(point, clusters.positions[chosen].astype(float))
    shown = np.einsum("nk,nkd->nd", shares, clusters.normals[chosen[nearest]])
    one, other = (normal / np.linalg.norm(normal, axis=1, keepdims=True) for normal in (shown, wanted))
    return float(np.sqrt(np.mean(np.square(one - other).sum(1)))), len(chosen)
