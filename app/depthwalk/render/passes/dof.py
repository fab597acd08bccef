"""Simulate the depth of field of a thin lens: blur `lit` by the circles of confusion that follow from depth.

There are three methods. `paper`: Huang, Lu, He and Cai, *Real-time depth-of-field simulation on GPU*, 2008 (formulas 1,
2 and 5). `gather`: rays to the lens through the depth buffer, Lee, Eisemann and Seidel, *Real-Time Lens Blur Effects
and Focus Control*, 2010. `accumulate`: the mean of frames seen from points of the lens, Haeberli and Akeley, *The
Accumulation Buffer*, 1990.
"""

from collections.abc import Iterable, Iterator

import moderngl
import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame
from depthwalk.render.lens_gather import LensGather
from depthwalk.render.pixel_source import ColourFunctions, PixelSource
from depthwalk.render.view.lens import DISC, circle_radius, gaussian, largest_radius, lens_views
from depthwalk.render.view.view import View
from depthwalk.scene.effect_settings import DofParams


class DofPass(PixelSource[DofParams]):
    """Replace the target `lit` by the picture seen through the lens, sharp only at the focus distance."""

    name = "dof"
    reads = ("depth", "lit")
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Create the programs, which `gl` owns."""
        self._programs = {
            name: Program(gl, "common/fullscreen.vert", f"dof/{name}.frag") for name in ("blur", "paper", "scaled")
        }
        self._gather = LensGather(gl)
        self._pictures: dict[str, tuple[moderngl.Texture, moderngl.Framebuffer]] = {}

    def resize(self, size: tuple[int, int]) -> None:
        """Drop the intermediate textures; those for targets of `size` (width, height) pixels are made when needed."""
        for texture, framebuffer in self._pictures.values():
            self.gl.free(framebuffer, texture)
        self._pictures.clear()
        self._gather.release()

    def views(self, view: View, params: DofParams) -> Iterable[View]:
        """Return the views from points all over the lens if the mode of `params` is `accumulate`, else `view` alone."""
        return lens_views(view, params)

    def enabled(self, frame: Frame, params: DofParams) -> bool:
        """Return whether `params` choose a mode of depth of field; `frame` does not matter."""
        return params.mode != "none"

    def fuses_with_next(self, frame: Frame, params: DofParams) -> bool:
        """Return whether `params` choose `gather`, the mode that can call later passes, and `frame` is opaque.

        In a transparent picture colours cannot be magnified without their alpha.
        """
        return params.mode == "gather" and not frame.transparent

    def parts_with(self, frame: Frame, params: DofParams, following: ColourFunctions) -> Iterator[None]:
        """Draw `frame` as the lens of `params` sees it, through `following`, in one part."""
        self._gather.draw(frame.targets, params.samples, _circles(frame, params), following)
        yield from ()

    def draw(self, frame: Frame, params: DofParams) -> None:
        """Blur the target `lit` of `frame` by the mode and the lens that `params` describe."""
        match params.mode:
            case "paper":
                self._draw_paper(frame, params)
            case "gather":
                self._gather.draw(frame.targets, params.samples, _circles(frame, params))
            case "accumulate":
                self._add(frame)

    def _draw_paper(self, frame: Frame, params: DofParams) -> None:
        targets, circles = frame.targets, _circles(frame, params)
        near, far = circle_radius(params, frame.view, np.array(frame.view.depth_range))
        max_radius = max(min(max(abs(near), abs(far)), circles["largest"]), 1e-6)  # formula (3)
        before = targets.lit_before()
        weights, step = gaussian().tolist(), frame.common.aa.samples  # one pixel of the finished picture
        before.use(1)
        self._run("blur", "across", targets.size, 4, picture=1, along=(step, 0), weights=weights).use(1)
        self._run("blur", "blurred", targets.size, 4, picture=1, along=(0, step), weights=weights).use(1)
        targets.depth.use(0)
        before.use(2)
        self._fill(targets.lit, "paper", lit_texture=2, blurred_texture=1, disc=DISC, max_radius=max_radius, **circles)

    def _add(self, frame: Frame) -> None:
        """Replace the frame by the mean of all frames up to it, so that the last is the mean of all."""
        total, framebuffer = self._picture("total", frame.targets.size, 4)
        if frame.lens_point == 0:
            framebuffer.clear()
        frame.targets.lit_texture.use(0)
        with self.gl.state(blend=(moderngl.ONE, moderngl.ONE)):
            self._fill(framebuffer, "scaled", picture=0, factor=1.0)
        total.use(0)
        self._fill(frame.targets.lit, "scaled", picture=0, factor=1 / (frame.lens_point + 1))

    def _run(
        self, program: str, name: str, size: tuple[int, int], components: int, **uniforms: object
    ) -> moderngl.Texture:
        """Draw into this pass's texture `name`, created on first use, and return it."""
        texture, framebuffer = self._picture(name, size, components)
        self._fill(framebuffer, program, **uniforms)
        return texture

    def _fill(self, into: moderngl.Framebuffer, program: str, **uniforms: object) -> None:
        self._programs[program].set(**uniforms)
        with self.gl.state(into=into):
            self._programs[program].fill()

    def _picture(
        self, name: str, size: tuple[int, int], components: int
    ) -> tuple[moderngl.Texture, moderngl.Framebuffer]:
        if name not in self._pictures:
            texture = self.gl.texture(size, components, "f4")
            self._pictures[name] = texture, self.gl.framebuffer([texture])
        return self._pictures[name]


def _circles(frame: Frame, params: DofParams) -> dict[str, float | tuple[float, ...]]:
    """Return the uniforms of shaders/dof/circle.glsl."""
    near, far, sky = circle_radius(params, frame.view, np.array([*frame.view.depth_range, np.inf]))
    largest = largest_radius(params, frame.view)
    return {"depth_texture": 0, "circle_from_depth": (near, far - near, sky), "largest": largest}
