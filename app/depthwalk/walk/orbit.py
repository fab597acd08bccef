"""Turn a camera about its target, move it sideways, and bring it nearer.

Each function takes a camera and returns another, independent of window and clock.
"""

import math
from dataclasses import replace
from enum import Enum

from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.scene.arrays import Camera
from depthwalk.scene.camera import view_from_world
from depthwalk.walk.controls import MAX_PITCH, direction, heading

RADIANS_PER_PIXEL = math.radians(0.4)
CLOSER_PER_NOTCH = 0.9  # factor on the distance, per notch of the wheel
DISTANCE_RANGE = 1e-4, 1e6  # metres
TURNTABLE = math.radians(30.0)  # per second
LOOK_AROUND = TURNTABLE / 2  # of a walking viewer, who sees more of the scene pass by
_AIMING = 0.08  # s in which the remaining turn falls to 1/e
_ARRIVED = 1e-3  # of the distance
_SAME_SIDE = math.cos(math.radians(1.0))


class Side(Enum):
    """Name the sides from which to look at objects; a value is yaw and pitch of the viewing direction, radians."""

    FRONT = 0.0, 0.0
    RIGHT = math.pi / 2, 0.0
    ABOVE = 0.0, -MAX_PITCH
    BACK = math.pi, 0.0
    LEFT = -math.pi / 2, 0.0
    BELOW = 0.0, MAX_PITCH

    @property
    def look(self) -> glm.dvec3:
        """Return the unit vector, world, along which a camera looks from this side."""
        return direction(*self.value)

    @property
    def opposite(self) -> "Side":
        """Return the side across from this one."""
        sides = list(Side)
        return sides[(sides.index(self) + len(sides) // 2) % len(sides)]

    def unless_seen_along(self, look: glm.dvec3) -> "Side":
        """Return this side, or the opposite one if `look`, world, of any length, already looks from this side."""
        return self.opposite if glm.dot(glm.normalize(look), self.look) > _SAME_SIDE else self


def turn(camera: Camera, right: float, down: float) -> Camera:
    """Return `camera` turned about its target so that the picture follows a mouse drag.

    The pitch stays within ±MAX_PITCH; the distance to the target is unchanged.

    Parameters
    ----------
    camera
        The camera before.
    right
        How far the mouse moved to the right, pixels.
    down
        How far the mouse moved down, pixels.

    Returns
    -------
    Camera
        The camera after the drag.
    """
    yaw, pitch = heading(camera.look)
    pitch = glm.clamp(pitch - down * RADIANS_PER_PIXEL, -MAX_PITCH, MAX_PITCH)
    return _from_target(camera, direction(yaw - right * RADIANS_PER_PIXEL, pitch) * distance(camera))


def pan(camera: Camera, right: float, down: float) -> Camera:
    """Return a camera moved sideways together with its target, so that the picture follows a mouse drag.

    Surfaces at the target's distance follow the mouse exactly; nearer ones move more, farther ones less.

    Parameters
    ----------
    camera
        The camera before.
    right
        How far the mouse moved to the right, in heights of the picture.
    down
        How far the mouse moved down, in heights of the picture.

    Returns
    -------
    Camera
        The camera after the drag.
    """
    height = 2 * distance(camera) * math.tan(camera.fov / 2)
    # A row vector times a rotation is rotated by the inverse: from view to world.
    return camera.moved(glm.dvec3(-right, down, 0) * height * glm.dmat3(view_from_world(camera)))


def dolly(camera: Camera, notches: float) -> Camera:
    """Return `camera` brought nearer to its target, within DISTANCE_RANGE.

    Parameters
    ----------
    camera
        The camera before.
    notches
        How many notches the wheel was turned; negative numbers move the camera away.

    Returns
    -------
    Camera
        The nearer camera.
    """
    metres = glm.clamp(distance(camera) * CLOSER_PER_NOTCH**notches, *DISTANCE_RANGE)
    return _from_target(camera, glm.normalize(camera.look) * metres)


def with_distance(camera: Camera, metres: float) -> Camera:
    """Return `camera` with its target `metres` ahead, limited to DISTANCE_RANGE; position and direction stay."""
    look = glm.normalize(camera.look) * glm.clamp(metres, *DISTANCE_RANGE)
    return replace(camera, target=components(glm.dvec3(*camera.position) + look))


def aim(camera: Camera, point: glm.dvec3, dt: float) -> tuple[Camera, bool]:
    """Turn a camera towards a point, one step at a time.

    The distance between target and point decays exponentially, so that the turn takes equally long at any frame rate.

    Parameters
    ----------
    camera
        The camera before.
    point
        The point, metres, world.
    dt
        The time of this step, seconds.

    Returns
    -------
    tuple[Camera, bool]
        The camera, and whether its target has reached the point, which ends the turn.
    """
    left = (glm.dvec3(*camera.target) - point) * math.exp(-dt / _AIMING)
    arrived = glm.length(left) < _ARRIVED * glm.distance(glm.dvec3(*camera.position), point)
    return replace(camera, target=components(point if arrived else point + left)), arrived


def distance(camera: Camera) -> float:
    """Return the distance from `camera` to its own target, metres."""
    return float(glm.length(camera.look))


def _from_target(camera: Camera, look: glm.dvec3) -> Camera:
    """Place `camera` so that its target is at `look` from it."""
    return replace(camera, position=components(glm.dvec3(*camera.target) - look))
