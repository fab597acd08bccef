"""What part of the sun's light reaches each pixel, where it casts shadows."""

import moderngl

from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame, Pass


class SunPass(Pass):
    name = "sun"
    per_sample = True
    reads = ("gbuffer", "sun_maps")
    writes = ("shadow",)

    def setup(self) -> None:
        self._program = Program(self.gl, "common/far_plane.vert", "sun/sun.frag")

    def draw(self, frame: Frame) -> None:
        targets, settings, view = frame.targets, frame.settings, frame.view
        if targets.sun_maps is None:
            return
        targets.shadow.use()
        self.gl.device.context.enable_only(moderngl.NOTHING)
        targets.depth.use(0)
        targets.surface.use(1)
        self._program.set(
            depth_texture=0,
            surface_texture=1,
            **targets.sun_maps.use(2, view, settings.shadows, settings.lod),
        )
        self._program.fill()
