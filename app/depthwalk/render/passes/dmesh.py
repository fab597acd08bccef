"""Depth samples warped straight to the screen: viewers inside a cylinder, and the representation `dmesh`."""

import moderngl

from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.grids import GRID_LAYOUT
from depthwalk.render.records import PLACED_RECORD
from depthwalk.render.view import matrix_bytes


class DmeshPass(Pass):
    name = "dmesh"
    draws_objects = True
    writes = ("gbuffer",)

    def setup(self) -> None:
        self._program = Program(self.gl, "dmesh/dmesh.vert", "dmesh/dmesh.frag")
        self._instances = InstanceStream(self.gl, PLACED_RECORD)
        self._arrays = AssetArrays(self.gl, self._program.gl, *GRID_LAYOUT)

    def draw(self, frame: Frame) -> None:
        context = self.gl.device.context
        frame.targets.gbuffer.use()
        context.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        context.wireframe = frame.settings.warp.wireframe
        clip_from_eye = matrix_bytes(frame.view.clip_from_eye)
        self._program.set(clip_from_eye=clip_from_eye)
        self._instances.upload(frame.plan.dmesh.records)
        for group in frame.plan.dmesh.groups:
            asset = frame.assets.depth_object(group.asset)
            array = self._arrays.get(group.asset, asset.vertices, asset.indices)
            asset.use_geometry(self._program, 2, frame.settings.lod, 1 / frame.view.focal_pixels)
            asset.use_surface(self._program, (0, 1, 2))
            self._instances.bind(array, group.first)
            for first, length in group.indices:
                array.render(vertices=length, first=first, instances=group.count)
        context.wireframe = False

    def forget_assets(self) -> None:
        self._arrays.forget()
