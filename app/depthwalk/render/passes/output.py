"""Linear light to the screen's sRGB; where pixels have several samples, their mean."""

import moderngl

from depthwalk.gpu.program import Program, Variants
from depthwalk.render.antialiasing import samples
from depthwalk.render.frame import Frame, Pass


class OutputPass(Pass):
    name = "output"
    reads = ("lit",)
    writes = ("screen",)

    def setup(self) -> None:
        shaders = "common/fullscreen.vert", "output/output.frag"
        self._programs = Variants(lambda defines: Program(self.gl, *shaders, defines=defines))
        self._arrays = Variants(lambda defines: self.gl.vertex_array(self._programs[defines].gl, []))

    def draw(self, frame: Frame) -> None:
        frame.screen.use()
        self.gl.device.context.enable_only(moderngl.NOTHING)
        frame.targets.lit_texture.use(0)
        finer = samples(frame.settings)
        # A loop over one sample costs software rasterisers four times as much as none.
        defines = ("SUPERSAMPLED",) if finer > 1 else ()
        self._programs[defines].set(lit_texture=0, **({"samples": finer} if finer > 1 else {}))
        self._arrays[defines].render(moderngl.TRIANGLES, vertices=3)
