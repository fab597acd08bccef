"""Gather what a lens sees of each pixel, as finely as its circle of confusion asks for (`render.dof.mode: gather`).

Rays go to points of the lens through the depth buffer (Lee, Eisemann and Seidel, *Real-Time Lens Blur Effects and Focus
Control*, 2010). A wide circle leaves no fine detail, so it is gathered at half or a quarter of the width and height,
and magnified. Tiles of the picture are classified by the circles that reach them (McGuire et al. 2012; Jimenez, *Next
Generation Post Processing in Call of Duty: Advanced Warfare*, 2014), and each class has a program of its own, since a
software rasteriser computes both sides of a branch. Later passes that only map colours are part of these programs
(`render.pixel_source`). `reference/dof.py` is the twin.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import moderngl

from depthwalk.gpu.device import PROGRAM_POINT_SIZE, Scope
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.program import Program
from depthwalk.render.image import Image
from depthwalk.render.pixel_source import ColourFunctions
from depthwalk.render.targets import Targets
from depthwalk.render.view.lens import ALL_EVEN, HIGHEST_MIP, LARGEST_BLOCK, TILE, TileClass

_VERTEX = "dof/tile.vert"
_LINEAR = moderngl.LINEAR, moderngl.LINEAR
_NEAREST = moderngl.NEAREST, moderngl.NEAREST


@dataclass(frozen=True, kw_only=True)
class _Reduced:
    """Hold a reduced picture.

    Attributes
    ----------
    block : pixels of the whole picture along the side of one of its pixels.
    highest_mip : its highest mip level, 0 without mip-maps; only the smallest picture has them.
    colour : linear light, premultiplied.
    circles : radius; the least and the greatest of the block; pixels of the whole picture.
    surfaces : the framebuffer of both.
    gathered : what the lens sees in the tiles that are gathered at this size, after the passes behind. 8 bits would
        magnify a little faster, and visibly worse.
    """

    block: int
    highest_mip: int
    colour: moderngl.Texture
    circles: moderngl.Texture
    surfaces: moderngl.Framebuffer
    gathered: Image


@dataclass(frozen=True, kw_only=True)
class _Classes:
    """Hold what a frame's tiles are classified by.

    Attributes
    ----------
    found : the extremes of each tile.
    ranges : what may reach into each tile, see shaders/dof/spread.frag.
    classes : how each tile is gathered, see shaders/dof/classes.frag.
    """

    found: Image
    ranges: Image
    classes: Image


@dataclass(frozen=True, kw_only=True)
class _Drawing:
    """Hold what one frame is drawn with.

    Attributes
    ----------
    into : the finished picture: `lit`, or what the passes behind draw into.
    drawn : the classes of tiles to draw into it; the others are there already.
    programs : those that draw tiles, by name.
    following : the uniforms of the passes behind.
    most_rays : the most rays per pixel.
    """

    into: moderngl.Framebuffer
    drawn: int
    programs: Mapping[str, Program]
    following: Mapping[str, Any]
    most_rays: int


class LensGather:
    """Own the programs and textures of the mode `gather`, made when they are first needed.

    Parameters
    ----------
    gl : creates them, and frees them when the pass is released.
    """

    def __init__(self, gl: Scope) -> None:
        self._gl = gl
        whole = "common/fullscreen.vert"
        self._programs = {
            "reduce_first": Program(gl, whole, "dof/reduce.frag", ("FIRST",)),
            "reduce": Program(gl, whole, "dof/reduce.frag"),
            "tiles": Program(gl, whole, "dof/tiles.frag"),
            "spread": Program(gl, whole, "dof/spread.frag"),
            "classes": Program(gl, whole, "dof/classes.frag"),
        }
        self._tile_programs: dict[tuple[Any, ...], dict[str, Program]] = {}
        self._owned: list[Any] = []
        self._reduced: tuple[_Reduced, ...] = ()
        self._classes: _Classes | None = None

    def release(self) -> None:
        """Free the textures, for example before targets of another size."""
        self._gl.free(*self._owned)
        self._owned.clear()
        self._reduced, self._classes = (), None

    def draw(
        self, targets: Targets, samples: int, circles: Mapping[str, Any], following: ColourFunctions | None = None
    ) -> None:
        """Replace the target `lit` by what the lens sees, or draw what the passes behind make of that.

        Parameters
        ----------
        targets : the picture: `depth`, `lit`.
        samples : the most rays per pixel.
        circles : the uniforms of shaders/dof/circle.glsl, by which depth is at texture unit 0.
        following : the functions of the passes behind; their target is drawn into, and `lit` stays as it is.
        """
        if self._classes is None:
            self._create(targets.size)
        assert self._classes is not None  # `_create` made it
        drawing = self._drawing(targets, samples, following)
        sharp, (half, quarter) = targets.lit_before() if following is None else targets.lit_texture, self._reduced
        sharp.filter = _NEAREST
        targets.depth.use(0)
        sharp.use(2)
        self._fill(half.surfaces, "reduce_first", sharp_texture=2, **circles)
        half.circles.use(1)
        half.colour.use(3)
        half.colour.filter = _NEAREST
        self._fill(quarter.surfaces, "reduce", sharp_texture=3, circles_texture=1)
        half.colour.filter = _LINEAR
        quarter.colour.build_mipmaps(max_level=quarter.highest_mip)
        self._classify(self._classes, quarter, circles["largest"])
        self._gather_reduced(drawing, quarter, TileClass.QUARTER_EVEN, TileClass.QUARTER)
        self._gather_reduced(drawing, half, TileClass.HALF_EVEN, TileClass.HALF, TileClass.MIXED)
        sharp.filter = _LINEAR
        whole: dict[str, Any] = {"sharp_texture": 2, "most_rays": samples, **circles, **drawing.following}
        self._tiles(drawing, drawing.into, "even", TILE, drawing.drawn & (TileClass.EVEN | TileClass.SHARP), **whole)
        near: dict[str, Any] = {"gathered_texture": 4, "circles_texture": 1, "range_texture": 5}  # of half the size
        self._tiles(drawing, drawing.into, "gather", TILE, TileClass.MIXED, **near, **whole)
        sharp.filter = _NEAREST

    def _drawing(self, targets: Targets, samples: int, following: ColourFunctions | None) -> _Drawing:
        """Return what a frame is drawn with."""
        if following is None:
            return _Drawing(
                into=targets.lit,
                drawn=~TileClass.SHARP,
                programs=self._programs_of((), ()),
                following={},
                most_rays=samples,
            )
        return _Drawing(
            into=following.into,
            drawn=~0,
            programs=self._programs_of(following.defines, following.shaders),
            following=following.uniforms,
            most_rays=samples,
        )

    def _programs_of(self, defines: tuple[str, ...], shaders: tuple[Any, ...]) -> dict[str, Program]:
        """Return the programs that draw tiles and call the functions of passes behind."""
        if (defines, shaders) not in self._tile_programs:
            files = {"reduced_even": ("reduced", "EVEN_TILES", "REDUCED"), "reduced": ("reduced", "REDUCED")}
            files |= {"even": ("even",), "gather": ("gather",)}
            self._tile_programs[defines, shaders] = {
                name: Program(self._gl, _VERTEX, f"dof/{file}.frag", (*own, *defines), includes=shaders)
                for name, (file, *own) in files.items()
            } | {"upsample": Program(self._gl, _VERTEX, "dof/upsample.frag", defines)}
        return self._tile_programs[defines, shaders]

    def _gather_reduced(
        self, drawing: _Drawing, picture: _Reduced, even: TileClass, traced: TileClass, lent: int = 0
    ) -> None:
        """Gather tiles of the classes `even`, `traced` and `lent` in `picture`, and those beside; show the first two.

        Its circles and what was gathered stay at texture units 1 and 4.
        """
        picture.colour.use(3)
        picture.circles.use(1)
        side, gathered = TILE // picture.block, picture.gathered
        reduced: dict[str, Any] = {"colour_texture": 3, "circles_texture": 1, "block": picture.block}
        reduced |= {"most_rays": drawing.most_rays, **drawing.following}
        levels = {"highest_mip": picture.highest_mip}
        beside = even | traced | lent  # filters look across the borders of tiles
        averaged, rays = {"left_out": ~ALL_EVEN, **levels}, {"left_out": ALL_EVEN, "range_texture": 5}
        self._tiles(drawing, gathered.framebuffer, "reduced_even", side, even, beside, **averaged, **reduced)
        self._tiles(drawing, gathered.framebuffer, "reduced", side, traced | lent, beside, **rays, **reduced)
        gathered.texture.use(4)
        shown: dict[str, Any] = {"gathered_texture": 4, "block": picture.block}
        self._tiles(drawing, drawing.into, "upsample", TILE, even | traced, **shown)

    def _classify(self, classes: _Classes, quarter: _Reduced, largest: float) -> None:
        """Find the circles that may reach each tile; leave them at texture unit 5, the tiles' classes at 6."""
        quarter.circles.use(1)
        self._fill(classes.found.framebuffer, "tiles", circles_texture=1, tile_side=TILE // quarter.block)
        classes.found.texture.use(5)
        self._fill(classes.ranges.framebuffer, "spread", tile_texture=5, tile_side=TILE, largest=largest)
        classes.ranges.texture.use(5)
        self._fill(classes.classes.framebuffer, "classes", range_texture=5)
        classes.classes.texture.use(6)

    def _create(self, size: tuple[int, int]) -> None:
        """Create the textures for targets of `size` (width, height) pixels.

        Raises GpuError where points are smaller than tiles, which OpenGL allows and no known driver does.
        """
        if (most := self._gl.device.context.info["GL_POINT_SIZE_RANGE"][1]) < TILE:
            raise GpuError(f"render.dof.mode: gather needs points {TILE} pixels wide; this driver allows {most:g}")
        half, quarter = self._reduce(size, 2, 0), self._reduce(size, LARGEST_BLOCK, HIGHEST_MIP)
        self._reduced = half, quarter
        tiles = -(-size[0] // TILE), -(-size[1] // TILE)
        found, ranges, classes = (self._image(tiles) for _ in range(3))
        self._classes = _Classes(found=found, ranges=ranges, classes=classes)

    def _image(self, size: tuple[int, int]) -> Image:
        """Create an image of `size` texels."""
        image = Image.make(self._gl, size, dtype="f4")
        self._owned += reversed(image)  # framebuffers are freed before their textures
        return image

    def _reduce(self, size: tuple[int, int], block: int, highest_mip: int) -> _Reduced:
        """Create a reduced picture for targets of `size` pixels; each of its pixels represents `block`² of theirs."""
        small = -(-size[0] // block), -(-size[1] // block)
        # Software rasterisers convert half floats one by one; reduced pictures are small enough for 32-bit floats.
        colour, circles = (self._gl.texture(small, 4, "f4") for _ in range(2))
        surfaces = self._gl.framebuffer([colour, circles])
        self._owned += [surfaces, colour, circles]
        if highest_mip:
            colour.build_mipmaps(max_level=highest_mip)
        colour.filter = moderngl.LINEAR_MIPMAP_NEAREST if highest_mip else moderngl.LINEAR, moderngl.LINEAR
        gathered = self._image(small)
        gathered.texture.filter = _LINEAR
        return _Reduced(
            block=block,
            highest_mip=highest_mip,
            colour=colour,
            circles=circles,
            surfaces=surfaces,
            gathered=gathered,
        )

    def _fill(self, into: moderngl.Framebuffer, program: str, **uniforms: Any) -> None:
        self._programs[program].set(**uniforms)
        with self._gl.state(into=into):
            self._programs[program].fill()

    def _tiles(
        self,
        drawing: _Drawing,
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
        across, up = self._classes.ranges.texture.size
        drawing.programs[program].set(
            class_texture=6,
            tile_side=side,
            drawn_class=int(drawn),
            beside_class=int(beside),
            left_out=int(left_out),
            **uniforms,
        )
        viewport = into.viewport
        # GL drops points whose centre is outside the viewport, as it may be where the picture's edge cuts off a tile.
        into.viewport = 0, 0, across * side, up * side
        try:
            with self._gl.state(into=into, direct=(PROGRAM_POINT_SIZE,)):
                drawing.programs[program].points(across * up)
        finally:
            into.viewport = viewport
