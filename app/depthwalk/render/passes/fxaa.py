"""Fast approximate anti-aliasing (Lottes 2009): the lit picture is blurred along edges of brightness."""

from typing import ClassVar

import moderngl

from depthwalk.gpu.program import Program
from depthwalk.params import Params, param
from depthwalk.render.frame import Frame, Pass


class FxaaParams(Params):
    contrast: float = param(0.125, "Part of the brightness around by which it must differ to be an edge", ge=0, le=1)


class FxaaPass(Pass):
    name = "fxaa"
    reads = ("lit",)
    writes = ("lit",)
    Params: ClassVar[type[Params]] = FxaaParams

    def setup(self) -> None:
        self._program = Program(self.gl, "common/fullscreen.vert", "fxaa/fxaa.frag")

    def draw(self, frame: Frame) -> None:
        if frame.settings.aa != "fxaa":
            return
        frame.targets.lit_before().use(0)
        frame.targets.lit.use()
        self.gl.device.context.enable_only(moderngl.NOTHING)
        self._program.set(lit_texture=0, contrast=frame.settings.fxaa.contrast)
        self._program.fill()
