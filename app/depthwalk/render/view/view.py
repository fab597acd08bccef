"""Describe what a frame is seen through: a camera, a picture's size and the matrices that follow from them.

Single matrices, vectors and quaternions are PyGLM's, in double precision (`glm.dmat4`, `glm.dvec3`, `glm.dquat`); work
on all objects at once is done by NumPy. So `View` offers `position`, `axes` and `ray_from_screen`, which are multiplied
with arrays of points, as NumPy arrays, and its other matrices as PyGLM's.

PyGLM stores matrices column by column, as GLSL does, and indexes them `matrix[column][row]`. `matrix_array` converts
one to a NumPy array that is indexed `[row, column]` and multiplies column vectors from the left; `glm.dmat4(array)`
converts such an array back. Beware of tuples: `glm.dvec3(values)` rounds the values of a tuple or a list to single
precision, as does arithmetic with them; `glm.dvec3(*values)` keeps them.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.scene.arrays import Camera
from depthwalk.scene.camera import clip_from_view, view_from_world
from depthwalk.types import Array


@dataclass(frozen=True)
class View:
    """Describe a camera together with the picture that it fills.

    Attributes
    ----------
    camera : where the viewer stands and looks, world.
    size : width and height of the picture, pixels.
    near, far : distances of the near and the far plane, metres along the view axis; None: the renderer fits them to the
        scene.
    shear : how far a point at one metre along the view axis is shifted in the picture to the right and up, metres. This
        gives the frustum of a camera that was moved aside and still sees the same rectangle.
    scale : size of the picture relative to the one that levels of detail are chosen for. It is below 1 for a picture
        that shows the objects of a larger one in fewer pixels, to be finished sooner.
    """

    camera: Camera
    size: tuple[int, int]
    near: float | None = None
    far: float | None = None
    shear: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0

    @property
    def depth_range(self) -> tuple[float, float]:
        """Return the distances of near and far plane, metres. Raises ValueError where they are not fitted yet."""
        if self.near is None or self.far is None:
            raise ValueError("the view's near and far plane are not fitted yet")
        return self.near, self.far

    def fitted(self, near: float, far: float) -> "View":
        """Return a view without near or far plane with both; all that is computed already stays so."""
        view = object.__new__(View)
        view.__dict__.update(self.__dict__, near=near, far=far)
        return view

    @cached_property
    def position(self) -> NDArray[np.float64]:
        """Return the position of the viewer, (3,), metres, world."""
        return np.asarray(self.camera.position, float)

    @cached_property
    def axes(self) -> NDArray[np.float64]:
        """Return the camera's directions right, up and forward, rows (3, 3), world; unit vectors without a shear.

        `axes @ (point - position)` is how far to the right, up and ahead of the viewer a point appears, metres.
        """
        return matrix_array(glm.dmat3(glm.scale(glm.dvec3(1, 1, -1)) * self.view_from_world))

    @cached_property
    def view_from_world(self) -> glm.dmat4:
        """Return the transform from world to view coordinates, both in metres: rigid without a shear."""
        right, up = self.shear
        shear = glm.dmat4()
        shear[2] = glm.dvec4(-right, -up, 1, 0)  # view coordinates look along −z
        return shear * view_from_world(self.camera)

    @cached_property
    def clip_from_view(self) -> glm.dmat4:
        """Return the perspective projection from view coordinates, metres, to clip coordinates.

        Raises ValueError where near and far plane are not fitted yet.
        """
        return clip_from_view(self.camera.fov, self.size[0] / self.size[1], *self.depth_range)

    @cached_property
    def clip_from_eye(self) -> glm.dmat4:
        """Return the transform from world vectors that begin at the viewer, metres, to clip coordinates.

        It holds no large translation, so that float32 keeps its precision far from the world's origin.
        """
        return self.clip_from_view * glm.dmat4(glm.dmat3(self.view_from_world))

    @cached_property
    def ray_from_screen(self) -> NDArray[np.float64]:
        """Return the matrix (3, 3) from places in the picture to rays.

        It takes (x, y, 1), with x and y from −1 to 1 over the picture, y upward, to a world vector in metres: from the
        viewer to the point that appears at that place, one metre away along the view axis.
        """
        unscreened = glm.dmat3(glm.scale(glm.dvec3(*self.half_extent, -1)))
        return matrix_array(glm.inverse(glm.dmat3(self.view_from_world)) * unscreened)

    @cached_property
    def half_extent(self) -> tuple[float, float]:
        """Return the tangents of half the horizontal and half the vertical angle of view."""
        vertical = math.tan(self.camera.fov / 2)
        return vertical * self.size[0] / self.size[1], vertical

    @cached_property
    def focal_pixels(self) -> float:
        """Return how many pixels a length of one metre covers at a distance of one metre along the view axis."""
        return self.size[1] / (2 * self.half_extent[1])

    @cached_property
    def whole_size(self) -> tuple[int, int]:
        """Return `size` as it would be with a `scale` of 1, to the nearest pixel."""
        return round(self.size[0] / self.scale), round(self.size[1] / self.scale)

    @cached_property
    def corner_cosine(self) -> float:
        """Return the cosine of the angle between the view axis and the farthest corner of the picture."""
        tangents = (abs(aside) + half for aside, half in zip(self.shear, self.half_extent, strict=True))
        return 1 / math.sqrt(1 + sum(tangent * tangent for tangent in tangents))

    @cached_property
    def detail_pixels(self) -> float:
        """Return `focal_pixels` for a `scale` of 1, by which levels of detail are chosen."""
        return self.focal_pixels / self.scale

    def unproject(self, across: float, down: float, distance: float) -> glm.dvec3:
        """Return the world point that the picture shows at a place and a distance.

        Parameters
        ----------
        across : part of the picture's width, from the left edge, 0 to 1.
        down : part of the picture's height, from the upper edge, 0 to 1.
        distance : metres along the view axis.

        Returns
        -------
        The point, metres, world.
        """
        ray = glm.dmat3(self.ray_from_screen) * glm.dvec3(2 * across - 1, 1 - 2 * down, 1)
        return glm.dvec3(*self.camera.position) + ray * distance


def viewer_in_object(view: View, position: Array, rotation: Array, scale: Array) -> Array:
    """Return the position of the viewer in the frames of n objects.

    Parameters
    ----------
    view : the view; only its position is used.
    position : (n, 3) positions of the objects, metres, world.
    rotation : (n, 4) unit quaternions (x, y, z, w) of the objects, world from object.
    scale : (n,) scales of the objects.

    Returns
    -------
    (n, 3) positions of the viewer, metres in the objects' frames.
    """
    return rotate(conjugate(rotation), view.position - position) / scale[:, None]


def matrix_array(matrix: glm.dmat3 | glm.dmat4) -> NDArray[np.float64]:
    """Return a copy of `matrix` as a NumPy array, (3, 3) or (4, 4), indexed `[row, column]`."""
    return np.array(matrix, np.float64, order="C")


def view_distance(depth: NDArray[np.float32], near: float, far: float) -> NDArray[np.float32]:
    """Convert values of a depth buffer to distances along the view axis.

    Parameters
    ----------
    depth : the buffer's values, 0 to 1, of any shape.
    near : distance of the near plane that the buffer was drawn with, metres.
    far : distance of the far plane, metres.

    Returns
    -------
    Metres, of the same shape; +inf where `depth` is 1, that is, where nothing was drawn.
    """
    with np.errstate(divide="ignore"):
        distance = near * far / (far - depth.astype(np.float64) * (far - near))
    return np.where(depth < 1, distance, np.inf).astype(np.float32)
