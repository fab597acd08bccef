"""Blur what is out of focus, as a thin lens does, by one of three methods.

`paper`: Huang, Lu, He and Cai, *Real-time depth-of-field simulation on GPU*, 2008. `gather`: rays to the lens through
the depth buffer, Lee, Eisemann and Seidel, *Real-Time Lens Blur Effects and Focus Control*, 2010. `accumulate`:
Haeberli and Akeley, *The Accumulation Buffer*, 1990.
"""

from collections.abc import Iterable

import moderngl
import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.view.lens import COARSENESS, TileClass, DISC, circle_radius, gaussian, largest_radius, lens_views
from depthwalk.render.view.view import View
from depthwalk.scene.render_settings import DofParams

TILE = 16  # pixels along a tile of the picture, of which the range of circles is found first


class DofPass(Pass[DofParams]):
    """Replace the target `lit` by the picture that the lens gives of it, sharp only at the focus distance."""

    name = "dof"
    reads = ("depth", "lit")
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Create the programs, which `gl` owns."""
        self._programs = {
            name: Program(gl, "common/fullscreen.vert", f"dof/{name}.frag")
            for name in ("reduce", "tiles", "spread", "blur", "paper", "scaled")
        }
        for name in ("coarse", "upsample", "even", "gather"):
            self._programs[name] = Program(gl, "dof/tile.vert", f"dof/{name}.frag")
        self._programs["coarse_even"] = Program(gl, "dof/tile.vert", "dof/coarse.frag", ("EVEN_TILES",))
        self._programs["prefiltered"] = Program(gl, "dof/tile.vert", "dof/even.frag", ("PREFILTERED",))
        self._pictures: dict[str, tuple[moderngl.Texture, moderngl.Framebuffer]] = {}

    def resize(self, size: tuple[int, int]) -> None:
        """Drop the intermediate textures; those for targets of `size` (width, height) pixels are made when needed."""
        for texture, framebuffer in self._pictures.values():
            self.gl.free(framebuffer, texture)
        self._pictures.clear()

    def views(self, view: View, params: DofParams) -> Iterable[View]:
        """Return the views from points all over the lens if the mode of `params` is `accumulate`, else `view` alone."""
        return lens_views(view, params)

    def enabled(self, frame: Frame, params: DofParams) -> bool:
        """Return whether `params` choose a mode of depth of field; `frame` does not matter."""
        return params.mode != "none"

    def draw(self, frame: Frame, params: DofParams) -> None:
        """Blur the target `lit` of `frame` by the mode and the lens that `params` describe."""
        match params.mode:
            case "paper":
                self._draw_paper(frame, params)
            case "gather":
                self._draw_gather(frame, params)
            case "accumulate":
                self._add(frame)

    def _draw_gather(self, frame: Frame, params: DofParams) -> None:
        targets, circles = frame.targets, _circles(frame, params)
        tiles = -(-targets.size[0] // TILE), -(-targets.size[1] // TILE)
        before = targets.lit_before()
        targets.depth.use(0)
        before.use(2)
        colour, block = self._reduce(targets.size, circles)
        block.use(3)
        self._run("tiles", "tiles", tiles, 4, circles_texture=3, tile_side=TILE // COARSENESS).use(1)
        spread = {"tile_texture": 1, "tile_side": TILE, "largest": circles["largest"]}
        self._run("spread", "spread", tiles, 4, **spread).use(1)
        colour.use(4)
        across = {"range_texture": 1, "tiles_across": (targets.size[0] / TILE, targets.size[1] / TILE)}
        coarse, into = self._picture("coarse", colour.size, 4)
        coarse.filter = moderngl.LINEAR, moderngl.LINEAR
        fine = {"colour_texture": 4, "circles_texture": 3, "tile_side": TILE // COARSENESS, **across}
        self._tiles(into, "coarse_even", TileClass.WIDE_EVEN, tiles, **fine)
        self._tiles(into, "coarse", TileClass.WIDE | TileClass.MIXED, tiles, **fine)
        coarse.use(4)
        sizes = {"samples": params.samples, "lit_texture": 2, **across, **circles}
        self._tiles(targets.lit, "upsample", TileClass.WIDE | TileClass.WIDE_EVEN, tiles, coarse_texture=4, **across)
        colour.use(4)
        self._tiles(targets.lit, "even", TileClass.EVEN, tiles, **sizes)
        self._tiles(targets.lit, "prefiltered", TileClass.PREFILTERED, tiles, **(sizes | {"lit_texture": 4}))
        coarse.use(4)
        self._tiles(targets.lit, "gather", TileClass.MIXED, tiles, tile_side=TILE, coarse_texture=4, circles_texture=3, **sizes)

    def _tiles(self, into, program, tile_class, tiles, **uniforms):
        self._programs[program].set(tile_class=int(tile_class), **uniforms)
        with self.gl.state(into=into):
            self._programs[program].rectangles(tiles[0] * tiles[1])

    def _reduce(self, size, circles):
        if "reduced" not in self._pictures:
            coarse = tuple(-(-n // COARSENESS) for n in size)
            colour, block = self.gl.texture(coarse, 4, "f4"), self.gl.texture(coarse, 4, "f4")
            colour.build_mipmaps(max_level=2)
            colour.filter = moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR
            self._pictures["block"] = block, self.gl.framebuffer([colour, block])
            self._pictures["reduced"] = colour, self.gl.framebuffer([colour])
        self._fill(self._pictures["block"][1], "reduce", lit_texture=2, **circles)
        colour, block = self._pictures["reduced"][0], self._pictures["block"][0]
        colour.build_mipmaps(max_level=2)
        return colour, block

    def _draw_paper(self, frame: Frame, params: DofParams) -> None:
        targets, circles = frame.targets, _circles(frame, params)
        near, far = circle_radius(params, frame.view, np.array(frame.view.depth_range))
        max_radius = max(min(max(abs(near), abs(far)), circles["largest"]), 1e-6)  # formula (3)
        before = targets.lit_before()
        weights, step = gaussian().tolist(), frame.common.aa.samples  # from one pixel of the finished picture on
        before.use(1)
        self._run("blur", "across", targets.size, 4, picture=1, along=(step, 0), weights=weights).use(1)
        self._run("blur", "blurred", targets.size, 4, picture=1, along=(0, step), weights=weights).use(1)
        targets.depth.use(0)
        before.use(2)
        self._fill(targets.lit, "paper", lit_texture=2, blurred_texture=1, disc=DISC, max_radius=max_radius, **circles)

    def _add(self, frame: Frame) -> None:
        """Replace the frame by the mean of all up to it: the last is the mean of all."""
        total, framebuffer = self._picture("total", frame.targets.size, 4)
        if frame.lens_point == 0:
            framebuffer.clear()
        frame.targets.lit_texture.use(0)
        with self.gl.state(blend=(moderngl.ONE, moderngl.ONE)):
            self._fill(framebuffer, "scaled", picture=0, factor=1.0)
        total.use(0)
        self._fill(frame.targets.lit, "scaled", picture=0, factor=1 / (frame.lens_point + 1))

    def _run(
        self, program: str, name: str, size: tuple[int, int], components: int, dtype: str = "f4", **uniforms: object
    ) -> moderngl.Texture:
        """Draw into the texture `name` of this pass, made when it is first needed; return it."""
        texture, framebuffer = self._picture(name, size, components, dtype)
        self._fill(framebuffer, program, **uniforms)
        return texture

    def _fill(self, into: moderngl.Framebuffer, program: str, **uniforms: object) -> None:
        self._programs[program].set(**uniforms)
        with self.gl.state(into=into):
            self._programs[program].fill()

    def _picture(
        self, name: str, size: tuple[int, int], components: int, dtype: str = "f4"
    ) -> tuple[moderngl.Texture, moderngl.Framebuffer]:
        if name not in self._pictures:
            texture = self.gl.texture(size, components, dtype)
            self._pictures[name] = texture, self.gl.framebuffer([texture])
        return self._pictures[name]


def _circles(frame: Frame, params: DofParams) -> dict[str, float | tuple[float, ...]]:
    """Return the uniforms of shaders/dof/circle.glsl."""
    near, far, sky = circle_radius(params, frame.view, np.array([*frame.view.depth_range, np.inf]))
    largest = largest_radius(params, frame.view)
    return {"depth_texture": 0, "circle_from_depth": (near, far - near, sky), "largest": largest}
