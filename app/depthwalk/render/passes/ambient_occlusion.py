"""Find which part of the ambient light reaches each pixel past surfaces close by: ambient occlusion.

Jimenez, Wu, Pesce and Jarabo 2016, "Practical Realtime Strategies for Accurate Indirect Occlusion". Only what the
picture shows can hide anything.
"""

from collections.abc import Iterator

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.lighting.ambient_visibility import AmbientVisibility
from depthwalk.render.target_table import TARGETS
from depthwalk.scene.effect_settings import AmbientOcclusionParams


class AmbientOcclusionPass(Pass[AmbientOcclusionParams]):
    """Draw the target `ambient_visibility`: an estimate for every second pixel of every second row, then smoothed."""

    name = "ambient_occlusion"
    per_sample = True
    reads = ("surface", "depth", "ambient_visibility")
    writes = ("ambient_visibility",)

    def setup(self, gl: Scope) -> None:
        """Create the programs of the two steps, which `gl` owns."""
        self._estimate, self._smooth = (
            Program(gl, "common/fullscreen.vert", f"ambient_occlusion/{step}.frag") for step in ("estimate", "smooth")
        )
        self._own: list[tuple[moderngl.Texture, moderngl.Framebuffer]] = []  # estimate and result, made on first use

    def resize(self, size: tuple[int, int]) -> None:
        """Drop the textures; new ones for a picture of `size` (width, height) pixels are created when needed."""
        for own in self._own:
            self.gl.free(*own)
        self._own = []

    def enabled(self, frame: Frame, params: AmbientOcclusionParams) -> bool:
        """Return whether `params` ask for it, or `frame` still has the visibility of an earlier one, to be dropped."""
        return params.enabled or frame.targets.ambient_visibility is not None

    def draw(self, frame: Frame, params: AmbientOcclusionParams) -> None:
        """Draw the visibility in `frame`, as exactly as `params` say."""
        for _ in self.parts(frame, params):
            pass

    def parts(self, frame: Frame, params: AmbientOcclusionParams) -> Iterator[None]:
        """Draw as `draw` does; stop between the two steps."""
        targets = frame.targets
        if not params.enabled:
            targets.ambient_visibility = None
            return
        if not self._own:
            texture_format = TARGETS["ambient_visibility"].textures["ambient_visibility"]
            half = -(-targets.size[0] // 2), -(-targets.size[1] // 2)
            made = [texture_format.create(self.gl, half) for _ in range(2)]
            self._own = [(texture, self.gl.framebuffer([texture])) for texture in made]
        (estimate, into_estimate), (result, into_result) = self._own
        units = {"depth_texture": 0, "surface_texture": 1}
        self._use(targets.depth, targets.surface)
        self._estimate.set(**units, radius=params.radius, directions=params.directions, steps=params.steps)
        with self.gl.state(into=into_estimate):
            self._estimate.fill()
        yield
        self._use(targets.depth, targets.surface, estimate)
        self._smooth.set(
            **units, ambient_visibility=2, **AmbientVisibility(texture=estimate, radius=params.radius).uniforms
        )
        with self.gl.state(into=into_result):
            self._smooth.fill()
        targets.ambient_visibility = AmbientVisibility(texture=result, radius=params.radius)

    @staticmethod
    def _use(*textures: moderngl.Texture) -> None:
        for unit, texture in enumerate(textures):
            texture.use(unit)
