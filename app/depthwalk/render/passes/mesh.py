"""Ordinary polygons, instanced per asset and level of detail, into the same G-buffer and depth buffer."""

from typing import ClassVar

import moderngl

from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program
from depthwalk.params import Params, param
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.mesh_lod import MeshLodParams
from depthwalk.render.polygons import MESH_LAYOUT
from depthwalk.render.records import PLACED_RECORD
from depthwalk.render.view import matrix_bytes


class MeshParams(MeshLodParams):
    wireframe: bool = param(False, "Draw triangles as lines")


class MeshPass(Pass):
    name = "mesh"
    draws_objects = True
    writes = ("gbuffer", "visible")
    Params: ClassVar[type[Params]] = MeshParams

    def setup(self) -> None:
        self._program = Program(self.gl, "mesh/mesh.vert", "mesh/mesh.frag")
        self._instances = InstanceStream(self.gl, PLACED_RECORD)
        self._arrays = AssetArrays(self.gl, self._program.gl, *MESH_LAYOUT)

    def draw(self, frame: Frame) -> None:
        context = self.gl.device.context
        frame.targets.polygons.use()
        context.wireframe = frame.settings.mesh.wireframe
        self._program.set(clip_from_eye=matrix_bytes(frame.view.clip_from_eye), base_texture=0)
        self._instances.upload(frame.plan.mesh.records)
        for group in frame.plan.mesh.groups:
            asset = frame.assets.meshes.object(group.asset, group.level)
            array = self._arrays.get((group.asset, group.level), asset.vertices, asset.indices)
            self._instances.bind(array, group.first)
            context.enable_only(moderngl.DEPTH_TEST | (moderngl.CULL_FACE if asset.look.solid else moderngl.NOTHING))
            for part in asset.parts:
                texture, uniforms = asset.look.materials[part.material]
                texture.use(0)
                self._program.set(**uniforms)
                array.render(vertices=3 * part.face_count, first=3 * part.first_face, instances=group.count)
        context.wireframe = False

    def forget_assets(self) -> None:
        self._arrays.forget()
