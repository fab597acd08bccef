"""Turning about what a camera looks at: from camera to camera. Pure mathematics: no window, no clock."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.scene.arrays import Camera
from depthwalk.scene.camera import view_from_world
from depthwalk.walk.controls import MAX_PITCH, direction, heading

RADIANS_PER_PIXEL = math.radians(0.4)
CLOSER_PER_NOTCH = 0.9  # factor of the distance, per notch of the wheel
DISTANCE_RANGE = 1e-4, 1e6  # metres
_AIMING = 0.08  # s in which what is left to turn falls to 1/e
_ARRIVED = 1e-3  # of the distance


def turn(camera: Camera, right: float, down: float) -> Camera:
    """Go round the target, so that what is seen follows a drag of the mouse, in pixels."""
    yaw, pitch = heading(_look(camera))
    pitch = min(max(pitch - down * RADIANS_PER_PIXEL, -MAX_PITCH), MAX_PITCH)
    look = direction(yaw - right * RADIANS_PER_PIXEL, pitch)
    return replace(camera, position=_point(np.subtract(camera.target, distance(camera) * look)))


def pan(camera: Camera, right: float, down: float) -> Camera:
    """Move camera and target sideways, so that what is seen at the target's distance follows a drag of the mouse, in
    heights of the picture."""
    sideways, up, _ = view_from_world(camera)[:3, :3]
    height = 2 * distance(camera) * math.tan(camera.fov / 2)
    return move(camera, (down * up - right * sideways) * height)


def dolly(camera: Camera, notches: float) -> Camera:
    """Go nearer to the target by notches of the wheel, or farther away."""
    wanted = min(max(distance(camera) * CLOSER_PER_NOTCH**notches, DISTANCE_RANGE[0]), DISTANCE_RANGE[1])
    look = _look(camera)
    return replace(camera, position=_point(np.subtract(camera.target, look * (wanted / np.linalg.norm(look)))))


def move(camera: Camera, shift: NDArray[np.float64]) -> Camera:
    """Camera and target moved by `shift` (3,), metres, world."""
    return replace(camera, position=_point(camera.position + shift), target=_point(camera.target + shift))


def with_distance(camera: Camera, metres: float) -> Camera:
    """The same view, its target at that distance; as near and as far as targets may be."""
    look = _look(camera)
    metres = min(max(metres, DISTANCE_RANGE[0]), DISTANCE_RANGE[1])
    return replace(camera, target=_point(camera.position + look * (metres / np.linalg.norm(look))))


def aim(camera: Camera, point: NDArray[np.float64], dt: float) -> tuple[Camera, bool]:
    """Look towards `point` (3,), world, for `dt` seconds; and whether it is reached."""
    left = np.subtract(camera.target, point) * math.exp(-dt / _AIMING)
    arrived = bool(np.linalg.norm(left) < _ARRIVED * np.linalg.norm(camera.position - point))
    return replace(camera, target=_point(point if arrived else point + left)), arrived


def distance(camera: Camera) -> float:
    """Metres from the camera to its target."""
    return math.dist(camera.position, camera.target)


def _look(camera: Camera) -> NDArray[np.float64]:
    return np.subtract(camera.target, camera.position)


def _point(vector: NDArray[np.floating]) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
