"""Depth samples warped straight to the screen: viewers inside a cylinder, and the representation `dmesh`."""

from depthwalk.cook.lod_geometry import GRID_LAYOUT
from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.placed_records import PLACED_RECORD


class DmeshPass(Pass[Params]):
    name = "dmesh"
    draws_objects = True
    writes = ("visibility", "depth")

    def setup(self, gl: Scope) -> None:
        self._programs = Variants(lambda defines: Program(gl, "dmesh/dmesh.vert", "dmesh/dmesh.frag", defines))
        self._arrays = Variants(lambda defines: AssetArrays(gl, self._programs[defines].gl, *GRID_LAYOUT))
        self._instances = InstanceStream(gl, PLACED_RECORD)

    def draw(self, frame: Frame, params: Params) -> None:
        self._instances.upload(frame.plan.dmesh.records)
        first_object_id = frame.plan.first_object_id + len(frame.plan.composite.records)
        for number, groups in frame.plan.dmesh.by_asset():
            asset = frame.assets.depth_object(number)
            defines = (*asset.defines, *frame.targets.defines)
            program, array = self._programs[defines], asset.array(self._arrays[defines], number)
            asset.use_geometry(program, 0, frame.common.lod)
            with self.gl.state(
                into=frame.targets.visibility, depth_test=LESS, cull=True, wireframe=frame.common.wireframe
            ):
                for group in groups:
                    program.set(first=first_object_id + group.first)
                    self._instances.bind(array, group.first)
                    asset.draw(array, group.indices, group.count)

    def forget_assets(self) -> None:
        for arrays in self._arrays.values():
            arrays.forget()
