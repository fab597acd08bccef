"""Gather what a lens sees of each pixel, as finely as its circle of confusion asks for (`render.dof.mode: gather`).

Rays go to points of the lens through the depth buffer (Lee, Eisemann and Seidel, *Real-Time Lens Blur Effects and Focus
Control*, 2010). A wide circle leaves nothing fine in the picture: it is gathered in one of half or a quarter of the
width and height, and shown magnified. Tiles of the picture are classified by the circles that reach them (McGuire et
al. 2012; Jimenez, *Next Generation Post Processing in Call of Duty: Advanced Warfare*, 2014), and each class is drawn
by a program of its own, since a software rasteriser computes both sides of a branch. `reference/dof.py` is the twin.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import moderngl

from depthwalk.gpu.device import PROGRAM_POINT_SIZE, Scope
from depthwalk.gpu.program import Program
from depthwalk.render.targets import Targets
from depthwalk.render.view.lens import HIGHEST_MIP, TILE, TileClass


@dataclass(frozen=True, kw_only=True)
class _Reduced:
    """Hold a reduced picture.

    Attributes
    ----------
    block : pixels of the whole picture along one of its pixels.
    colour : linear light, premultiplied, with mip-maps.
    circles : radius; the least and the greatest of the block; pixels of the whole picture.
    surfaces : what draws into both.
    gathered : what the lens sees, of the tiles that are gathered in this picture.
    lens : what draws into that.
    """

    block: int
    colour: moderngl.Texture
    circles: moderngl.Texture
    surfaces: moderngl.Framebuffer
    gathered: moderngl.Texture
    lens: moderngl.Framebuffer


@dataclass(frozen=True, kw_only=True)
class _Classes:
    """Hold what a frame's tiles are classified by.

    Attributes
    ----------
    found : the extremes of each tile.
    ranges : what may reach into each tile, see shaders/dof/spread.frag.
    into_found, into_ranges : what draws into them.
    """

    found: moderngl.Texture
    ranges: moderngl.Texture
    into_found: moderngl.Framebuffer
    into_ranges: moderngl.Framebuffer


class LensGather:
    """Own the programs and textures of the mode `gather`, made when they are first needed.

    Parameters
    ----------
    gl : creates them, and frees them when the pass is released.
    """

    def __init__(self, gl: Scope) -> None:
        self._gl = gl
        whole, tile = "common/fullscreen.vert", "dof/tile.vert"
        self._programs = {
            "reduce_first": Program(gl, whole, "dof/reduce.frag", ("FIRST",)),
            "reduce": Program(gl, whole, "dof/reduce.frag"),
            "tiles": Program(gl, whole, "dof/tiles.frag"),
            "spread": Program(gl, whole, "dof/spread.frag"),
            "reduced_even": Program(gl, tile, "dof/reduced.frag", ("EVEN_TILES",)),
            "reduced": Program(gl, tile, "dof/reduced.frag"),
            "upsample": Program(gl, tile, "dof/upsample.frag"),
            "even": Program(gl, tile, "dof/even.frag"),
            "gather": Program(gl, tile, "dof/gather.frag"),
        }
        self._size = 0, 0
        self._reduced: tuple[_Reduced, ...] = ()
        self._classes: _Classes | None = None

    def release(self) -> None:
        """Free the textures, as before targets of another size."""
        for made in (*self._reduced, *([self._classes] if self._classes else [])):
            textures = [each for each in vars(made).values() if isinstance(each, moderngl.Texture)]
            framebuffers = [each for each in vars(made).values() if isinstance(each, moderngl.Framebuffer)]
            self._gl.free(*framebuffers, *textures)
        self._reduced, self._classes = (), None

    def draw(self, targets: Targets, samples: int, circles: Mapping[str, Any]) -> None:
        """Replace the target `lit` by what the lens sees.

        Parameters
        ----------
        targets : the picture: `depth`, `lit`.
        samples : the most rays of a pixel.
        circles : the uniforms of shaders/dof/circle.glsl, by which depth is at texture unit 0.
        """
        if self._classes is None:
            self._create(targets.size)
        assert self._classes is not None  # `_create` made it
        before, (half, quarter) = targets.lit_before(), self._reduced
        targets.depth.use(0)
        before.use(2)
        self._fill(half.surfaces, "reduce_first", lit_texture=2, **circles)
        half.colour.build_mipmaps(max_level=HIGHEST_MIP)
        half.circles.use(1)
        half.colour.use(3)
        self._fill(quarter.surfaces, "reduce", lit_texture=3, circles_texture=1)
        quarter.colour.build_mipmaps(max_level=HIGHEST_MIP)
        self._classify(self._classes, quarter, circles["largest"])
        self._gather_reduced(quarter, targets, TileClass.QUARTER_EVEN, TileClass.QUARTER, samples=samples)
        self._gather_reduced(half, targets, TileClass.HALF_EVEN, TileClass.HALF, TileClass.MIXED, samples=samples)
        whole: dict[str, Any] = {"lit_texture": 2, "samples": samples, **circles}
        self._tiles(targets.lit, "even", TILE, TileClass.EVEN, **whole)
        near: dict[str, Any] = {"gathered_texture": 4, "circles_texture": 1}  # of half the size
        self._tiles(targets.lit, "gather", TILE, TileClass.MIXED, **near, **whole)

    def _gather_reduced(
        self, picture: _Reduced, targets: Targets, even: TileClass, traced: TileClass, lent: int = 0, *, samples: int
    ) -> None:
        """Gather the tiles of the classes `even`, `traced` and `lent` in `picture`; show the first two.

        Its circles and what was gathered stay at texture units 1 and 4.
        """
        picture.colour.use(3)
        picture.circles.use(1)
        side = TILE // picture.block
        reduced: dict[str, Any] = {"colour_texture": 3, "circles_texture": 1, "block": picture.block}
        reduced |= {"samples": samples}
        self._tiles(picture.lens, "reduced_even", side, even, **reduced)
        self._tiles(picture.lens, "reduced", side, traced | lent, beside=even | traced | lent, left_out=even, **reduced)
        picture.gathered.use(4)
        shown: dict[str, Any] = {"gathered_texture": 4, "block": picture.block}
        self._tiles(targets.lit, "upsample", TILE, even | traced, **shown)

    def _classify(self, classes: _Classes, quarter: _Reduced, largest: float) -> None:
        """Find the circles that may reach each tile; leave their texture at unit 5."""
        quarter.circles.use(1)
        self._fill(classes.into_found, "tiles", circles_texture=1, tile_side=TILE // quarter.block)
        classes.found.use(5)
        self._fill(classes.into_ranges, "spread", tile_texture=5, tile_side=TILE, largest=largest)
        classes.ranges.use(5)

    def _create(self, size: tuple[int, int]) -> None:
        """Create the textures for targets of `size` (width, height) pixels."""
        half, quarter = (self._reduce(size, block) for block in (2, 4))
        self._reduced = half, quarter
        tiles = -(-size[0] // TILE), -(-size[1] // TILE)
        found, ranges = self._gl.texture(tiles, 4, "f4"), self._gl.texture(tiles, 4, "f4")
        into = [self._gl.framebuffer([texture]) for texture in (found, ranges)]
        self._classes = _Classes(found=found, ranges=ranges, into_found=into[0], into_ranges=into[1])

    def _reduce(self, size: tuple[int, int], block: int) -> _Reduced:
        """Create a picture for targets of `size` pixels, each of whose pixels stands for `block`² of theirs."""
        small = -(-size[0] // block), -(-size[1] // block)
        # Software rasterisers take halfs apart one by one; of reduced pictures, floats are small enough.
        colour, circles, gathered = (self._gl.texture(small, 4, "f4") for _ in range(3))
        colour.build_mipmaps(max_level=HIGHEST_MIP)
        colour.filter = moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR
        gathered.filter = moderngl.LINEAR, moderngl.LINEAR
        surfaces, lens = self._gl.framebuffer([colour, circles]), self._gl.framebuffer([gathered])
        return _Reduced(block=block, colour=colour, circles=circles, surfaces=surfaces, gathered=gathered, lens=lens)

    def _fill(self, into: moderngl.Framebuffer, program: str, **uniforms: Any) -> None:
        self._programs[program].set(**uniforms)
        with self._gl.state(into=into):
            self._programs[program].fill()

    def _tiles(
        self,
        into: moderngl.Framebuffer,
        program: str,
        side: int,
        drawn: int,
        beside: int = 0,
        left_out: int = 0,
        **uniforms: Any,
    ) -> None:
        """Draw the tiles whose class is one of the bits `drawn`, and those next to `beside` that are not `left_out`.

        side: of a tile, pixels of `into`.
        """
        assert self._classes is not None  # `draw` made it
        across, up = self._classes.ranges.size
        self._programs[program].set(
            range_texture=5,
            tile_side=side,
            drawn_class=int(drawn),
            beside_class=int(beside),
            left_out=int(left_out),
            **uniforms,
        )
        viewport = into.viewport
        # A point is dropped whose middle is outside, as that of a tile which the picture's edge cuts off may be.
        into.viewport = 0, 0, across * side, up * side
        try:
            with self._gl.state(into=into, direct=(PROGRAM_POINT_SIZE,)):
                self._programs[program].points(across * up)
        finally:
            into.viewport = viewport
