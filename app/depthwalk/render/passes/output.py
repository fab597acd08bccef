"""Convert linear light to the sRGB of the screen, exposed and tone-mapped.

Supersampled, a pixel of the screen is the mean of its samples.
"""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.frame import Frame, Pass
from depthwalk.scene.render_settings import OutputParams


class OutputPass(Pass[OutputParams]):
    """Draw the finished picture in the colours of the screen."""

    name = "output"
    reads = ("lit",)
    writes = ("screen",)

    def setup(self, gl: Scope) -> None:
        """Prepare the program, whose variants are compiled when first needed; `gl` owns their GL objects."""
        shaders = "common/fullscreen.vert", "output/output.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines=defines))

    def draw(self, frame: Frame, params: OutputParams) -> None:
        """Draw `lit` of `frame` into `screen`, exposed and tone-mapped as `params` say."""
        frame.targets.lit_texture.use(0)
        samples = frame.common.aa.samples
        # A loop over one sample costs software rasterisers four times as much as none.
        defines = (params.tone_mapping.upper(), *(("SUPERSAMPLED",) if samples > 1 else ()))
        self._programs[defines].set(lit_texture=0, samples=samples, exposure=2.0**params.exposure)
        with self.gl.state(into=frame.targets.screen):
            self._programs[defines].fill()
