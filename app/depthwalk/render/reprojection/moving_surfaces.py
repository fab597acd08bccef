"""Find which pixels of a finished picture show something that moves by itself, and how fast it moves there.

The G-buffer does not say which object a pixel shows. But a surface that lies within the cylinder of a moving object is
most likely that object's, so each moving object draws a rectangle around its cylinder, and the pixels in it whose
surfaces are inside get the velocity of a rigid body there: v + ω × r. What an object stands on stays where it is.
"""

from typing import NamedTuple

import moderngl
import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.render.image import Image
from depthwalk.render.reprojection.cell_size import CELL
from depthwalk.render.view.view import View
from depthwalk.render.world.moving_objects import MovingObjects
from depthwalk.types import Array

BASE = 0.003  # part of a cylinder's height, at its lower end, that counts as what the object stands on
GROWN = 1.01  # factor of a cylinder: depths are rounded, and simplified levels reach farther than the object
RECORD = 4  # texels for each object
COLUMNS = 256  # objects in a row of the texture that holds them


class MovingImages(NamedTuple):
    """Hold the velocities of a picture's surfaces.

    Attributes
    ----------
    velocities : of each pixel, metres per second to the right, up and ahead of the picture's camera; w is 1 where
        something moves, else 0.
    nearest : for each cell of the picture, the velocity of the nearest surface in it that moves, and how far ahead that
        is, metres; `BEYOND` where nothing moves.
    """

    velocities: Image
    nearest: Image


class MovingSurfaces:
    """Draw the velocities of the surfaces of finished pictures.

    Parameters
    ----------
    gl : the owner of everything on the GPU.
    """

    def __init__(self, gl: Scope) -> None:
        self._gl = gl
        self._velocity = Program(gl, "reprojection/velocity.vert", "reprojection/velocity.frag")
        self._nearest = Program(gl, "common/fullscreen.vert", "reprojection/moving_nearest.frag")
        self._records: moderngl.Texture | None = None

    def make(self, size: tuple[int, int]) -> MovingImages:
        """Create the images for pictures of `size` (width, height), pixels."""
        cells = -(-size[0] // CELL), -(-size[1] // CELL)
        return MovingImages(Image.make(self._gl, size, 4, "f2"), Image.make(self._gl, cells, 4, "f4"))

    def free(self, images: MovingImages) -> None:
        """Free images that are no longer needed."""
        for image in images:
            image.free(self._gl)

    def measure(self, images: MovingImages, distances: moderngl.Texture, view: View, moving: MovingObjects) -> None:
        """Fill in the velocities of a finished picture.

        Parameters
        ----------
        images : what is filled in.
        distances : of the picture, see `DepthPicture`.
        view : its view.
        moving : what moves, as it was when the picture was drawn.
        """
        distances.use(0)
        images.velocities.framebuffer.clear()
        count = len(moving.velocity)
        if count:
            self._upload(records(moving, view)).use(1)
            self._velocity.set(distances=0, objects=1, half_extent=view.half_extent)
            with self._gl.state(into=images.velocities.framebuffer):
                self._velocity.rectangles(count)
        images.velocities.texture.use(1)
        self._nearest.set(distances=0, velocities=1)
        with self._gl.state(into=images.nearest.framebuffer):
            self._nearest.fill()

    def _upload(self, data: Array) -> moderngl.Texture:
        """Return a texture that holds the records (n, RECORD, 4) of objects, `COLUMNS` in a row."""
        rows = -(-len(data) // COLUMNS)
        size = RECORD * COLUMNS, rows
        if self._records is None or self._records.size != size:
            if self._records is not None:
                self._gl.free(self._records)
            self._records = self._gl.texture(size, 4, "f4")
        whole = np.zeros((rows * COLUMNS, RECORD, 4), np.float32)
        whole[: len(data)] = data
        self._records.write(whole)
        return self._records


def records(moving: MovingObjects, view: View) -> Array:
    """Return what the shader is given of n moving objects, in the axes of the camera of `view`.

    Returns
    -------
    (n, RECORD, 4): centre, metres, and half the height; unit axis and radius; the velocity at the camera, m/s, with its
    linear growth, 1/s; and the rate of turn, radians per second.
    """
    axes, eye = view.axes, view.position
    shape, growth = moving.cylinders, moving.growth[:, None]
    # The velocity of a rigid body at the camera's place: at any other point p, ω × p and the growth times p are added.
    there = moving.velocity + np.cross(moving.turn, eye - moving.pivot) + growth * (eye - moving.pivot)
    data = np.zeros((len(there), RECORD, 4))
    data[:, 0, :3], data[:, 0, 3] = (shape.centre - eye) @ axes.T, shape.half_height
    data[:, 1, :3], data[:, 1, 3] = shape.axis @ axes.T, shape.radius
    data[:, 2, :3], data[:, 2, 3] = there @ axes.T, moving.growth
    # Right, up and ahead are left-handed: a cross product there has the opposite sign.
    data[:, 3, :3] = -(moving.turn @ axes.T)
    return data
