"""Blur the picture in `lit` along edges of brightness: fast approximate anti-aliasing (Lottes 2009).

Nothing but colours goes in, so that edges within textures are blurred, too.
"""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame, Pass
from depthwalk.scene.effect_settings import FxaaParams


class FxaaPass(Pass[FxaaParams]):
    """Anti-alias the picture by FXAA."""

    name = "fxaa"
    reads = ("lit",)
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Create the program, which `gl` owns."""
        self._program = Program(gl, "common/fullscreen.vert", "fxaa/fxaa.frag")

    def enabled(self, frame: Frame, params: FxaaParams) -> bool:
        """Return whether the anti-aliasing of `frame` is `fxaa`; `params` do not matter."""
        return frame.common.aa.mode == "fxaa"

    def draw(self, frame: Frame, params: FxaaParams) -> None:
        """Blur the target `lit` of `frame` along edges whose contrast reaches `params.edge_threshold`."""
        frame.targets.lit_before().use(0)
        self._program.set(lit_texture=0, contrast=params.edge_threshold)
        with self.gl.state(into=frame.targets.lit):
            self._program.fill()
