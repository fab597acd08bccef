"""Pass 1: depth samples move within a plane that touches their object, into a tile of the atlas."""

from typing import ClassVar

import moderngl

from depthwalk.gpu.device import CLIP_DISTANCES
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program
from depthwalk.params import Params, param
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.grids import GRID_LAYOUT
from depthwalk.render.plan import WARP_RECORD
from depthwalk.render.tiles import TileParams


class WarpParams(TileParams):
    wireframe: bool = param(False, "Draw the warped grids as lines")


class WarpPass(Pass):
    name = "warp"
    writes = ("atlas",)
    Params: ClassVar[type[Params]] = WarpParams

    def setup(self) -> None:
        self._program = Program(self.gl, "warp/warp.vert", "warp/warp.frag")
        self._instances = InstanceStream(self.gl, WARP_RECORD)
        self._arrays = AssetArrays(self.gl, self._program.gl, *GRID_LAYOUT)

    def draw(self, frame: Frame) -> None:
        context = self.gl.device.context
        frame.targets.atlas.use()
        # Only the rows in use are cleared: the whole atlas would cost as much as several objects.
        frame.targets.atlas.clear(depth=1.0, viewport=(0, 0, frame.targets.atlas_size[0], frame.plan.atlas_height))
        context.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        context.wireframe = frame.settings.warp.wireframe
        self._instances.upload(frame.plan.warp.records)
        for group in frame.plan.warp.groups:
            asset = frame.assets.depth_object(group.asset)
            array = self._arrays.get(group.asset, asset.vertices, asset.indices)
            self._program.set(**asset.geometry)
            self._instances.bind(array, group.first)
            for plane in CLIP_DISTANCES if group.clipped else ():  # costs a third more, and few objects need it
                context.enable_direct(plane)
            for first, length in group.indices:
                array.render(vertices=length, first=first, instances=group.count)
            for plane in CLIP_DISTANCES if group.clipped else ():
                context.disable_direct(plane)
        context.wireframe = False

    def forget_assets(self) -> None:
        self._arrays.forget()
