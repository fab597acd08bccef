"""Surfaces that mesh clusters are built of, and what is drawn of those: cuts through their levels."""

from dataclasses import replace

import numpy as np

from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.geometry.triangles import row_ids
from depthwalk.ingest.mesh import Mesh
from depthwalk.render.lod.cluster_selection import select_clusters
from depthwalk.types import Rows
from shapes import sphere

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
    edges = directed_edges(clusters, triangles)
    there, count = np.unique(edges, axis=0, return_counts=True)
    back = np.unique(edges[:, ::-1], axis=0)
    return bool((count == 1).all() and np.array_equal(there, back))
