"""Show a finished picture as it appears to a camera that has moved since.

A finished frame is itself a depth image: colours, distances, and the camera that saw them. So while the next frame is
drawn, which may take long, the last one can follow the viewer at the cost of a few texture reads per pixel. What the
picture does not hold is filled in: beyond its edges from what earlier frames saw there (`surround`), or else with a
mirror image of its border; where a nearer object has moved aside, with the background next to it. The shader is
shaders/reprojection/reprojection.frag, its twin in NumPy `reference.reprojection`.
"""

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.render.image import Image
from depthwalk.render.reprojection.depth_picture import DepthPicture, DepthPictures
from depthwalk.render.reprojection.moving_surfaces import MovingImages, MovingSurfaces
from depthwalk.render.reprojection.nearest_cells import CELL, openings
from depthwalk.render.reprojection.picture_cells import CELL_COLUMNS, CELL_ROWS, VERTEX_SHADER, fill_cells, places
from depthwalk.render.reprojection.smooth_tiles import VERTEX_SHADER as TILE_VERTEX_SHADER
from depthwalk.render.reprojection.smooth_tiles import SmoothTiles, TileClass
from depthwalk.render.reprojection.surround import Surround
from depthwalk.render.targets import Targets
from depthwalk.render.view.field_of_view import shows, spread_rays
from depthwalk.render.view.view import View
from depthwalk.render.world.moving_objects import MovingObjects
from depthwalk.types import Array, Mask

BEYOND = 1e6  # metres: the distance that stands for the sky, where nothing was drawn
FIXED_POINT_STEPS = 2  # a third changes next to nothing
EDGE = 1.2  # what is this many times farther away than a surface is beyond its edge
EDGE_STEPS = 3  # bisections that find this edge
DAMPING = 0.75  # least length of a step along a ray ahead, over that which is right for a floor; see search.glsl
_Seen = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
_CORNERS = places(1)  # of these cells
_JUDGED = 16, 12  # columns and rows of rays that estimate how much of a view a picture holds
REFLECTED = 0.1  # part of the picture's width or height, along each edge, that is mirrored beyond it
MOST_ELAPSED = 0.3  # seconds that things go on moving in a picture: turns are no straight lines
LEAST_AHEAD = 0.01  # metres: cells that come nearer to the new camera are not drawn
HIDDEN = 0.95  # a surface nearer than this part of the distance at which a search ends hides what it looks for


def seen_from(picture: View, view: View) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return another camera in the axes of a picture's camera: to its right, up and ahead of it, metres.

    Parameters
    ----------
    picture : the view of the picture.
    view : the view of the other camera.

    Returns
    -------
    rays : (3, 3), takes (x, y, 1), x and y from −1 to 1 over the picture of `view`, to a ray one metre along its axis.
    viewer : (3,), the position of `view`.
    axis : (3,), unit, the view axis of `view`.
    """
    axes = picture.axes
    return axes @ view.ray_from_screen, axes @ (view.position - picture.position), axes @ view.axes[2]


def elapsed(picture: View, view: View) -> float:
    """Return the seconds from the moment of a picture to that of another view, within `MOST_ELAPSED`."""
    return min(max(view.camera.time - picture.camera.time, -MOST_ELAPSED), MOST_ELAPSED)


@dataclass
class _Picture:
    """Hold a picture, the distance of the nearest surface in each cell of `CELL` pixels, and how plane it is.

    `moving` holds how its surfaces move by themselves, once any of them may; `moves` says whether they do.
    """

    drawn: DepthPicture
    nearest: Image
    roughness: Image
    moving: MovingImages | None = None
    moves: bool = False


class _Cells(NamedTuple):
    """Hold, for each cell of the screen, how far ahead of the viewer its nearest surface is.

    `moved` holds that of the nearest surface that moves by itself, and by how much it has moved, metres.
    """

    nearest: Image
    moved: Image
    depth: moderngl.Texture


class Reprojection:
    """Keep the last finished picture, and show it through other cameras.

    Parameters
    ----------
    device : the GPU that draws.

    Attributes
    ----------
    surround : what earlier pictures saw around the viewer.
    view : the view of the finished picture; None: there is none.
    """

    def __init__(self, device: Device) -> None:
        self._gl = device.scope("reprojection")
        vertex = "common/fullscreen.vert"
        self._copy = Program(self._gl, vertex, "still_picture/place.frag")
        self._nearest = Program(self._gl, vertex, "reprojection/nearest.frag")
        self._moved = Variants(
            partial(Program, self._gl, "reprojection/moved_cell.vert", "reprojection/moved_cell.frag")
        )
        self._programs = Variants(
            lambda defines: Program(self._gl, VERTEX_SHADER, "reprojection/reprojection.frag", defines=defines)
        )
        self._tile_programs = Variants(partial(Program, self._gl, TILE_VERTEX_SHADER, "reprojection/reprojection.frag"))
        self._tiles = SmoothTiles(self._gl)
        self._surfaces = MovingSurfaces(self._gl)
        self._pictures = DepthPictures(self._gl)
        self.surround = Surround(self._gl, self._pictures)
        self.view: View | None = None
        self._shown: _Picture | None = None
        self._drawn: _Picture | None = None  # the one being drawn
        self._cells: _Cells | None = None
        self._rehearsed = False
        self._openings: NDArray[np.float64] | None = None  # of the finished picture, once asked for

    def canvas(self, size: tuple[int, int]) -> moderngl.Framebuffer:
        """Return the framebuffer of `size` (width, height), pixels, to draw the next picture into."""
        if self._drawn is None or self._drawn.drawn.size != size:
            self._free_drawn()  # first, as there may not be memory for two
            cells = -(-size[0] // CELL), -(-size[1] // CELL)
            nearest, roughness = Image.make(self._gl, cells, 1, "f4"), self._tiles.make_roughness(size)
            self._drawn = _Picture(self._pictures.make(size), nearest, roughness)
        return self._drawn.drawn.colours.framebuffer

    def take(self, targets: Targets, view: View, moving: MovingObjects | None = None) -> None:
        """Make what was drawn into `canvas` the finished picture.

        Parameters
        ----------
        targets : those that the picture was drawn with, which hold its depth.
        view : the view of the picture, near and far plane fitted, of the size of the canvas.
        moving : what moves by itself, as it was at the picture's moment; None: nothing ever does.
        """
        if self._drawn is None:
            raise ValueError("no picture was drawn: there is no canvas yet")
        drawn, picture, nearest = self._drawn, self._drawn.drawn, self._drawn.nearest
        self._pictures.keep_distances(picture, targets, view)
        picture.distances.texture.use(0)
        self._nearest.set(distances=0)
        with self._gl.state(into=nearest.framebuffer):
            self._nearest.fill()
        drawn.moves, nearest_moving = moving is not None, None
        if moving is not None:
            drawn.moving = drawn.moving or self._surfaces.make(picture.size)
            self._surfaces.measure(drawn.moving, picture.distances.texture, view, moving)
            nearest_moving = drawn.moving.nearest.texture
        self._tiles.measure(picture.distances.texture, drawn.roughness, nearest_moving)
        self._shown, self._drawn = self._drawn, self._shown
        self.view, self._openings = view, None
        self.surround.take(picture, view)

    def show_canvas(self, screen: moderngl.Framebuffer) -> None:
        """Copy what was drawn into `canvas` to `screen`, which is as large, whether or not it is taken later."""
        if self._drawn is None:
            raise ValueError("no picture was drawn: there is no canvas yet")
        self._drawn.drawn.colours.texture.use(0)
        self._copy.set(picture=0, corner=(0, 0))
        with self._gl.state(into=screen):
            self._copy.fill()

    def forget_picture(self) -> None:
        """Drop the finished picture, because the window has since shown newer ones from elsewhere that are not kept."""
        self.view = None

    def show(self, view: View, screen: moderngl.Framebuffer) -> None:
        """Draw the finished picture into `screen` as seen by `view`, which has the size of the screen."""
        if self.view is None or self._shown is None:
            raise ValueError("there is no finished picture yet")
        seen = seen_from(self.view, view)
        if not self._rehearsed:
            self._rehearse(view, seen, screen)
        if seen[1].any() or (self._shown.moves and elapsed(self.view, view)):
            self._show_moved(view, seen, screen)
        else:
            self._show_turned(view, seen, screen)

    def _show_moved(self, view: View, seen: _Seen, screen: moderngl.Framebuffer) -> None:
        """Show the picture to a camera that stands elsewhere; `seen` is what `seen_from` returns."""
        assert self.view is not None and self._shown is not None
        shown = self._classify(view, seen) | self._picture_uniforms(view)
        moved = ("MOVED",) if self._shown.moves else ()
        programs = {
            TileClass.SEARCHED: self._tile_programs[("COVERED",)],
            TileClass.UNCOVERED: self._tile_programs[()],
            TileClass.AROUND: self._tile_programs[*moved, "AROUND"],
        }
        if self._shown.moves:
            programs[TileClass.MOVED] = self._tile_programs[moved]
        for tile_class, program in programs.items():
            around = self._around_uniforms(view, 5) if tile_class == TileClass.AROUND else {}
            program.set(**shown, **around)
        self._tiles.draw(screen, programs, picture=0, unit=3)

    def _classify(self, view: View, seen: _Seen) -> dict[str, object]:
        """Decide how the tiles of a view's screen are drawn; return the uniforms to search the picture from there."""
        assert self._shown is not None
        self._move_cells(view, *seen[:2])
        search = self._search_uniforms(view, seen)
        moved = ("MOVED",) if self._shown.moves else ()
        self._tiles.classify(view.size, self._shown.roughness, search, view.focal_pixels, 3, moved)
        return search

    def _show_turned(self, view: View, seen: _Seen, screen: moderngl.Framebuffer) -> None:
        """Show the picture to a camera that stands where the picture's camera stood."""
        assert self.view is not None
        wide, high = ((whole - part) for whole, part in zip(self.view.size, view.size, strict=True))
        same = (self.view.camera.position, self.view.camera.target) == (view.camera.position, view.camera.target)
        is_part = math.isclose(self.view.focal_pixels, view.focal_pixels) and wide % 2 == high % 2 == 0
        defines = ("EXACT",) if same and is_part else ("TURNED",)
        uniforms = self._search_uniforms(view, seen) | self._picture_uniforms(view)
        uniforms["margin"] = wide // 2, high // 2
        lacking = self._lacking(seen[0])
        with self._gl.state(into=screen):
            self._fill(defines, ~lacking, uniforms)
            if lacking.any():
                self._fill((*defines, "AROUND"), lacking, uniforms | self._around_uniforms(view, 5))

    def _picture_uniforms(self, view: View) -> dict[str, object]:
        """Bind the colours of the finished picture; return the uniforms that show them on the screen of a view."""
        assert self._shown is not None
        self._shown.drawn.colours.texture.use(0)
        return {"picture": 0, "pixel": (1 / view.size[0], 1 / view.size[1])}

    def _around_uniforms(self, view: View, unit: int) -> dict[str, object]:
        """Bind the surround to two texture units from `unit` on; return the uniforms that show it."""
        world = {"world_from_screen": tuple(view.ray_from_screen.T.ravel())}
        return world | self.surround.use(view, unit, unit + 1)

    def _search_uniforms(self, view: View, seen: _Seen) -> dict[str, object]:
        """Bind the distances of the finished picture; return the uniforms to search it from the screen of a view."""
        assert self.view is not None and self._shown is not None
        moving: dict[str, object] = {}
        if self._shown.moves and self._shown.moving is not None:
            self._shown.moving.velocities.texture.use(7)
            moving = {"velocities": 7, "elapsed": elapsed(self.view, view)}
            if self._cells is not None:
                self._cells.moved.texture.use(8)
                moving["nearest_moved"] = 8
        rays, viewer, axis = seen
        self._shown.drawn.distances.texture.use(1)
        if self._cells is not None:
            self._cells.nearest.texture.use(2)
        return {
            "distances": 1,
            "nearest": 2,
            "cells_shown": tuple(side / (CELL * math.ceil(side / CELL)) for side in view.size),
            "ray_from_screen": tuple(rays.T.ravel()),
            "viewer": tuple(viewer),
            "axis": tuple(axis),
            "half_extent": self.view.half_extent,
            **moving,
        }

    def _fill(self, defines: tuple[str, ...], cells: Mask, uniforms: dict[str, object]) -> None:
        """Draw those `cells` of the screen that are set (see `fill_cells`) by the program with these defines."""
        program = self._programs[defines]
        program.set(**uniforms)
        fill_cells(program, cells)

    def _rehearse(self, view: View, seen: _Seen, screen: moderngl.Framebuffer) -> None:
        """Draw once with each program, so that no later picture waits for the driver's compiler."""
        self._show_moved(view, seen, screen)
        whole, uniforms = screen.viewport, self._search_uniforms(view, seen) | self._picture_uniforms(view)
        screen.viewport = (0, 0, 1, 1)
        try:
            with self._gl.state(into=screen):
                for defines in (("TURNED",), ("TURNED", "AROUND")):
                    self._fill(defines, np.ones(CELL_ROWS * CELL_COLUMNS, bool), uniforms)
        finally:
            screen.viewport = whole
        self._rehearsed = True

    def _lacking(self, rays: NDArray[np.float64]) -> Mask:
        """Return which cells of the screen reach beyond the finished picture, (CELL_ROWS · CELL_COLUMNS,).

        rays: see `seen_from`; of a camera that stands where the picture's camera stood.
        """
        assert self.view is not None
        corners = np.dstack([_CORNERS, np.ones(_CORNERS.shape[:2])])
        return np.asarray(~shows(self.view, corners @ rays.T).all(1))

    def _move_cells(self, view: View, rays: NDArray[np.float64], viewer: NDArray[np.float64]) -> None:
        """Find how far ahead the nearest surface is in each cell of the screen of a view, see `seen_from`."""
        assert self.view is not None and self._shown is not None
        size = view.size
        count = -(-size[0] // CELL), -(-size[1] // CELL)
        if self._cells is None or self._cells.nearest.texture.size != count:
            self._free_cells()
            depth = self._gl.depth_texture(count)
            textures = self._gl.texture(count, 1, "f4"), self._gl.texture(count, 4, "f4")
            nearest, moved = (Image(texture, self._gl.framebuffer([texture], depth)) for texture in textures)
            self._cells = _Cells(nearest, moved, depth)
        kinds: list[tuple[tuple[str, ...], moderngl.Texture, Image]] = [
            ((), self._shown.nearest.texture, self._cells.nearest)
        ]
        if self._shown.moves and self._shown.moving is not None:
            kinds.append((("MOVED",), self._shown.moving.nearest.texture, self._cells.moved))
        for defines, texture, into in kinds:
            into.framebuffer.clear(BEYOND, depth=1.0)
            texture.use(0)
            program = self._moved[defines]
            program.set(
                nearest=0,
                picture_size=self.view.size,
                half_extent=self.view.half_extent,
                viewer=tuple(viewer),
                screen_from_ray=tuple(np.linalg.inv(rays).T.ravel()),
                screen_cells=(size[0] / CELL, size[1] / CELL),
                elapsed=elapsed(self.view, view),
            )
            with self._gl.state(into=into.framebuffer, depth_test=LESS):
                program.rectangles(math.prod(texture.size))

    def unseen(self, view: View) -> float:
        """Return the part of `view`, 0 to 1, that neither the finished picture nor the surround holds.

        Estimated from a few rays, as if everything were far away; 1 without a picture.
        """
        if self.view is None:
            return 1.0
        rays = spread_rays(view, *_JUDGED)
        beyond = rays[~shows(self.view, rays @ self.view.axes.T)]
        return float((~self.surround.holds(beyond, view.position)).sum() / len(rays))

    def uncovered(self, position: Array) -> float:
        """Return about which part of a view the finished picture lacks because something nearer covers it there.

        It grows in proportion to the way from the picture's camera; 0 without a picture.

        position: of the viewer, (3,), world, metres.
        """
        if self.view is None or self._shown is None:
            return 0.0
        if self._openings is None:
            texture = self._shown.nearest.texture
            nearest = np.frombuffer(texture.read(), np.float32).reshape(texture.size[::-1])
            self._openings = openings(nearest, self.view, EDGE)
        step = self.view.axes @ (position - self.view.position)
        return float(np.maximum(self._openings @ step, 0).sum())

    def distance_at(self, view: View, across: float, down: float) -> float:
        """Return the distance of the surface that `show` shows at a place. Waits for the GPU.

        Parameters
        ----------
        view : the view that the picture is shown through.
        across : part of its width, from the left edge, 0 to 1.
        down : part of its height, from the upper edge, 0 to 1.

        Returns
        -------
        Metres along the axis of `view`; +inf where no surface is, or no picture.
        """
        if self.view is None:
            return math.inf
        search = self._classify(view, seen_from(self.view, view))
        covered = self._tiles.class_at(view.size, across, 1 - down) == TileClass.SEARCHED
        program, (texture, framebuffer) = self._distance
        program.set(**search, place_asked=(across, 1 - down), covered=covered)
        with self._gl.state(into=framebuffer):
            program.fill()
        (distance,) = np.frombuffer(texture.read(), np.float32).tolist()
        return distance if distance < BEYOND else math.inf

    @cached_property
    def _distance(self) -> tuple[Program, Image]:
        """Return the program that finds one distance, compiled on first use, and the texel that it draws into."""
        shaders = "common/fullscreen.vert", "reprojection/reprojection.frag"
        defines = ("DISTANCE", "MOVED") if self._shown is not None and self._shown.moves else ("DISTANCE",)
        return Program(self._gl, *shaders, defines=defines), Image.make(self._gl, (1, 1), 1, "f4")

    def _free_cells(self) -> None:
        if self._cells is not None:
            self._cells.nearest.free(self._gl)
            self._cells.moved.free(self._gl)
            self._gl.free(self._cells.depth)
        self._cells = None

    def _free_drawn(self) -> None:
        if self._drawn is not None:
            self._pictures.free(self._drawn.drawn)
            self._drawn.nearest.free(self._gl)
            self._drawn.roughness.free(self._gl)
            if self._drawn.moving is not None:
                self._surfaces.free(self._drawn.moving)
        self._drawn = None

    def release(self) -> None:
        """Free everything on the GPU."""
        self._gl.release()
        self._shown = self._drawn = self._cells = self.view = None
