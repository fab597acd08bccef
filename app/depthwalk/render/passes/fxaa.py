"""Fast approximate anti-aliasing (Lottes 2009): the lit picture is blurred along edges of brightness."""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame, Pass
from depthwalk.scene.render_settings import FxaaParams


class FxaaPass(Pass[FxaaParams]):
    name = "fxaa"
    reads = ("lit",)
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        self._program = Program(gl, "common/fullscreen.vert", "fxaa/fxaa.frag")

    def enabled(self, frame: Frame, params: FxaaParams) -> bool:
        return frame.common.aa.mode == "fxaa"

    def draw(self, frame: Frame, params: FxaaParams) -> None:
        frame.targets.lit_before().use(0)
        self._program.set(lit_texture=0, contrast=params.edge_threshold)
        with self.gl.state(into=frame.targets.lit):
            self._program.fill()
