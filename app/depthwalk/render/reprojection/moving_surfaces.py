"""Find which pixels of a finished picture show something that moves by itself, and how fast it moves there.

The G-buffer does not say which object a pixel shows. But a surface that lies within the cylinder of a moving object is
most likely that object's, so each moving object draws a rectangle around its cylinder, and the pixels in it whose
surfaces are inside get the velocity of a rigid body there: v + ω × r. What an object stands on stays where it is.
"""

from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.gpu.program import Program
from depthwalk.render.image import Image
from depthwalk.render.reprojection.nearest_cells import CELL
from depthwalk.render.view.view import View
from depthwalk.render.world.moving_objects import MovingObjects

BASE = 0.003  # part of a cylinder's height, at its lower end, that counts as what the object stands on
GROWN = 1.01  # factor of a cylinder: depths are rounded, and simplified levels reach farther than the object

MOVING_RECORD = np.dtype([("centre", "4f4"), ("axis", "4f4"), ("velocity", "4f4"), ("turn", "4f4")])
"""What the shader is given of a moving object, in the axes of the picture's camera.

Fields: centre, metres, and half the height; unit axis and radius; the velocity at the camera, m/s, with its linear
growth, 1/s; and the rate of turn, radians per second.
"""


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
        self._records = RecordTexture(gl, MOVING_RECORD)

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
            self._records.upload(records(moving, view))
            self._records.use(1)
            self._velocity.set(distances=0, objects=1, half_extent=view.half_extent)
            with self._gl.state(into=images.velocities.framebuffer):
                self._velocity.rectangles(count)
        images.velocities.texture.use(1)
        self._nearest.set(distances=0, velocities=1)
        with self._gl.state(into=images.nearest.framebuffer):
            self._nearest.fill()


def records(moving: MovingObjects, view: View) -> NDArray[np.void]:
    """Return the n MOVING_RECORDs of moving objects, in the axes of the camera of `view`."""
    axes, eye = view.axes, view.position
    shape, growth = moving.cylinders, moving.growth[:, None]
    # The velocity of a rigid body at the camera's place: at any other point p, ω × p and the growth times p are added.
    there = moving.velocity + np.cross(moving.turn, eye - moving.pivot) + growth * (eye - moving.pivot)
    data = np.zeros(len(there), MOVING_RECORD)
    data["centre"] = np.column_stack([(shape.centre - eye) @ axes.T, shape.half_height])
    data["axis"] = np.column_stack([shape.axis @ axes.T, shape.radius])
    data["velocity"] = np.column_stack([there @ axes.T, moving.growth])
    # Right, up and ahead are left-handed: a cross product there has the opposite sign.
    data["turn"][:, :3] = -(moving.turn @ axes.T)
    return data
