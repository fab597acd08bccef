"""Compute the two matrices of a camera: from world to view coordinates, and from view to clip coordinates.

A matrix is a `glm.dmat4` and multiplies column vectors: `clip_from_view * view_from_world * world_point`. View
coordinates are OpenGL's: x to the right, y up, the camera looking along −z, in metres.
"""

import math
from collections.abc import Callable, Sequence

from pyglm import glm

from depthwalk.scene.arrays import Camera

# A camera that sees all objects, for a vertical field of view, radians, and a direction of view (3,), world.
FrameAll = Callable[[float, Sequence[float]], Camera]

_UP = glm.dvec3(0, 1, 0)
_SOUTH = glm.dvec3(0, 0, 1)
_AHEAD = glm.dvec3(0, 0, -1)  # viewing direction of a camera whose target is its position
_VERTICAL = 1e-6  # sine of the angle to the vertical below which a camera counts as looking straight up or down


def view_from_world(camera: Camera) -> glm.dmat4:
    """Return the rigid transform from world to view coordinates, metres, of `camera`.

    The top of the picture faces +y. Where the camera looks straight up the top faces +z, and where it looks straight
    down, −z.
    """
    eye, look = glm.dvec3(*camera.position), camera.look
    forward = glm.normalize(look) if glm.length(look) > 0 else _AHEAD
    vertical = math.hypot(forward.x, forward.z) < _VERTICAL
    turned = glm.lookAt(glm.dvec3(), forward, forward.y * _SOUTH if vertical else _UP)
    return turned * glm.translate(-eye)


def clip_from_view(fov: float, aspect: float, near: float, far: float) -> glm.dmat4:
    """Return OpenGL's perspective projection, which gives depth −1 at `near` and 1 at `far`.

    It is written out because `glm.perspective` computes in single precision only.

    Parameters
    ----------
    fov
        Vertical field of view, radians.
    aspect
        Width of the picture over its height.
    near, far
        Metres along the view axis, 0 < near < far; `far` may be infinite.

    Returns
    -------
    glm.dmat4
        The matrix that takes view coordinates to clip coordinates.
    """
    focal = 1 / math.tan(fov / 2)
    scale, shift = -1.0, -2 * near
    if not math.isinf(far):
        scale, shift = (far + near) / (near - far), 2 * far * near / (near - far)
    return glm.dmat4(focal / aspect, 0, 0, 0,
                     0, focal, 0, 0,
                     0, 0, scale, -1,
                     0, 0, shift, 0)  # fmt: skip
