"""The mean of a pixel's samples in linear light, where there are several, and the depth of the nearest."""

import moderngl

from depthwalk.gpu.device import ALWAYS
from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame, Pass


class ResolvePass(Pass):
    name = "resolve"
    per_sample = True
    reads = ("lit", "drawn")
    writes = ("lit", "gbuffer")

    def setup(self) -> None:
        self._add = Program(self.gl, "common/fullscreen.vert", "resolve/add.frag")
        self._resolve = Program(self.gl, "common/fullscreen.vert", "resolve/resolve.frag")
        self._mean: tuple[moderngl.Texture, moderngl.Framebuffer] | None = None  # of the samples so far

    def resize(self, size: tuple[int, int]) -> None:
        if self._mean is not None:
            self.gl.free(*reversed(self._mean))
        self._mean = None

    def draw(self, frame: Frame) -> None:
        targets = frame.targets
        if targets.samples == 1:
            return
        if self._mean is None:
            texture = self.gl.texture(targets.size, 4, "f2")
            self._mean = texture, self.gl.framebuffer([texture])
        texture, framebuffer = self._mean
        framebuffer.use()
        if frame.sample == 0:
            framebuffer.clear()
        context = self.gl.device.context
        context.enable_only(moderngl.BLEND)
        context.blend_func = moderngl.ONE, moderngl.ONE
        targets.lit_texture.use(0)
        self._add.set(lit_texture=0, samples=targets.samples)
        self._add.fill()
        if frame.sample == targets.samples - 1:
            targets.lighting.depth_mask = True
            targets.lighting.use()
            context.enable_only(moderngl.DEPTH_TEST)
            context.depth_func = ALWAYS
            texture.use(0)
            targets.drawn.depth.use(1)
            self._resolve.set(mean_texture=0, depth_samples=1, samples=targets.samples)
            self._resolve.fill()
            context.depth_func = "<"
