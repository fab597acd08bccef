"""Ordinary polygons, instanced per asset and level of detail, into the same G-buffer and depth buffer."""

import moderngl
import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.render.draw.draw_lists import DrawBatch
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.mesh_object import PAINTED_LAYOUT, PLAIN_LAYOUT, MeshObject
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.scene.render_settings import MeshParams

_ONE_BY_ONE = 4  # objects in a frame, the nearest, of which only the meshlets that may be seen are drawn
_ROOM = 1 << 18  # triangles of those of one part; a part of more is drawn whole


class MeshPass(Pass[MeshParams]):
    name = "mesh"
    draws_objects = True
    writes = ("albedo", "surface", "visibility", "depth")

    def setup(self, gl: Scope) -> None:
        layouts = {(): PLAIN_LAYOUT, ("PAINTED",): PAINTED_LAYOUT}
        self._programs = Variants(lambda defines: Program(gl, "mesh/mesh.vert", "mesh/mesh.frag", defines))
        self._arrays = Variants(lambda defines: AssetArrays(gl, self._programs[defines].gl, *layouts[defines]))
        self._instances = InstanceStream(gl, PLACED_RECORD)
        self._seen = gl.buffer(reserve=12 * _ROOM, dynamic=True)  # indices of meshlets

    def draw(self, frame: Frame, params: MeshParams) -> None:
        with self.gl.state(into=frame.targets.polygons, depth_test=LESS, wireframe=params.wireframe):
            self._draw(frame)

    def _draw(self, frame: Frame) -> None:
        drawn = frame.plan.mesh
        self._instances.upload(drawn.records)
        away = np.linalg.norm(drawn.records["origin"], axis=1)
        farthest = np.partition(away, _ONE_BY_ONE)[_ONE_BY_ONE] if len(away) > _ONE_BY_ONE else np.inf
        for group in drawn.groups:
            asset = frame.assets.meshes.object(group.asset, group.level)
            near = away[group.first : group.first + group.count] < farthest
            alone = int(np.logical_and.accumulate(near).sum()) if asset.meshlets else 0  # the first are the nearest
            with self.gl.state(cull=asset.look.solid):
                for record in range(group.first, group.first + alone):
                    self._draw_seen(frame, asset, group, record)
                for number in range(len(asset.parts)) if group.count > alone else ():
                    self._draw_part(frame, asset, group, number, group.first + alone, group.count - alone)

    def _draw_seen(self, frame: Frame, asset: MeshObject, group: DrawBatch, record: int) -> None:
        """Of the object of one record what may be seen."""
        meshlets = asset.meshlets
        assert meshlets is not None  # says the caller
        rows = meshlets.seen(frame.view, frame.plan.mesh.records[record], asset.look.solid)
        for number in range(len(asset.parts)):
            faces = meshlets.faces.take(rows[meshlets.part[rows] == number], axis=0)
            if faces.nbytes > self._seen.size:
                self._draw_part(frame, asset, group, number, record, 1)
            elif len(faces):
                self._seen.orphan()
                self._seen.write(faces)
                array = self._array(frame, asset, (group.asset, group.level, "seen"), number, self._seen, record)
                array.render(vertices=faces.size)

    def _draw_part(
        self, frame: Frame, asset: MeshObject, group: DrawBatch, number: int, first: int, count: int
    ) -> None:
        """Part `number` of `count` objects, whole, from record `first` on."""
        part = asset.parts[number]
        array = self._array(frame, asset, (group.asset, group.level), number, asset.indices, first)
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
        """To draw what looks like part `number` of the mesh, from record `first` on."""
        look = asset.look.materials[asset.parts[number].material]
        defines = ("PAINTED",) if look.painted else ()
        look.texture.use(0)
        program = self._programs[defines]
        program.set(base_texture=0, **look.uniforms)
        array = self._arrays[defines].get(key, asset.vertices, indices)
        self._instances.bind(array, first)
        return array

    def forget_assets(self) -> None:
        for arrays in self._arrays.values():
            arrays.forget()
