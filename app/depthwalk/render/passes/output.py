"""Linear light to the screen's sRGB, exposed and toned; where pixels have several samples, their mean."""

from typing import ClassVar, Literal

import moderngl

from depthwalk.gpu.program import Program, Variants
from depthwalk.params import Params, param
from depthwalk.render.antialiasing import samples
from depthwalk.render.frame import Frame, Pass


class OutputParams(Params):
    tone: Literal["none", "reinhard", "aces", "agx"] = param(
        "none", "How light of any strength becomes what a screen shows: cut off at white, or by a curve"
    )
    exposure: float = param(0.0, "Light is doubled so many times before that", unit="EV", ge=-16, le=16)


class OutputPass(Pass):
    name = "output"
    reads = ("lit",)
    writes = ("screen",)
    Params: ClassVar[type[Params]] = OutputParams

    def setup(self) -> None:
        shaders = "common/fullscreen.vert", "output/output.frag"
        self._programs = Variants(lambda defines: Program(self.gl, *shaders, defines=defines))

    def draw(self, frame: Frame) -> None:
        frame.screen.use()
        self.gl.device.context.enable_only(moderngl.NOTHING)
        frame.targets.lit_texture.use(0)
        finer = samples(frame.settings)
        # A loop over one sample costs software rasterisers four times as much as none.
        settings = frame.settings.output
        defines = (settings.tone.upper(), *(("SUPERSAMPLED",) if finer > 1 else ()))
        self._programs[defines].set(lit_texture=0, samples=finer, exposure=2.0**settings.exposure)
        self._programs[defines].fill()
