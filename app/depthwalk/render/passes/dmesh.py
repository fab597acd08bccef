"""Depth samples warped straight to the screen: viewers inside a cylinder, and the representation `dmesh`."""

import moderngl

from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.grids import GRID_LAYOUT
from depthwalk.render.records import PLACED_RECORD


class DmeshPass(Pass):
    name = "dmesh"
    draws_objects = True
    writes = ("visible",)

    def setup(self) -> None:
        self._programs = Variants(lambda defines: Program(self.gl, "dmesh/dmesh.vert", "dmesh/dmesh.frag", defines))
        self._arrays = Variants(lambda defines: AssetArrays(self.gl, self._programs[defines].gl, *GRID_LAYOUT))
        self._instances = InstanceStream(self.gl, PLACED_RECORD)

    def draw(self, frame: Frame) -> None:
        context = self.gl.device.context
        frame.targets.visible.use()
        context.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        context.wireframe = frame.settings.warp.wireframe
        self._instances.upload(frame.plan.dmesh.records)
        first_number = frame.plan.first_number + len(frame.plan.composite.records)
        for number, groups in frame.plan.dmesh.by_asset():
            asset = frame.assets.depth_object(number)
            defines = (*asset.defines, *frame.targets.defines)
            program, array = self._programs[defines], asset.array(self._arrays[defines], number)
            asset.use_geometry(program, 0, frame.settings.lod)
            for group in groups:
                program.set(first=first_number + group.first)
                self._instances.bind(array, group.first)
                asset.draw(array, group.indices, group.count)
        context.wireframe = False

    def forget_assets(self) -> None:
        for arrays in self._arrays.values():
            arrays.forget()
