"""The camera's matrices. Column vectors: `clip_from_view @ view_from_world @ world point`. All (4, 4) float64."""

import math

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.rotation import cross
from depthwalk.scene.arrays import Camera

_UP, _SOUTH = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
_LOOK = np.array([0.0, 0.0, -1.0])  # where a camera looks whose target is its position


def view_from_world(camera: Camera) -> NDArray[np.float64]:
    """The rigid transform into the camera's frame: x right, y up, looking along −z.

    Straight up and down, the top of the picture lies towards +z and −z of the world.
    """
    eye = np.asarray(camera.position, float)
    forward = _direction(np.asarray(camera.target, float) - eye)
    right = cross(forward, _UP)
    if np.linalg.norm(right) < 1e-6:  # no direction of the picture is "up": choose
        right = cross(forward, forward[1] * _SOUTH)
    right = _direction(right)
    view = np.eye(4)
    view[:3, :3] = right, cross(right, forward), -forward
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def clip_from_view(fov: float, aspect: float, near: float, far: float) -> NDArray[np.float64]:
    """OpenGL's perspective: depth −1 at `near`, 1 at `far`.

    fov: vertical angle, radians; aspect: width / height; near, far: metres, 0 < near < far, far may be inf.
    """
    focal = 1 / math.tan(fov / 2)
    a, b = (-1.0, -2 * near) if math.isinf(far) else ((far + near) / (near - far), 2 * far * near / (near - far))
    return np.array([[focal / aspect, 0, 0, 0], [0, focal, 0, 0], [0, 0, a, b], [0, 0, -1, 0]], float)


def _direction(vector: NDArray[np.floating]) -> NDArray[np.floating]:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0 else _LOOK
