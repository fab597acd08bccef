"""From keys, wheel and mouse to a camera. Pure mathematics: no window, no clock.

Motion is integrated in closed form, so that a second of it ends at the same place at 3 and at 300 frames a second.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import MAX_SPEED, MIN_SPEED

EYE_HEIGHT = 1.7  # metres above the ground, walking
MAX_PITCH = math.radians(89.0)
RADIANS_PER_PIXEL = math.radians(0.12)
SPEED_PER_NOTCH = 1.2  # factor, per notch of the wheel
SPEED_RANGE = MIN_SPEED, MAX_SPEED
_SPEED = 3.0  # m/s, of people in a hurry
_CROSSING = 5.0, 120.0  # s, that it takes to cross a scene at its natural speed
FAST = 4.0  # factor while Shift is held
LONGEST_STEP = 1.0  # s: after a stop (a moved window, a sleeping computer) the camera must not leap
TAP = 0.08  # s: taken for a key whose press and release arrive together; the events carry no times
_RESPONSE = 14.0  # 1/s: how fast velocity and walking height follow what is asked for


class Move(IntEnum):
    """What a key asks for; opposite moves are neighbours."""

    RIGHT = 0
    LEFT = 1
    UP = 2
    DOWN = 3
    FORWARD = 4
    BACK = 5


class HeldKeys:
    """How long each move was asked for within a frame."""

    def __init__(self) -> None:
        self._down: set[Move] = set()
        self._tapped: set[Move] = set()
        self._fresh: set[Move] = set()

    def press(self, move: Move) -> None:
        self._down.add(move)
        self._fresh.add(move)

    def release(self, move: Move) -> None:
        if move in self._fresh:
            self._tapped.add(move)
        self._down.discard(move)

    def take(self, dt: float) -> dict[Move, float]:
        """Seconds, 0 to dt, that each move was held in the last dt seconds; starts the next frame."""
        held = {move: min(dt, TAP) for move in self._tapped} | dict.fromkeys(self._down, dt)
        self._tapped.clear()
        self._fresh.clear()
        return held


@dataclass
class Walker:
    """A viewer who walks or flies.

    position: (3,) float64, metres, world; yaw: radians about +Y, 0 looks along −z, positive to the left; pitch: radians
    above the horizon; fov: vertical angle, radians; speed: m/s; walking: eyes EYE_HEIGHT above the ground, else flying;
    velocity: (3,) m/s, world.
    """

    position: NDArray[np.float64]
    yaw: float
    pitch: float
    fov: float
    speed: float = _SPEED
    walking: bool = False
    velocity: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def at(cls, camera: Camera) -> "Walker":
        walker = cls(np.zeros(3), 0.0, 0.0, camera.fov)
        walker.place(camera)
        return walker

    def place(self, camera: Camera) -> None:
        """Stand still where `camera` is; speed and mode stay."""
        self.position = np.array(camera.position, float)
        self.yaw, self.pitch = heading(np.subtract(camera.target, camera.position), self.yaw)
        self.fov = camera.fov
        self.velocity = np.zeros(3)

    @property
    def camera(self) -> Camera:
        """The target is one metre ahead."""
        x, y, z = self.position.tolist()
        u, v, w = (self.position + direction(self.yaw, self.pitch)).tolist()
        return Camera((x, y, z), (u, v, w), self.fov)

    def look(self, right: float, down: float) -> None:
        """Turn by a motion of the mouse, in pixels."""
        self.yaw = math.remainder(self.yaw - right * RADIANS_PER_PIXEL, math.tau)
        self.pitch = _clamp(self.pitch - down * RADIANS_PER_PIXEL, -MAX_PITCH, MAX_PITCH)

    def change_speed(self, notches: float) -> None:
        self.speed = _clamp(self.speed * SPEED_PER_NOTCH**notches, *SPEED_RANGE)

    def advance(self, held: Mapping[Move, float], dt: float, *, fast: bool = False, ground: float = 0.0) -> None:
        """Move for `dt` seconds, each move being held for `held[move]` of them, on the ground at y = `ground`."""
        if dt <= 0:
            return
        seconds = np.array([min(held.get(move, 0.0), dt) for move in Move])
        step = min(dt, LONGEST_STEP)
        wanted = self._direction(seconds / dt) * self.speed * (FAST if fast else 1.0)
        decay = math.exp(-_RESPONSE * step)
        excess = self.velocity - wanted  # fades: v(t) = wanted + excess · e^(−kt), and the path is its integral
        self.position = self.position + wanted * step + excess * ((1 - decay) / _RESPONSE)
        self.velocity = wanted + excess * decay
        if self.walking:
            eye = ground + EYE_HEIGHT
            self.position[1] = eye + (self.position[1] - eye) * decay

    def _direction(self, shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """The world direction of moves held for these shares of the frame (6,): at most of length 1."""
        right, up, ahead = shares[0::2] - shares[1::2]
        if self.walking:
            up = 0.0
        forward = direction(self.yaw, 0.0 if self.walking else self.pitch)
        sideways = np.array([math.cos(self.yaw), 0.0, -math.sin(self.yaw)])
        wanted = right * sideways + up * np.array([0.0, 1.0, 0.0]) + ahead * forward
        return wanted / max(1.0, float(np.linalg.norm(wanted)))


def natural_speed(radius: float) -> float:
    """The speed, m/s, that suits a scene whose objects are within a sphere of `radius`, metres: that of people, unless
    they would cross it in no time, or take forever."""
    fastest, slowest = (_clamp(2 * radius / seconds, *SPEED_RANGE) for seconds in _CROSSING)
    return _clamp(_SPEED, slowest, fastest)


def direction(yaw: float, pitch: float) -> NDArray[np.float64]:
    """The unit vector (3,) of who looks there, world."""
    level = math.cos(pitch)
    return np.array([-math.sin(yaw) * level, math.sin(pitch), -math.cos(yaw) * level])


def heading(look: NDArray[np.float64], yaw: float = 0.0) -> tuple[float, float]:
    """Yaw and pitch of a look along `look` (3,), world; `yaw` is that of a look straight up or down. The pitch is
    within MAX_PITCH."""
    level = math.hypot(look[0], look[2])
    if level > 1e-9:
        yaw = math.atan2(-look[0], -look[2])
    return yaw, _clamp(math.atan2(look[1], level), -MAX_PITCH, MAX_PITCH)


def _clamp(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
