"""Blend pixels that depth images cover only in part with what is behind them: the silhouettes' anti-aliasing.

`composite` found which part of a pixel is uncovered (shaders/composite/partial_coverage.glsl) and stored it in the
visibility buffer. The pixel becomes mix(picture, behind, uncovered), where `behind` is the mean of the neighbours that
are farther away. See docs/anti-aliasing.md.
"""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program, Variants
from depthwalk.params import Params
from depthwalk.render.blended_picture import blending_defines, covered_pixels, picture_before
from depthwalk.render.depth_framebuffers import DepthFramebuffers
from depthwalk.render.draw.material_depth import FULL_COVERAGE
from depthwalk.render.frame import Frame, Pass


class CoveragePass(Pass[Params]):
    """Anti-alias the silhouettes of depth images by the coverage that `composite` found."""

    name = "coverage"
    blends_shown = True
    reads = ("visibility", "depth", "material_depth", "lit", "screen")
    writes = ("lit", "screen")

    def setup(self, gl: Scope) -> None:
        """Prepare the variants of the program, and the framebuffers; `gl` owns them."""
        shaders = "common/rectangle.vert", "coverage/coverage.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines=defines))
        self._with_depth = DepthFramebuffers(gl)

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether `frame` has depth images and is anti-aliased by their coverage; `params` is empty."""
        return frame.common.aa.covering and frame.materials is not None and len(frame.materials.assets) > 0

    def draw(self, frame: Frame, params: Params) -> None:
        """Blend the pixels that `material_resolve` marked in `frame` as partly covered; `params` is empty."""
        targets, materials = frame.targets, frame.materials
        assert materials is not None  # as `enabled` has checked
        for unit, texture in enumerate((picture_before(frame), targets.visibility_texture, targets.depth)):
            texture.use(unit)
        program = self._programs[blending_defines(frame)]
        program.set(before_texture=0, visibility_texture=1, depth_texture=2)
        program.set(depth=FULL_COVERAGE, corners=(*materials.low.min(0), *materials.high.max(0)))
        # In front of full coverage are the pixels that `material_resolve` marked as covered in part.
        into = covered_pixels(frame, self._with_depth)
        with self.gl.state(into=into, depth_test=">", depth_write=False):
            program.rectangles()
