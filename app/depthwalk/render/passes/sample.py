"""Copy one sample of each pixel into the G-buffer, so that the passes after it know of one alone."""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.gpu.state import ALWAYS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass


class SamplePass(Pass[Params]):
    """Copy the sample numbered `frame.sample` of what objects and ground were drawn into."""

    name = "sample"
    per_sample = True
    reads = ("samples",)
    writes = ("albedo", "surface", "visibility", "depth")

    def setup(self, gl: Scope) -> None:
        """Create the program, which `gl` owns."""
        self._program = Program(gl, "common/fullscreen.vert", "sample/sample.frag")

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether pixels of `frame` have several samples; `params` is empty."""
        return frame.targets.samples > 1

    def draw(self, frame: Frame, params: Params) -> None:
        """Copy the present sample of `frame` into albedo, normals, visibility and depth; `params` is empty."""
        drawn = frame.targets.drawn
        for unit, texture in enumerate((drawn.albedo, drawn.surface, drawn.visibility_texture, drawn.depth)):
            texture.use(unit)
        names = "albedo_samples", "surface_samples", "visibility_samples", "depth_samples"
        self._program.set(number=frame.sample, **{name: unit for unit, name in enumerate(names)})
        with self.gl.state(into=frame.targets.one_sample, depth_test=ALWAYS):
            self._program.fill()
