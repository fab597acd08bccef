"""Anti-aliasing of depth images: what one covers in part blends with what is behind. See docs/anti-aliasing.md."""

import moderngl

from depthwalk.gpu.program import Program
from depthwalk.render.antialiasing import covering
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.shading import CLOSED


class CoveragePass(Pass):
    name = "coverage"
    reads = ("visible", "gbuffer", "lit")
    writes = ("lit",)

    def setup(self) -> None:
        self._program = Program(self.gl, "common/rectangle.vert", "coverage/coverage.frag")

    def draw(self, frame: Frame) -> None:
        targets, shading = frame.targets, frame.shading
        if not covering(frame.settings) or shading is None or not len(shading.assets):
            return
        for unit, texture in enumerate((targets.lit_before(), targets.visible_texture, targets.depth)):
            texture.use(unit)
        context = self.gl.device.context
        targets.covered.use()
        targets.covered.depth_mask = False
        context.enable_only(moderngl.DEPTH_TEST)
        context.depth_func = ">"  # what `shade` has marked as covered in part is in front
        self._program.set(lit_texture=0, visible_texture=1, depth_texture=2)
        self._program.set(level=CLOSED, low=tuple(shading.low.min(0)), high=tuple(shading.high.max(0)))
        self._program.rectangles()
        context.depth_func = "<"
