"""Blend pixels that a depth image covers in part with what is behind it. See docs/anti-aliasing.md."""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.params import Params
from depthwalk.render.draw.material_depth import FULL_COVERAGE
from depthwalk.render.frame import Frame, Pass


class CoveragePass(Pass[Params]):
    """Anti-alias the silhouettes of depth images by the coverage that `composite` found."""

    name = "coverage"
    reads = ("visibility", "depth", "material_depth", "lit")
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Create the program, which `gl` owns."""
        self._program = Program(gl, "common/rectangle.vert", "coverage/coverage.frag")

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether `frame` has depth images and is anti-aliased by their coverage; `params` is empty."""
        return frame.common.aa.covering and frame.materials is not None and len(frame.materials.assets) > 0

    def draw(self, frame: Frame, params: Params) -> None:
        """Blend the pixels of `lit` that `material_resolve` marked in `frame` as partly covered; `params` is empty."""
        targets, materials = frame.targets, frame.materials
        assert materials is not None  # as `enabled` found
        for unit, texture in enumerate((targets.lit_before(), targets.visibility_texture, targets.depth)):
            texture.use(unit)
        self._program.set(lit_texture=0, visibility_texture=1, depth_texture=2)
        self._program.set(depth=FULL_COVERAGE, low=tuple(materials.low.min(0)), high=tuple(materials.high.max(0)))
        # In front of full coverage are the pixels that `material_resolve` marked as covered in part.
        with self.gl.state(into=targets.covered, depth_test=">", depth_write=False):
            self._program.rectangles()
