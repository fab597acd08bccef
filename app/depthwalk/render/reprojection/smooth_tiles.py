"""Find which tiles of a reprojected picture can be interpolated, and which need a search for each pixel.

Sky, ground and walls, most of a picture, are plane or far away. There the places in the finished picture of all pixels
of a small tile can be interpolated from those of its corners, and a pixel takes one texture read instead of four. A
tile is classified by a few searches (shaders/reprojection/search.glsl) and by how far from plane the picture is where
its pixels may lie. The twin in NumPy is `reference.reprojection`.
"""

from enum import IntEnum
from functools import partial
from typing import NamedTuple

import moderngl
import numpy as np

from depthwalk.gpu.device import PROGRAM_POINT_SIZE, Scope
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.image import Image

TILE = 16  # pixels along a tile of the screen
ROUGHNESS_CELL = 4  # pixels along a cell of the picture, for which it is stored how far from plane it is
MOST_CELLS = 12  # along either axis, that a smooth tile may lie in: near surfaces may spread a tile over many
MOVES = 1e9  # the roughness of cells in which anything moves by itself; no other is as rough
TOLERANCE = 1.0  # pixels by which an interpolated place may be off
VERTEX_SHADER = "reprojection/tile.vert"  # of the programs that draw tiles


class TileClass(IntEnum):
    """Name the ways in which tiles are drawn."""

    SMOOTH = 0  # interpolated
    SEARCHED = 1  # a search for each pixel
    AROUND = 2  # likewise, and some may lie beyond the edges of the picture
    MOVED = 3  # likewise, for surfaces too that move by themselves
    UNCOVERED = 4  # likewise, and some may show what a nearer surface hides in the picture


class _Found(NamedTuple):
    """Hold the places in the picture of the corners of tiles and the points midway, and the classes of the tiles."""

    places: Image
    classes: Image


class SmoothTiles:
    """Decide how each tile of a screen is drawn, and draw the tiles of a class.

    Parameters
    ----------
    gl : the owner of everything on the GPU.
    """

    def __init__(self, gl: Scope) -> None:
        self._gl = gl
        vertex = "common/fullscreen.vert"
        self._find = Program(gl, vertex, "reprojection/places.frag")
        self._roughness, self._classify = (
            Variants(partial(Program, gl, vertex, f"reprojection/{name}.frag")) for name in ("roughness", "classes")
        )
        self._smooth = Program(gl, VERTEX_SHADER, "reprojection/smooth.frag")
        self._made: _Found | None = None

    def make_roughness(self, size: tuple[int, int]) -> Image:
        """Create what `measure` fills in, for pictures of `size` (width, height), pixels."""
        columns, rows = (-(-side // ROUGHNESS_CELL) for side in size)
        return Image.make(self._gl, (columns, rows), 1, "f4")

    def measure(self, distances: moderngl.Texture, roughness: Image, moving: moderngl.Texture | None = None) -> None:
        """Measure how far from plane the cells of a finished picture are, see shaders/reprojection/roughness.frag.

        moving: the nearest surfaces that move by themselves, see `MovingImages`; None: nothing does.
        """
        distances.use(0)
        program = self._roughness[() if moving is None else ("MOVED",)]
        program.set(distances=0)
        if moving is not None:
            moving.use(1)
            program.set(moving=1)
        with self._gl.state(into=roughness.framebuffer):
            program.fill()

    def classify(
        self,
        size: tuple[int, int],
        roughness: Image,
        search: dict[str, object],
        focal_pixels: float,
        unit: int,
        defines: tuple[str, ...] = (),
    ) -> None:
        """Decide how the tiles of a screen are drawn.

        Parameters
        ----------
        size : of the screen, (width, height), pixels.
        roughness : of the picture, see `measure`.
        search : the uniforms of shaders/reprojection/search.glsl, whose textures are bound.
        focal_pixels : of the screen.
        unit : the first of two texture units that none of these uses.
        defines : of classes.frag.

        Raises
        ------
        GpuError
            Where points are smaller than tiles, which OpenGL allows and no known driver does, or there is no memory.
        """
        tiles = -(-size[0] // TILE), -(-size[1] // TILE)
        if self._made is None or self._made.classes.texture.size != tiles:
            self._create(tiles)
        assert self._made is not None
        places, classes = self._made
        pixel = 1 / size[0], 1 / size[1]
        find, classify = self._find, self._classify[defines]
        find.set(**search, pixel=pixel)
        with self._gl.state(into=places.framebuffer):
            find.fill()
        places.texture.use(unit)
        roughness.texture.use(unit + 1)
        classify.set(**search, pixel=pixel, focal_pixels=focal_pixels, places=unit, roughness=unit + 1)
        with self._gl.state(into=classes.framebuffer):
            classify.fill()

    def class_at(self, size: tuple[int, int], across: float, up: float) -> TileClass:
        """Return what `classify` has decided for the tile at a place of the screen, 0 to 1. Waits for the GPU."""
        assert self._made is not None
        classes = self._made.classes.texture
        found = np.frombuffer(classes.read(), np.float32).reshape(classes.size[::-1])
        column, row = (int(part * side) // TILE for part, side in zip((across, up), size, strict=True))
        return TileClass(int(found[min(row, len(found) - 1), min(column, found.shape[1] - 1)]))

    def draw(
        self, screen: moderngl.Framebuffer, programs: dict[TileClass, Program], *, picture: int, unit: int
    ) -> None:
        """Draw all tiles as `classify` has decided.

        Parameters
        ----------
        screen : the framebuffer to draw into.
        programs : those that draw the classes that are not smooth, with `VERTEX_SHADER` and their uniforms set.
        picture : the unit that the colours of the picture are bound to.
        unit : as for `classify`.
        """
        assert self._made is not None
        classes = self._made.classes.texture
        classes.use(unit + 1)
        columns, rows = classes.size
        viewport = screen.viewport
        screen.viewport = 0, 0, columns * TILE, rows * TILE
        try:
            with self._gl.state(into=screen, direct=(PROGRAM_POINT_SIZE,)):
                self._smooth.set(picture=picture)
                for tile_class, program in {TileClass.SMOOTH: self._smooth, **programs}.items():
                    program.set(places=unit, class_texture=unit + 1, drawn_class=int(tile_class))
                    program.points(columns * rows)
        finally:
            screen.viewport = viewport

    def _create(self, tiles: tuple[int, int]) -> None:
        """Create the images for `tiles` (columns, rows), in place of those for another number."""
        if (most := self._gl.device.context.info["GL_POINT_SIZE_RANGE"][1]) < TILE:
            raise GpuError(
                f"render.reprojection.mode: reprojection needs points {TILE} pixels wide; this driver allows {most:g}; "
                "set it to off"
            )
        if self._made is not None:
            for image in self._made:
                image.free(self._gl)
            self._made = None
        places = Image.make(self._gl, (2 * tiles[0] + 1, 2 * tiles[1] + 1), 4, "f4")
        self._made = _Found(places, Image.make(self._gl, tiles, 1, "f4"))
