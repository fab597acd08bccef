"""Upload the clusters of a mesh, and make indices that draw the clusters of many objects in one call.

An index encodes an object and a vertex: object × vertices + vertex. Shaders fetch both from textures, so that one draw
call draws any clusters of any objects of an asset, and vertices are still transformed once for the triangles that share
them. (OpenGL 3.3 has neither base instances nor indirect draws.)
"""

from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.geometry.spatial_order import within_runs
from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RECORDS_PER_ROW, RecordTexture
from depthwalk.render.resources.mesh_object import MeshLook
from depthwalk.types import Rows

CLUSTER_VERTEX = np.dtype([("position", "3f4"), ("normal", "3f4"), ("uv", "2f4")])
"""What shaders fetch per vertex: two texels."""

_MAX_INDEX = 1 << 31  # gl_VertexID is signed


@dataclass(kw_only=True)
class ClusterObject:
    """Hold the clusters of a mesh, whose GL objects belong to the mesh store.

    Attributes
    ----------
    clusters : the clusters, in memory.
    vertices : all vertices, on the GPU, as `CLUSTER_VERTEX`.
    colours : their colours, `RECORDS_PER_ROW` to a row; None where all are white.
    look : the materials of the mesh.
    materials : (parts,) index of the material of each part of the mesh.
    """

    clusters: MeshClusters
    vertices: RecordTexture
    colours: moderngl.Texture | None
    look: MeshLook
    materials: tuple[int, ...]

    @property
    def most_objects(self) -> int:
        """Return how many objects fit into an index."""
        return max(_MAX_INDEX // max(len(self.clusters.positions), 1), 1)

    def indices(self, objects: Rows, clusters: Rows) -> NDArray[np.uint32]:
        """Return the indices of the triangles of `clusters`.

        Parameters
        ----------
        objects : (k,) number of the object that each shows, below `most_objects`.
        clusters : (k,) their numbers.

        Returns
        -------
        (t, 3) object × vertices + vertex.
        """
        first = self.clusters.first[clusters]
        count = self.clusters.first[clusters + 1] - first
        rows = np.repeat(first, count)
        rows += within_runs(count)
        faces = self.clusters.faces.take(rows, 0)
        faces += np.repeat((objects * len(self.clusters.positions)).astype(np.uint32), count)[:, None]
        return faces

    def free(self, gl: Scope) -> None:
        """Free the GL objects, which `gl` owns, except the materials."""
        self.vertices.free()
        if self.colours is not None:
            gl.free(self.colours)


def upload_clusters(gl: Scope, clusters: MeshClusters, look: MeshLook, materials: tuple[int, ...]) -> ClusterObject:
    """Upload the clusters of a mesh.

    Parameters
    ----------
    gl : the scope that owns the GL objects.
    clusters : the clusters.
    look : the materials of the mesh.
    materials : (parts,) index of the material of each part of the mesh.

    Returns
    -------
    The clusters on the GPU.
    """
    records = np.zeros(len(clusters.positions), CLUSTER_VERTEX)
    records["position"], records["normal"], records["uv"] = clusters.positions, clusters.normals, clusters.uv
    vertices = RecordTexture(gl, CLUSTER_VERTEX, len(records))
    vertices.upload(records)
    painted = any(material.painted for material in look.materials)
    colours = _colours(gl, clusters) if painted else None
    return ClusterObject(clusters=clusters, vertices=vertices, colours=colours, look=look, materials=materials)


def _colours(gl: Scope, clusters: MeshClusters) -> moderngl.Texture:
    """Upload the colours of vertices."""
    rows = max(-(-len(clusters.colours) // RECORDS_PER_ROW), 1)
    colours = np.full((rows * RECORDS_PER_ROW, 4), 255, np.uint8)
    colours[: len(clusters.colours), :3] = clusters.colours
    return gl.texture((RECORDS_PER_ROW, rows), 4, data=colours.tobytes())
