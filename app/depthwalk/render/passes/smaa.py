"""Smooth the edges of brightness in `lit` along the lines that they approximate: SMAA 1x.

Subpixel morphological anti-aliasing, Jimenez, Echevarria, Sousa and Gutierrez 2012, in its three steps: find edges
(§4.1), weigh the areas that a line cuts off the pixels beside them (§4.2, §4.3), blend by these weights (§4.4).
Diagonal patterns are left out; see docs/anti-aliasing.md.
"""

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame, Pass
from depthwalk.scene.effect_settings import SmaaParams


class SmaaPass(Pass[SmaaParams]):
    """Anti-alias the picture in three steps: edges, weights, blending."""

    name = "smaa"
    reads = ("lit",)
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Create the programs of the three steps, which `gl` owns."""
        shaders = (f"smaa/{step}.frag" for step in ("edges", "weights", "blend"))
        self._programs = [Program(gl, "common/fullscreen.vert", shader) for shader in shaders]
        self._own: list[tuple[moderngl.Texture, moderngl.Framebuffer]] = []  # edges and weights, created on first use

    def resize(self, size: tuple[int, int]) -> None:
        """Drop the textures of edges and weights; new ones of `size` (width, height) pixels are created when needed."""
        for own in self._own:
            self.gl.free(*own)
        self._own = []

    def enabled(self, frame: Frame, params: SmaaParams) -> bool:
        """Return whether the anti-aliasing of `frame` is `smaa`; `params` do not matter."""
        return frame.common.aa.mode == "smaa"

    def draw(self, frame: Frame, params: SmaaParams) -> None:
        """Blend pixels of the target `lit` of `frame` across edges whose contrast reaches `params.edge_threshold`.

        Edges are followed for at most `params.max_search_distance` pixels in either direction.
        """
        if not self._own:
            textures = [self.gl.texture(frame.targets.size, components) for components in (2, 4)]
            self._own = [(texture, self.gl.framebuffer([texture])) for texture in textures]
        for unit, texture in enumerate((frame.targets.lit_before(), *(texture for texture, _ in self._own))):
            texture.use(unit)
        find, weigh, blend = self._programs
        find.set(lit_texture=0, contrast=params.edge_threshold)
        weigh.set(edge_texture=1, longest=params.max_search_distance)
        blend.set(lit_texture=0, weight_texture=2)
        for _, own in self._own:
            own.clear()
        for program, target in zip(self._programs, (*(own for _, own in self._own), frame.targets.lit), strict=True):
            with self.gl.state(into=target):
                program.fill()
