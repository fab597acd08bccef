"""Collect the clusters of all levels of a mesh, in its own frame, while they are built."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cluster_table import Clusters, Groups
from depthwalk.cook.group_simplification import Batch
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.solid import is_solid
from depthwalk.types import Array, Ints

_LOOKS = {"positions": 3, "normals": 3, "colours": 3, "uv": 2}


class Output:
    """Collect clusters, groups and vertices.

    Attributes
    ----------
    clusters, groups : the numbers of those so far.
    """

    def __init__(self, mesh: Mesh, source: Ints, low: Array, size: float) -> None:
        """Begin with the vertices of a mesh.

        source: (v,) the vertices that its clusters use; low, size: lowest corner, metres, and size of its bounding box,
        which the builder's frame begins at and has as its unit.
        """
        self.clusters = self.groups = 0
        self._mesh, self._source, self._low, self._size = mesh, source, low, size
        self._vertices = len(source)
        self._looks: dict[str, list[NDArray[Any]]] = {name: [] for name in _LOOKS}
        self._faces: list[NDArray[np.uint32]] = []
        self._clusters: list[Clusters] = []
        self._groups: list[Groups] = []
        self._members: list[tuple[Ints, Ints]] = []  # numbers of clusters, and the groups that simplify them
        self._level_first = [0]

    def add_clusters(self, clusters: Clusters, faces: NDArray[np.uint32]) -> None:
        """Add clusters, with their triangles (t, 3), numbers of vertices."""
        self._clusters.append(clusters)
        self._faces.append(faces)
        self.clusters += len(clusters)

    def add_groups(self, groups: Groups, clusters: Ints, group: Ints) -> None:
        """Add the groups of a level: the cluster numbered `clusters` (n,) are in those of its groups (n,)."""
        self._groups.append(groups)
        self._members.append((clusters, self.groups + group))
        self.groups += len(groups)
        self._level_first.append(self.groups)

    def add_vertices(self, points: Sequence[Array], batches: Sequence[Batch]) -> NDArray[np.uint32]:
        """Add the new vertices of batches of groups, which are at `points` (v, 3) each; return their numbers."""
        first = self._vertices
        for point, batch in zip(points, batches, strict=True):
            normal, colour, uv = np.split(batch.vertex_look, [3, 6], axis=1)
            normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.float32(1e-30))
            self._looks["positions"].append((self._low + self._size * point.astype(np.float64)).astype(np.float32))
            self._looks["normals"].append(normal.astype(np.float32))
            self._looks["colours"].append(np.round(255 * colour).astype(np.uint8))
            self._looks["uv"].append(uv)
            self._vertices += len(point)
        return np.arange(first, self._vertices, dtype=np.uint32)

    def result(self) -> MeshClusters:
        """Return the finished clusters, in the frame and with the vertices of the mesh."""
        clusters, groups = Clusters.joined(self._clusters), Groups.joined([Groups.none(), *self._groups])
        group = np.full(len(clusters), -1)
        for number, of in self._members:
            group[number] = of
        looks = {name: self._joined(name) for name in _LOOKS}
        faces, self._faces = np.concatenate(self._faces), []
        return MeshClusters(
            **looks,
            faces=faces,
            solid=is_solid(self._mesh),
            first=np.append(0, np.cumsum(clusters.count)),
            part=clusters.part,
            centre=self._low + self._size * clusters.centre,
            radius=self._size * clusters.radius,
            axis=clusters.axis,
            sine=clusters.sine,
            made_by=clusters.made_by,
            group=group,
            level_first=np.array(self._level_first),
            error=self._size * groups.error,
            group_centre=self._low + self._size * groups.centre,
            group_radius=self._size * groups.radius,
        )

    def _joined(self, name: str) -> NDArray[Any]:
        """Return the values of the mesh's vertices, exactly as they are there, and of the new ones, which are freed."""
        return np.concatenate([getattr(self._mesh, name)[self._source], *self._looks.pop(name)])


def no_clusters() -> MeshClusters:
    """Return the clusters of a mesh without triangles: none."""
    numbers, points, values = np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0)
    return MeshClusters(
        positions=np.zeros((0, 3), np.float32),
        normals=np.zeros((0, 3), np.float32),
        colours=np.zeros((0, 3), np.uint8),
        uv=np.zeros((0, 2), np.float32),
        faces=np.zeros((0, 3), np.uint32),
        solid=False,
        first=np.zeros(1, np.int64),
        part=numbers,
        centre=points,
        radius=values,
        axis=points,
        sine=values,
        made_by=numbers,
        group=numbers,
        level_first=np.zeros(1, np.int64),
        error=values,
        group_centre=points,
        group_radius=values,
    )
