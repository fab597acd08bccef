"""One sample of each pixel into the G-buffer, where there are several: what follows knows of one alone."""

import moderngl

from depthwalk.gpu.device import ALWAYS
from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame, Pass


class SamplePass(Pass):
    name = "sample"
    per_sample = True
    reads = ("drawn",)
    writes = ("gbuffer", "visible")

    def setup(self) -> None:
        self._program = Program(self.gl, "common/fullscreen.vert", "sample/sample.frag")

    def draw(self, frame: Frame) -> None:
        targets = frame.targets
        if targets.samples == 1:
            return
        context = self.gl.device.context
        targets.one_sample.use()
        context.enable_only(moderngl.DEPTH_TEST)
        context.depth_func = ALWAYS
        drawn = targets.drawn
        for unit, texture in enumerate((drawn.albedo, drawn.surface, drawn.visible, drawn.depth)):
            texture.use(unit)
        names = "albedo_samples", "surface_samples", "visible_samples", "depth_samples"
        self._program.set(number=frame.sample, **{name: unit for unit, name in enumerate(names)})
        self._program.fill()
        context.depth_func = "<"
