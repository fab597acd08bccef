"""Anti-aliasing of depth images: what one covers in part blends with what is behind. See docs/anti-aliasing.md."""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.params import Params
from depthwalk.render.draw.material_depth import FULL_COVERAGE
from depthwalk.render.frame import Frame, Pass


class CoveragePass(Pass[Params]):
    name = "coverage"
    reads = ("visibility", "depth", "material_depth", "lit")
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        self._program = Program(gl, "common/rectangle.vert", "coverage/coverage.frag")

    def enabled(self, frame: Frame, params: Params) -> bool:
        return frame.common.aa.covering and frame.shading is not None and len(frame.shading.assets) > 0

    def draw(self, frame: Frame, params: Params) -> None:
        targets, shading = frame.targets, frame.shading
        assert shading is not None  # says `enabled`
        for unit, texture in enumerate((targets.lit_before(), targets.visibility_texture, targets.depth)):
            texture.use(unit)
        self._program.set(lit_texture=0, visibility_texture=1, depth_texture=2)
        self._program.set(level=FULL_COVERAGE, low=tuple(shading.low.min(0)), high=tuple(shading.high.max(0)))
        # What `material_resolve` has marked as covered in part is in front.
        with self.gl.state(into=targets.covered, depth_test=">", depth_write=False):
            self._program.rectangles()
