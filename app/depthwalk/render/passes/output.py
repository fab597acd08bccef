"""Linear light to the screen's sRGB, exposed and toned; where pixels have several samples, their mean."""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.frame import Frame, Pass
from depthwalk.scene.render_settings import OutputParams


class OutputPass(Pass[OutputParams]):
    name = "output"
    reads = ("lit",)
    writes = ("screen",)

    def setup(self, gl: Scope) -> None:
        shaders = "common/fullscreen.vert", "output/output.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines=defines))

    def draw(self, frame: Frame, params: OutputParams) -> None:
        frame.targets.lit_texture.use(0)
        finer = frame.common.aa.samples
        # A loop over one sample costs software rasterisers four times as much as none.
        defines = (params.tone_mapping.upper(), *(("SUPERSAMPLED",) if finer > 1 else ()))
        self._programs[defines].set(lit_texture=0, samples=finer, exposure=2.0**params.exposure)
        with self.gl.state(into=frame.targets.screen):
            self._programs[defines].fill()
