"""Ordinary polygons, instanced per asset, into the same G-buffer and depth buffer."""

from typing import ClassVar

import moderngl

from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program
from depthwalk.params import Params, param
from depthwalk.render.assets import MESH_LAYOUT
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.records import PLACED_RECORD
from depthwalk.render.view import matrix_bytes


class MeshParams(Params):
    wireframe: bool = param(False, "Draw triangles as lines")


class MeshPass(Pass):
    name = "mesh"
    writes = ("gbuffer",)
    Params: ClassVar[type[Params]] = MeshParams

    def setup(self) -> None:
        self._program = Program(self.gl, "mesh/mesh.vert", "mesh/mesh.frag")
        self._instances = InstanceStream(self.gl, PLACED_RECORD)
        self._arrays = AssetArrays(self.gl, self._program.gl, *MESH_LAYOUT)

    def draw(self, frame: Frame) -> None:
        context = self.gl.device.context
        frame.targets.gbuffer.use()
        context.enable_only(moderngl.DEPTH_TEST)
        context.wireframe = frame.settings.mesh.wireframe
        self._program.set(clip_from_eye=matrix_bytes(frame.view.clip_from_eye), base_texture=0)
        self._instances.upload(frame.plan.mesh.records)
        for group in frame.plan.mesh.groups:
            asset = frame.assets.mesh_object(group.asset)
            array = self._arrays.get(group.asset, asset.vertices, asset.indices)
            self._instances.bind(array, group.first)
            for part in asset.parts:
                asset.textures[part.material].use(0)
                self._program.set(**asset.materials[part.material])
                array.render(vertices=3 * part.face_count, first=3 * part.first_face, instances=group.count)
        context.wireframe = False

    def forget_assets(self) -> None:
        self._arrays.forget()
