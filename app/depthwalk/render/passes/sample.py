"""Copy one sample of each pixel from the multisampled targets into the G-buffer, visibility and depth buffer.

With hardware multisampling, the passes from here to `resolve` run once for each sample and see only that one.
"""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import ALWAYS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass


class SamplePass(Pass[Params]):
    """Copy the sample numbered `frame.sample` of the multisampled targets."""

    name = "sample"
    per_sample = True
    reads = ("samples",)
    writes = ("surface", "visibility", "depth", "tile_light")

    def setup(self, gl: Scope) -> None:
        """Create the program, which `gl` owns."""
        self._programs = Variants(lambda defines: Program(gl, "common/fullscreen.vert", "sample/sample.frag", defines))

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether pixels of `frame` have several samples; `params` is empty."""
        return frame.targets.samples > 1

    def draw(self, frame: Frame, params: Params) -> None:
        """Copy the present sample of `frame` into surfaces, visibility and depth; `params` is empty."""
        drawn, lit = frame.targets.drawn, frame.common.lit_tiles
        textures = {
            "surface_samples": drawn.surface,
            "visibility_samples": drawn.visibility_texture,
            "depth_samples": drawn.depth,
        }
        if drawn.tile_light is not None:
            textures["tile_light_samples"] = drawn.tile_light
        program = self._programs[("LIT",) if lit else ()]
        program.set(number=frame.sample)
        for unit, (name, texture) in enumerate(textures.items()):
            texture.use(unit)
            program.set(**{name: unit})
        with self.gl.state(into=frame.targets.one_lit_sample if lit else frame.targets.one_sample, depth_test=ALWAYS):
            program.fill()
