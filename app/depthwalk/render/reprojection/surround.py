"""Keep what lies around a viewer, as finished frames saw it: an environment map with depth.

A viewer who turns quickly sees past the edges of the last finished frame before the next one is finished. What earlier
frames saw there is kept in one octahedral map of all directions. Each texel holds a colour, the distance of its surface
and the place that it was seen from, so that it is shown in the right place after the viewer has moved. The shaders are
shaders/reprojection/capture.frag and surround.glsl, their twin in NumPy is `reference.surround`.
"""

import math
from functools import cached_property
from typing import NamedTuple

import moderngl
import numpy as np
from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.geometry.view_directions import (
    direction_from_square,
    octahedral_directions,
    square_from_direction,
)
from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.render.reprojection.depth_picture import DepthPicture, DepthPictures
from depthwalk.render.reprojection.picture_cells import VERTEX_SHADER, fill_cells, places
from depthwalk.render.targets import Targets
from depthwalk.render.view.field_of_view import shows
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.types import Array, Mask

SURROUND_SIZE = 1024  # texels along an edge of the map: along the horizon 0.12° each, two pixels of 1024 for 75°
SURROUND_STEPS = 2  # fixed-point steps, as in a finished picture
SURROUND_VIEW_SIZE = 192  # pixels along an edge of the pictures that are drawn of what no frame has seen
_NEAR_ENOUGH = 4.0  # metres: what was seen from farther away is shown, but counts as unknown
_CELLS = 49  # directions along an edge of the map for which the CPU knows where they were seen from
_DIRECTIONS = direction_from_square(places(4).reshape(-1, 2), False).reshape(-1, 25, 3)  # in each cell of the map
_WIDER = 1.1  # factor by which a frame is widened to find the cells that it may cover: their directions are 3° apart


def surround_views(position: Array, time: float = 0.0) -> list[View]:
    """Return views of all directions from a place (3,), world, metres: the sides of a cube, level ones first.

    time: the moment that they show, see `Camera`.
    """
    eye = glm.dvec3(*position)
    looks = (0, 0, 1), (1, 0, 0), (0, 0, -1), (-1, 0, 0), (0, -1, 0), (0, 1, 0)
    cameras = [Camera(components(eye), components(eye + glm.dvec3(look)), math.pi / 2, time) for look in looks]
    return [View(camera, (SURROUND_VIEW_SIZE, SURROUND_VIEW_SIZE)) for camera in cameras]


class _Map(NamedTuple):
    """Hold the textures of the map, and the framebuffer that draws into them."""

    colours: moderngl.Texture
    surfaces: moderngl.Texture
    framebuffer: moderngl.Framebuffer


class Surround:
    """Keep the colours and distances of all directions that finished frames have seen.

    Parameters
    ----------
    gl : the owner of the map, which frees it.
    pictures : makes the one that views of `surround_views` are drawn into.
    """

    def __init__(self, gl: Scope, pictures: DepthPictures) -> None:
        self._gl, self._pictures = gl, pictures
        self._capture = Program(gl, VERTEX_SHADER, "reprojection/capture.frag")
        self._origin: Array | None = None  # world, metres: what positions in the map are relative to
        self._directions = octahedral_directions(_CELLS, False)
        self._seen_from = np.full((_CELLS**2, 3), np.inf)
        self._side: DepthPicture | None = None  # made when the first is drawn

    @cached_property
    def _map(self) -> _Map:
        """Return the map, created for the first finished picture: 20 MB that quick frames never need."""
        size = SURROUND_SIZE, SURROUND_SIZE
        colours, surfaces = self._gl.texture(size, 4), self._gl.texture(size, 4, "f4")
        colours.filter = moderngl.LINEAR, moderngl.LINEAR
        made = _Map(colours, surfaces, self._gl.framebuffer([colours, surfaces]))
        made.framebuffer.clear()
        return made

    @property
    def colours(self) -> moderngl.Texture:
        """Return the colours of the map: sRGB, alpha 0 where nothing was seen."""
        return self._map.colours

    @property
    def surfaces(self) -> moderngl.Texture:
        """Return where each texel was seen from, relative to the map's origin, and its distance, all in metres."""
        return self._map.surfaces

    def canvas(self) -> moderngl.Framebuffer:
        """Return the framebuffer to draw a view of `surround_views` into."""
        if self._side is None:
            self._side = self._pictures.make((SURROUND_VIEW_SIZE, SURROUND_VIEW_SIZE))
        return self._side.colours.framebuffer

    def keep_canvas(self, targets: Targets, view: View, *, counts: bool = True) -> None:
        """Keep what was drawn into `canvas`.

        Parameters
        ----------
        targets : those that the picture was drawn with, which hold its depth.
        view, counts : see `take`.
        """
        if self._side is None:
            raise ValueError("nothing was drawn: there is no canvas yet")
        self._pictures.keep_distances(self._side, targets, view)
        self.take(self._side, view, counts=counts)

    def forget(self) -> None:
        """Mark all directions as unknown; what was seen there is still shown until something newer replaces it."""
        self._seen_from[:] = np.inf

    def take(self, picture: DepthPicture, view: View, *, counts: bool = True) -> None:
        """Store what a finished picture shows, over what was seen in the same directions before.

        Parameters
        ----------
        picture : the picture.
        view : its view, near and far plane fitted.
        counts : whether its directions count as known from now on; not if the picture lacks something.
        """
        if self._origin is None:
            self._origin = view.position
        picture.colours.texture.use(0)
        picture.distances.texture.use(1)
        self._capture.set(
            picture=0,
            distances=1,
            picture_from_world=tuple(view.axes.T.ravel()),
            half_extent=view.half_extent,
            seen_from=tuple(view.position - self._origin),
        )
        with self._gl.state(into=self._map.framebuffer):
            fill_cells(self._capture, np.asarray(shows(view, _DIRECTIONS @ view.axes.T, _WIDER).any(1)))
        if counts:
            self._seen_from[shows(view, self._directions @ view.axes.T)] = view.position

    def holds(self, rays: Array, position: Array) -> Mask:
        """Return which directions were seen from near the viewer's place.

        Parameters
        ----------
        rays : (n, 3), world, of any length above 0.
        position : (3,), of the viewer, world, metres.

        Returns
        -------
        (n,), whether some frame saw that direction from at most `_NEAR_ENOUGH` metres away.
        """
        column, row = np.round((square_from_direction(rays, False) + 1) / 2 * (_CELLS - 1)).astype(int).T
        seen_from = self._seen_from[row * _CELLS + column]
        return np.asarray(np.linalg.norm(seen_from - position, axis=-1) <= _NEAR_ENOUGH)

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
            "surround_viewer": tuple(view.position - (view.position if self._origin is None else self._origin)),
        }
