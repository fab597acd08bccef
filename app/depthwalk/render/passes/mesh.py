"""Draw polygon meshes, instanced per asset and level of detail, into the G-buffer and the depth buffer.

The draw lists name the levels. The nearest objects are drawn without meshlets that cannot be seen
(`render.resources.meshlets`). Objects of the representation mesh-clusters are drawn by clusters
(`render.cluster_drawing`).
"""

from functools import partial

import moderngl
import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.render.cluster_drawing import COLOURS, ClusterDrawing
from depthwalk.render.draw.draw_lists import DrawBatch
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.cluster_object import ClusterObject
from depthwalk.render.resources.mesh_object import PAINTED_LAYOUT, PLAIN_LAYOUT, MeshObject
from depthwalk.render.resources.placed_records import NUMBERED_CLUSTERS, NUMBERED_MESH, PLACED_RECORD
from depthwalk.scene.object_settings import MeshParams

_CULLED_OBJECTS = 4  # nearest objects of a frame whose meshlets are culled
_MAX_CULLED_TRIANGLES = 1 << 18  # in the visible meshlets of one part; a part with more is drawn whole


class MeshPass(Pass[MeshParams]):
    """Draw the meshes of `frame.plan.mesh` as triangles."""

    name = "mesh"
    draws_objects = True
    writes = ("surface", "visibility", "depth")

    def setup(self, gl: Scope) -> None:
        """Prepare the variants of the program and a buffer for the indices of meshlets; `gl` owns them."""
        self._more: tuple[str, ...] = ()  # defines of all programs of a frame
        self._sky_lights = False  # in this frame
        self._programs = Variants(lambda defines: Program(gl, "mesh/mesh.vert", "mesh/mesh.frag", defines))
        layouts = {True: PAINTED_LAYOUT, False: PLAIN_LAYOUT}
        self._arrays = Variants(
            lambda defines: AssetArrays(gl, self._programs[defines], *layouts["PAINTED" in defines])
        )
        self._instances = InstanceStream(gl, PLACED_RECORD)
        self._cluster_programs = Variants(lambda defines: Program(gl, "mesh/clusters.vert", "mesh/mesh.frag", defines))
        self._clusters = ClusterDrawing(gl)
        self._seen = gl.buffer(reserve=4, dynamic=True)  # indices of meshlets

    def enabled(self, frame: Frame, params: MeshParams) -> bool:
        """Return whether `frame` has meshes; the `params` do not matter."""
        return bool(frame.plan.mesh.batches or frame.plan.clusters)

    def draw(self, frame: Frame, params: MeshParams) -> None:
        """Draw the meshes of `frame` into surfaces, visibility and depth, as `params` say.

        In the first phase the cleared visibility buffer already holds what polygons would write, so it is not written,
        unless they have numbers.
        """
        self._more = ("NUMBERED",) if frame.common.numbers_polygons else ()
        self._sky_lights = frame.light.reflected is not None
        hides = frame.plan.continues or frame.common.numbers_polygons
        into = frame.targets.polygons if hides else frame.targets.first_polygons
        with self.gl.state(into=into, depth_test=LESS, wireframe=params.wireframe):
            self._draw(frame)
            choose = partial(self._choose, frame.plan.polygons_before[1])
            self._clusters.draw(frame.plan.clusters, frame.assets.meshes, choose)

    def _choose(self, first: int, clusters: ClusterObject, number: int) -> Program:
        """Return the program that draws part `number` of a mesh by clusters, with its material set; a ChooseProgram.

        first : the number of the phase's first object by clusters among those of the frame.
        """
        look = clusters.look.materials[clusters.materials[number]]
        program = self._cluster_programs[look.defines(self._sky_lights) + self._more]
        if self._more:
            program.set(first_number=first, drawn_how=NUMBERED_CLUSTERS)
        look.use(program)
        if look.painted:
            program.set(cluster_colours=COLOURS)
        return program

    def _draw(self, frame: Frame) -> None:
        drawn = frame.plan.mesh
        distance = np.linalg.norm(drawn.records["origin"], axis=1)
        limit = np.partition(distance, _CULLED_OBJECTS)[_CULLED_OBJECTS] if len(distance) > _CULLED_OBJECTS else np.inf
        for batch in drawn.batches:
            asset = frame.assets.meshes.object(batch.asset, batch.level)
            near = distance[batch.first : batch.first + batch.count] < limit
            culled = int(np.logical_and.accumulate(near).sum()) if asset.meshlets else 0  # the first are the nearest
            with self.gl.state(cull=asset.look.solid):
                for record in range(batch.first, batch.first + culled):
                    self._draw_meshlets(frame, asset, batch, record)
                if batch.count > culled:
                    self._instances.upload(drawn.records_of(batch)[culled:])
                    for number in range(len(asset.parts)):
                        self._draw_part(frame, asset, batch, number, batch.first + culled, batch.count - culled)

    def _draw_meshlets(self, frame: Frame, asset: MeshObject, batch: DrawBatch, record: int) -> None:
        """Draw the meshlets that may be seen of the object of one record."""
        meshlets = asset.meshlets
        assert meshlets is not None  # as the caller has checked
        records = frame.plan.mesh.records
        rows = meshlets.seen(frame.view, records[record], asset.look.solid)
        self._instances.upload(records[record : record + 1])
        for number in range(len(asset.parts)):
            faces = meshlets.faces.take(rows[meshlets.part[rows] == number], axis=0)
            if len(faces) > _MAX_CULLED_TRIANGLES:
                self._draw_part(frame, asset, batch, number, record, 1)
            elif len(faces):
                self.gl.refill(self._seen, faces)
                key = batch.asset, batch.level, "seen"
                array = self._array(frame, asset, key, number, self._seen, record)
                array.render(vertices=faces.size)

    def _draw_part(
        self, frame: Frame, asset: MeshObject, batch: DrawBatch, number: int, first: int, count: int
    ) -> None:
        """Draw part `number` of `count` objects, whole, whose records, from `first` on, are uploaded."""
        part = asset.parts[number]
        array = self._array(frame, asset, (batch.asset, batch.level), number, asset.indices, first)
        array.render(vertices=3 * part.face_count, first=3 * part.first_face, instances=count)

    def _array(
        self,
        frame: Frame,
        asset: MeshObject,
        key: tuple[int | str, ...],
        number: int,
        indices: moderngl.Buffer,
        first: int,
    ) -> moderngl.VertexArray:
        """Set the material of part `number` of the mesh; return the vertex array. first: the first record drawn."""
        look = asset.look.materials[asset.parts[number].material]
        defines = look.defines(self._sky_lights) + self._more
        program = self._programs[defines]
        if self._more:
            program.set(first_number=frame.plan.polygons_before[0] + first, drawn_how=NUMBERED_MESH)
        look.use(program)
        array = self._arrays[defines].get(key, asset.vertices, indices)
        self._instances.bind(array)
        return array

    def forget_assets(self) -> None:
        """Drop the vertex arrays over buffers of assets."""
        for arrays in self._arrays.values():
            arrays.forget()
