"""Show a finished picture as it appears to a camera that has moved since.

A finished frame is itself a depth image: its colours, how far away each is, and the camera that it was seen through. So
while the next frame is drawn, which may take long, the last one can follow the viewer at the cost of a few texture
reads per pixel. What the picture does not hold is filled: beyond its edges by its mirror image, behind an object that
has moved aside from the farther side. The shader is shaders/reprojection/reprojection.frag, its twin in NumPy
`reference.reprojection`.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.targets import Targets
from depthwalk.render.view.view import View

BEYOND = 1e6  # metres: how far away that counts as being which nothing was drawn, the sky
FIXED_POINT_STEPS = 2  # a third changes next to nothing
CELL = 16  # pixels along a cell, for each of which the nearest surface is known
REACH = 24  # pixels around a cell that count as well: by how much a thing may move and still be found
_JUDGED = 16, 12  # columns and rows of rays that tell how much of a view a picture holds
HIDDEN = 0.95  # what is nearer than this part of the distance that a search ends at hides what the search looks for


def widened(view: View, margin: float) -> View:
    """Return `view` with more picture on every side: `margin` times its width and height, in whole pixels.

    The pixels that both have in common are the same.
    """
    width, height = view.size
    size = width + 2 * round(margin * width), height + 2 * round(margin * height)
    fov = 2 * math.atan(math.tan(view.camera.fov / 2) * size[1] / height)
    return replace(view, camera=replace(view.camera, fov=fov), size=size)


def seen_from(picture: View, view: View) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return another camera as the camera of a picture sees it: right, up and ahead of that, metres.

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


class _Image(NamedTuple):
    """Hold a texture and the framebuffer that draws into it."""

    texture: moderngl.Texture
    framebuffer: moderngl.Framebuffer


@dataclass(frozen=True, kw_only=True)
class _Images:
    """Hold the finished picture, that which is being drawn, and what is known of the distances in the first."""

    size: tuple[int, int]
    shown: _Image
    drawn: _Image
    distances: _Image
    nearest: _Image

    def __iter__(self) -> Iterator[_Image]:
        yield from (self.shown, self.drawn, self.distances, self.nearest)


class Reprojection:
    """Keep the last finished picture, and show it through other cameras.

    Parameters
    ----------
    device : the GPU that draws.

    Attributes
    ----------
    view : the view of the finished picture; None: there is none.
    """

    def __init__(self, device: Device) -> None:
        self._gl = device.scope("reprojection")
        vertex = "common/fullscreen.vert"
        self._distance = Program(self._gl, vertex, "reprojection/distance.frag")
        self._nearest = Program(self._gl, vertex, "reprojection/nearest.frag")
        self._programs = Variants(
            lambda defines: Program(self._gl, vertex, "reprojection/reprojection.frag", defines=defines)
        )
        self.view: View | None = None
        self._images: _Images | None = None

    def canvas(self, size: tuple[int, int]) -> moderngl.Framebuffer:
        """Return the framebuffer of `size` (width, height), pixels, to draw the next picture into.

        Another size than before loses the finished picture.
        """
        if self._images is None or self._images.size != size:
            self._forget()
            cells = -(-size[0] // CELL), -(-size[1] // CELL)
            self._images = _Images(
                size=size,
                shown=self._image(size, 4, "f1"),
                drawn=self._image(size, 4, "f1"),
                distances=self._image(size, 1, "f4"),
                nearest=self._image(cells, 1, "f4"),
            )
            for image in (self._images.shown, self._images.drawn):
                image.texture.filter = moderngl.LINEAR, moderngl.LINEAR
        return self._images.drawn.framebuffer

    def _image(self, size: tuple[int, int], components: int, dtype: str) -> _Image:
        texture = self._gl.texture(size, components, dtype)
        return _Image(texture, self._gl.framebuffer([texture]))

    def take(self, targets: Targets, view: View) -> None:
        """Make what was drawn into `canvas` the finished picture.

        Parameters
        ----------
        targets : those that the picture was made of, with its depths.
        view : the view of the picture, near and far plane fitted, of the size of the canvas.
        """
        if self._images is None:
            raise ValueError("no picture was drawn: there is no canvas yet")
        distances, nearest = self._images.distances, self._images.nearest
        targets.depth.use(0)
        self._distance.set(depth_texture=0, planes=view.depth_range)
        with self._gl.state(into=distances.framebuffer):
            self._distance.fill()
        distances.texture.use(0)
        self._nearest.set(distances=0)
        with self._gl.state(into=nearest.framebuffer):
            self._nearest.fill()
        self._images = replace(self._images, shown=self._images.drawn, drawn=self._images.shown)
        self.view = view

    def show(self, view: View, screen: moderngl.Framebuffer) -> None:
        """Draw the finished picture into `screen` as `view` would see it, whose size is that of the screen."""
        if self.view is None or self._images is None:
            raise ValueError("there is no finished picture yet")
        for unit, image in enumerate((self._images.shown, self._images.distances, self._images.nearest)):
            image.texture.use(unit)
        wide, high = ((whole - part) for whole, part in zip(self.view.size, view.size, strict=True))
        same = (self.view.camera.position, self.view.camera.target) == (view.camera.position, view.camera.target)
        is_part = math.isclose(self.view.focal_pixels, view.focal_pixels) and wide % 2 == high % 2 == 0
        program = self._programs[("EXACT",) if same and is_part else ()]
        rays, viewer, axis = seen_from(self.view, view)
        program.set(
            picture=0,
            distances=1,
            nearest=2,
            ray_from_screen=tuple(rays.T.ravel()),
            viewer=tuple(viewer),
            axis=tuple(axis),
            half_extent=self.view.half_extent,
            margin=(wide // 2, high // 2),
        )
        with self._gl.state(into=screen):
            program.fill()

    def unseen(self, view: View) -> float:
        """Return which part of what `view` sees lies beyond the edges of the finished picture, 0 to 1.

        It is judged by some rays, as if all that they meet were far away; 1 without a picture.
        """
        if self.view is None:
            return 1.0
        x, y = np.meshgrid(*(2 * (np.arange(count) + 0.5) / count - 1 for count in _JUDGED))
        rays = np.stack([x, y, np.ones_like(x)], -1) @ seen_from(self.view, view)[0].T
        beyond = np.abs(rays[..., :2]) > rays[..., 2:] * np.array(self.view.half_extent)
        return float(beyond.any(-1).mean())

    def distance_at(self, view: View, across: float, down: float) -> float:
        """Return how far away the surface is that `show` shows at a place. Waits for the GPU.

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
        rays, viewer, axis = seen_from(self.view, view)
        ray = rays @ (2 * across - 1, 1 - 2 * down, 1)
        point, along = ray, 0.0
        for _ in range(FIXED_POINT_STEPS + 1):
            ahead = self._distance_to(point)
            if ahead >= BEYOND:
                return math.inf
            along = float(axis @ (point / max(point[2], 1e-3) * ahead - viewer))
            point = viewer + along * ray
        return along

    def _distance_to(self, point: NDArray[np.float64]) -> float:
        """Return how far ahead the picture's surface is in front of or behind a point (3,), metres, of its camera."""
        assert self.view is not None and self._images is not None
        size = np.array(self.view.size)
        place = 0.5 + 0.5 * point[:2] / (max(point[2], 1e-3) * np.array(self.view.half_extent))
        x, y = np.clip((place * size).astype(int), 0, size - 1).tolist()
        return float(np.frombuffer(self._images.distances.framebuffer.read((x, y, 1, 1), 1, dtype="f4"), np.float32)[0])

    def _forget(self) -> None:
        for image in self._images or ():
            self._gl.free(image.framebuffer, image.texture)
        self._images = self.view = None

    def release(self) -> None:
        """Free everything on the GPU."""
        self._gl.release()
        self._images = self.view = None
