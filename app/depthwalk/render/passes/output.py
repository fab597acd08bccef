"""Linear light to the screen's sRGB; where pixels have several samples, their mean."""

import moderngl

from depthwalk.gpu.program import Program
from depthwalk.render.antialiasing import samples
from depthwalk.render.frame import Frame, Pass


class OutputPass(Pass):
    name = "output"
    reads = ("lit",)
    writes = ("screen",)

    def setup(self) -> None:
        self._program = Program(self.gl, "common/fullscreen.vert", "output/output.frag")
        self._array = self.gl.vertex_array(self._program.gl, [])

    def draw(self, frame: Frame) -> None:
        frame.screen.use()
        self.gl.device.context.enable_only(moderngl.NOTHING)
        frame.targets.lit_texture.use(0)
        self._program.set(lit_texture=0, samples=samples(frame.settings))
        self._array.render(moderngl.TRIANGLES, vertices=3)
