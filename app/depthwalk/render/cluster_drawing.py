"""Draw meshes by clusters, for several passes: one draw call for all objects of an asset and material."""

from collections.abc import Callable

import moderngl
import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.gpu.program import Program
from depthwalk.render.draw.draw_lists import ClusterDraws
from depthwalk.render.resources.cluster_object import ClusterObject
from depthwalk.render.resources.mesh_store import MeshStore
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.types import Rows

COLOURS = 3  # texture unit of the colours of vertices
_VERTICES, _OBJECTS = 1, 2  # texture units; 0 is that of a material

ChooseProgram = Callable[[ClusterObject, int], Program]
"""Returns the program that draws a part of a mesh, by its number, with all but its cluster textures set."""


class ClusterDrawing:
    """Hold the buffers with which a pass draws meshes by clusters; `gl` owns them."""

    def __init__(self, gl: Scope) -> None:
        self._gl = gl
        self._objects = RecordTexture(gl, PLACED_RECORD)
        self._indices = gl.buffer(reserve=4, dynamic=True)
        self._arrays: dict[moderngl.Program, moderngl.VertexArray] = {}

    def draw(self, draws: ClusterDraws, meshes: MeshStore, choose: ChooseProgram, cull: bool = True) -> None:
        """Draw clusters into the framebuffer that is bound.

        Parameters
        ----------
        draws : the pairs of objects and clusters to draw.
        meshes : the store that has the clusters.
        choose : returns the program for each part of a mesh.
        cull : whether back faces of solids are culled.
        """
        if not draws:
            return
        self._objects.upload(draws.objects.records)
        for asset, first, last in zip(draws.asset.tolist(), draws.first, draws.first[1:], strict=False):
            clusters = meshes.clusters(asset)
            record, cluster = draws.record[first:last], draws.cluster[first:last]
            with self._gl.state(cull=cull and clusters.look.solid):
                start = int(record.min()) if len(record) else 0
                while len(record):
                    near = record - start < clusters.most_objects
                    self._draw(clusters, record[near], cluster[near], start, choose)
                    record, cluster, start = record[~near], cluster[~near], start + clusters.most_objects

    def _draw(self, drawn: ClusterObject, record: Rows, cluster: Rows, first: int, choose: ChooseProgram) -> None:
        """Draw pairs of objects and clusters of one asset; `first` is the record that texture indices count from."""
        if not len(record):
            return
        part, parts = drawn.clusters.part[cluster], len(drawn.materials)
        if parts > 1:
            order = np.argsort(part, kind="stable")
            record, cluster, part = record[order], cluster[order], part[order]
        indices = drawn.indices(record - first, cluster)
        self._gl.refill(self._indices, indices)
        counts = np.bincount(part, np.diff(drawn.clusters.first)[cluster], parts).astype(np.int64)
        drawn.vertices.use(_VERTICES)
        self._objects.use(_OBJECTS)
        textures = {"cluster_vertices": _VERTICES, "cluster_objects": _OBJECTS}
        if drawn.colours is not None:
            drawn.colours.use(COLOURS)
        begins = np.cumsum(counts) - counts
        for number in np.flatnonzero(counts).tolist():
            program = choose(drawn, number)
            program.set(vertex_count=len(drawn.clusters.positions), first_object=first, **textures)
            self._array(program).render(vertices=3 * int(counts[number]), first=3 * int(begins[number]))

    def _array(self, program: Program) -> moderngl.VertexArray:
        """Return the vertex array of a program, which has no attributes."""
        if program.gl not in self._arrays:
            self._arrays[program.gl] = self._gl.vertex_array(program.gl, [], index_buffer=self._indices)
        return self._arrays[program.gl]
