"""What a frame is seen through: a camera, an image size and the matrices that follow from them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthwalk.scene.arrays import Camera
from depthwalk.scene.camera import clip_from_view, view_from_world


@dataclass(frozen=True)
class View:
    """camera; size: (width, height) in pixels; near, far: metres along the view axis, None where the renderer is to
    fit them to what is seen; shear: what is one metre along the view axis appears so far, right and up, metres, from
    where it would without: the frustum of a camera that was moved aside and still sees the same rectangle."""

    camera: Camera
    size: tuple[int, int]
    near: float | None = None
    far: float | None = None
    shear: tuple[float, float] = (0.0, 0.0)

    @property
    def depth_range(self) -> tuple[float, float]:
        """near and far, once they are known."""
        if self.near is None or self.far is None:
            raise ValueError("the view's near and far plane are not fitted yet")
        return self.near, self.far

    @cached_property
    def position(self) -> NDArray[np.float64]:
        """The viewer (3,), world."""
        return np.asarray(self.camera.position, float)

    @cached_property
    def axes(self) -> NDArray[np.float64]:
        """Rows right, up, forward (3, 3), world, which give view coordinates; unit vectors but for the shear."""
        axes = self.view_from_world[:3, :3].copy()
        axes[2] *= -1
        return axes

    @cached_property
    def view_from_world(self) -> NDArray[np.float64]:
        matrix = view_from_world(self.camera)
        matrix[:2] -= np.outer(self.shear, matrix[2])
        return matrix

    @cached_property
    def clip_from_view(self) -> NDArray[np.float64]:
        return clip_from_view(self.camera.fov, self.size[0] / self.size[1], *self.depth_range)

    @cached_property
    def clip_from_eye(self) -> NDArray[np.float64]:
        """Clip coordinates of a world vector from the viewer: no large translation, so float32 keeps its precision."""
        rotation = np.eye(4)
        rotation[:3, :3] = self.view_from_world[:3, :3]
        return self.clip_from_view @ rotation

    @cached_property
    def ray_from_screen(self) -> NDArray[np.float64]:
        """(3, 3): takes (x, y, 1), x and y from −1 to 1 over the picture, to the world vector from the viewer to what
        is there at one metre along the view axis."""
        return np.asarray(np.linalg.inv(self.axes) * [*self.half_extent, 1.0])

    @property
    def half_extent(self) -> tuple[float, float]:
        """Tangents of half the horizontal and half the vertical angle of view."""
        vertical = float(np.tan(self.camera.fov / 2))
        return vertical * self.size[0] / self.size[1], vertical

    @property
    def focal_pixels(self) -> float:
        """Distance of the image plane in pixels: a metre at one metre's distance covers this many."""
        return self.size[1] / (2 * self.half_extent[1])


def view_distance(depth: NDArray[np.float32], near: float, far: float) -> NDArray[np.float32]:
    """Metres along the view axis, float32, of a depth buffer's values 0–1; +inf for 1, which is where nothing is."""
    with np.errstate(divide="ignore"):
        distance = near * far / (far - depth.astype(np.float64) * (far - near))
    return np.where(depth < 1, distance, np.inf).astype(np.float32)
