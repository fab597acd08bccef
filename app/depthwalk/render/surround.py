"""Keep what lies around a viewer, as finished frames saw it: an environment map with depth.

A viewer who turns quickly sees past the edges of the last finished frame before the next one is finished. What earlier
frames saw there is kept in one map of all directions (equirectangular). Each texel holds a colour, how far away its
surface is and from where it was seen, so that it can be placed right for a viewer who has walked on since. The shaders
are shaders/reprojection/surround.glsl and capture.frag, their twin in NumPy is `reference.surround`.
"""

import math

import moderngl
import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.types import Array, Mask

SURROUND_COLUMNS, SURROUND_ROWS = 1536, 768  # texels: 0.23° each, three pixels of a window of 1024 for 75°
SURROUND_STEPS = 2  # fixed-point steps, as in a finished picture
NEAR_ENOUGH = 4.0  # metres: what was seen from farther away is taken for something else
FACE = 192  # pixels along an edge of the pictures that are drawn of directions which no frame has seen
_CELLS = 72, 36  # columns and rows of directions of which it is known on the CPU from where they were seen
_EDGE = 17  # places along each edge of a frame that tell which part of the map it covers


def directions(size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the directions (rows, columns, 3) of the middles of a map's texels, unit, world, lowest row first.

    Parameters
    ----------
    size : columns and rows of the map.
    """
    columns, rows = size
    yaw = ((np.arange(columns) + 0.5) / columns - 0.5) * 2 * np.pi
    pitch = ((np.arange(rows) + 0.5) / rows - 0.5)[:, None] * np.pi
    level = np.cos(pitch)
    return np.stack([level * np.sin(yaw), np.sin(pitch) + 0 * yaw, level * np.cos(yaw)], -1)


def places(rays: Array) -> NDArray[np.float64]:
    """Return where in a map directions (…, 3), world, of any length above 0, lie: (…, 2), 0 to 1."""
    unit = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    yaw, pitch = np.arctan2(unit[..., 0], unit[..., 2]), np.arcsin(np.clip(unit[..., 1], -1, 1))
    return np.stack([yaw / (2 * np.pi) + 0.5, pitch / np.pi + 0.5], -1)


def rows_and_columns(view: View) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return which texels of the map a frame may cover: first row and end, first column and end.

    Parameters
    ----------
    view : the view of the frame.

    Returns
    -------
    Rows from 0 to the map's height; columns that may reach beyond its right edge, where they go on at the left one.
    """
    columns, rows = SURROUND_COLUMNS, SURROUND_ROWS
    along = np.linspace(-1, 1, _EDGE)
    across, one = np.stack([along, 0 * along + 1], -1), np.ones((4 * _EDGE, 1))
    edges = np.concatenate([across, -across, across[:, ::-1], -across[:, ::-1]])
    place = places(np.hstack([edges, one]) @ view.ray_from_screen.T)
    low, high = place[:, 1].min(), place[:, 1].max()
    for pole in (-1.0, 1.0):
        right, up, ahead = view.axes @ (0.0, pole, 0.0)
        if ahead > 0 and abs(right) <= ahead * view.half_extent[0] and abs(up) <= ahead * view.half_extent[1]:
            return _texels(0.0 if pole < 0 else low, high if pole < 0 else 1.0, rows), (0, columns)
    middle = places(view.axes[2])[0]
    off = (place[:, 0] - middle + 0.5) % 1 - 0.5
    first, end = _texels(middle + off.min(), middle + off.max(), columns)
    if end - first >= columns:
        return _texels(low, high, rows), (0, columns)
    start = first % columns
    return _texels(low, high, rows), (start, start + end - first)


def _texels(low: float, high: float, count: int) -> tuple[int, int]:
    """Return the first of `count` texels from `low` to `high`, 0 to 1, and the end, with one more on either side."""
    return math.floor(low * count) - 1, math.ceil(high * count) + 1


def faces(position: Array) -> list[View]:
    """Return views of all directions from a place (3,), world, metres: those of a cube, level ones first."""
    eye = glm.dvec3(*position)
    looks = (0, 0, 1), (1, 0, 0), (0, 0, -1), (-1, 0, 0), (0, -1, 0), (0, 1, 0)
    cameras = [Camera(components(eye), components(eye + glm.dvec3(look)), math.pi / 2) for look in looks]
    return [View(camera, (FACE, FACE)) for camera in cameras]


class Surround:
    """Keep the colours and distances of all directions that finished frames have seen.

    Parameters
    ----------
    gl : the owner of the map, which frees it.
    """

    def __init__(self, gl: Scope) -> None:
        self._gl = gl
        self._capture = Program(gl, "common/fullscreen.vert", "reprojection/capture.frag")
        self._origin = np.zeros(3)  # world, metres: what positions in the map are relative to
        self._directions = directions(_CELLS)
        self._seen_from = np.full((*self._directions.shape[:2], 3), np.inf)
        size = SURROUND_COLUMNS, SURROUND_ROWS
        self.colours, self.surfaces = gl.texture(size, 4), gl.texture(size, 4, "f4")
        self.colours.filter = moderngl.LINEAR, moderngl.LINEAR
        self.colours.repeat_x = True
        self._framebuffer = gl.framebuffer([self.colours, self.surfaces])
        self.forget()

    def forget(self) -> None:
        """Forget everything that was seen."""
        self._seen_from[:] = np.inf
        self._framebuffer.viewport = (0, 0, SURROUND_COLUMNS, SURROUND_ROWS)
        self._framebuffer.clear()

    def take(self, colours: moderngl.Texture, distances: moderngl.Texture, view: View) -> None:
        """Keep what a finished frame shows, in the place of what was seen in the same directions before.

        Parameters
        ----------
        colours : of the frame, sRGB.
        distances : metres along its view axis; their signs do not count.
        view : the view of the frame.
        """
        if not np.isfinite(self._seen_from).any():
            self._origin = view.position
        colours.use(0)
        distances.use(1)
        self._capture.set(
            picture=0,
            distances=1,
            picture_from_world=tuple(view.axes.T.ravel()),
            half_extent=view.half_extent,
            seen_from=tuple(view.position - self._origin),
        )
        (low, high), (left, right) = rows_and_columns(view)
        width, height = SURROUND_COLUMNS, SURROUND_ROWS
        low, high = max(low, 0), min(high, height)
        for first, end in ((left, min(right, width)), (0, right - width)):
            if end > first:
                self._framebuffer.viewport = (first, low, end - first, high - low)
                with self._gl.state(into=self._framebuffer):
                    self._capture.fill()
        self._seen_from[shows(view, self._directions @ view.axes.T)] = view.position

    def holds(self, rays: Array, position: Array) -> Mask:
        """Return which directions were seen from about where the viewer is.

        Parameters
        ----------
        rays : (…, 3), world, of any length above 0.
        position : (3,), of the viewer, world, metres.

        Returns
        -------
        (…), whether some frame saw that direction from at most `NEAR_ENOUGH` metres away.
        """
        columns, rows = _CELLS
        column, row = (places(rays) * _CELLS).astype(int).reshape(-1, 2).T
        seen_from = self._seen_from[row.clip(max=rows - 1), column % columns]
        near = np.linalg.norm(seen_from - position, axis=-1) <= NEAR_ENOUGH
        return np.asarray(near.reshape(np.shape(rays)[:-1]))

    def use(self, view: View, colours: int, surfaces: int) -> dict[str, object]:
        """Bind the map to two texture units, and return the uniforms that surround.glsl needs.

        Parameters
        ----------
        view : of the viewer.
        colours, surfaces : the units.
        """
        self.colours.use(colours)
        self.surfaces.use(surfaces)
        return {
            "surround": colours,
            "surround_surfaces": surfaces,
            "surround_viewer": tuple(view.position - self._origin),
        }


def shows(view: View, points: Array) -> Mask:
    """Return which points (…, 3), right, up and ahead of a view's camera, metres, lie within its picture."""
    return np.asarray((np.abs(points[..., :2]) <= points[..., 2:] * np.array(view.half_extent)).all(-1))
