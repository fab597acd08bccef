"""Average the samples of each pixel in linear light, and take the depth of the nearest.

With hardware multisampling the passes before this one run once per sample, and each time this one adds their `lit`,
divided by the number of samples, to a sum; after the last sample the sum replaces `lit`.
"""

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.gpu.state import ALWAYS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass


class ResolvePass(Pass[Params]):
    """Replace `lit` by the mean of its samples, and `depth` by the nearest of them, after the last sample."""

    name = "resolve"
    per_sample = True
    reads = ("lit", "samples")
    writes = ("lit", "depth")

    def setup(self, gl: Scope) -> None:
        """Create the programs, which `gl` owns."""
        self._add = Program(gl, "common/fullscreen.vert", "resolve/add.frag")
        self._resolve = Program(gl, "common/fullscreen.vert", "resolve/resolve.frag")
        self._mean: tuple[moderngl.Texture, moderngl.Framebuffer] | None = None  # made when it is first needed

    def resize(self, size: tuple[int, int]) -> None:
        """Drop the texture of the sum; one for targets of `size` (width, height) pixels is created when needed."""
        if self._mean is not None:
            self.gl.free(*reversed(self._mean))
        self._mean = None

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether pixels of `frame` have several samples; `params` is empty."""
        return frame.targets.samples > 1

    def draw(self, frame: Frame, params: Params) -> None:
        """Add the light of one sample of `frame` to the sum; after the last sample replace `lit` and `depth`.

        `params` is empty.
        """
        targets = frame.targets
        if self._mean is None:
            texture = self.gl.texture(targets.size, 4, "f2")
            self._mean = texture, self.gl.framebuffer([texture])
        texture, framebuffer = self._mean
        if frame.sample == 0:
            framebuffer.clear()
        targets.lit_texture.use(0)
        self._add.set(lit_texture=0, samples=targets.samples)
        with self.gl.state(into=framebuffer, blend=(moderngl.ONE, moderngl.ONE)):
            self._add.fill()
        if frame.sample == targets.samples - 1:
            texture.use(0)
            targets.drawn.depth.use(1)
            self._resolve.set(mean_texture=0, depth_samples=1, samples=targets.samples)
            with self.gl.state(into=targets.lighting, depth_test=ALWAYS):
                self._resolve.fill()
