"""Move a camera by keys, wheel and mouse, independent of window and clock.

Motion is integrated in closed form, so that a second of it ends at the same place at 3 and at 300 frames per second.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import MAX_SPEED, MIN_SPEED

EYE_HEIGHT = 1.7  # metres above the ground, when walking begins in the air
EYE_HEIGHTS = 1.0, 2.5  # metres above the ground: range in which a camera counts as walking
MAX_PITCH = math.radians(89.0)
RADIANS_PER_PIXEL = math.radians(0.12)
SPEED_PER_NOTCH = 1.2  # factor, per notch of the wheel
SPEED_RANGE = MIN_SPEED, MAX_SPEED
_SPEED = 3.0  # m/s, a brisk pace
_CROSSING = 5.0, 120.0  # s, range of the time to cross a scene at its natural speed
FAST = 4.0  # factor while Shift is held
LONGEST_STEP = 1.0  # s: after a pause (a moved window, a sleeping computer) the camera must not jump
TAP = 0.08  # s: duration of a key press whose press and release arrive together, since the events carry no times
_STANDSTILL = 1e-4  # m/s: smaller differences from the requested velocity are ignored
_LEVEL = 1e-5  # metres: within this distance, walking height is reached
_RESPONSE = 14.0  # 1/s: rate at which velocity and walking height approach their targets


class Move(IntEnum):
    """Name the six directions in which keys move; opposite ones have consecutive numbers."""

    RIGHT = 0
    LEFT = 1
    UP = 2
    DOWN = 3
    FORWARD = 4
    BACK = 5

    @property
    def opposite(self) -> "Move":
        """Return the opposite direction."""
        return Move(self ^ 1)


class HeldKeys:
    """Measure for how long each direction was requested within a frame."""

    def __init__(self) -> None:
        self._down: set[Move] = set()
        self._tapped: set[Move] = set()
        self._fresh: set[Move] = set()
        self._leaning: dict[Move, float] = {}

    def lean(self, move: Move, share: float) -> None:
        """Record for the frame that ends next that a stick asks for `move`, as if held for a part of it, 0 to 1."""
        self._leaning[move] = share

    def press(self, move: Move) -> None:
        """Record that a key for `move` was pressed."""
        self._down.add(move)
        self._fresh.add(move)

    def release(self, move: Move) -> None:
        """Record that the key for `move` was released.

        If it was pressed in the same frame, the move counts for TAP seconds.
        """
        if move in self._fresh:
            self._tapped.add(move)
        self._down.discard(move)

    def take(self, dt: float) -> dict[Move, float]:
        """End a frame of `dt` seconds, and return for how many seconds each move was held, 0 to `dt`.

        Moves that were not requested are missing.
        """
        held = {move: share * dt for move, share in self._leaning.items()}
        held |= {move: min(dt, TAP) for move in self._tapped} | dict.fromkeys(self._down, dt)
        self._leaning.clear()
        self._tapped.clear()
        self._fresh.clear()
        return held


@dataclass
class Walker:
    """Hold a viewer who walks or flies.

    Attributes
    ----------
    position
        Position of the eyes, metres, world.
    yaw
        Viewing direction about +Y, radians, positive to the left; 0 looks along −z.
    pitch
        Angle of the viewing direction above the horizon, radians, within ±MAX_PITCH.
    fov
        Vertical field of view, radians.
    speed
        Speed while a key is held, m/s.
    walking
        Whether the eyes stay `eye_height` above the ground; otherwise the viewer flies.
    eye_height
        Height of the eyes above the ground while walking, metres.
    velocity
        Present velocity, m/s, world.
    """

    position: glm.dvec3
    yaw: float
    pitch: float
    fov: float
    speed: float = _SPEED
    walking: bool = False
    eye_height: float = EYE_HEIGHT
    velocity: glm.dvec3 = field(default_factory=glm.dvec3)

    @classmethod
    def at(cls, camera: Camera) -> "Walker":
        """Return a viewer at rest with the position and direction of `camera`."""
        walker = cls(glm.dvec3(), 0.0, 0.0, camera.fov)
        walker.place(camera)
        return walker

    def place(self, camera: Camera) -> None:
        """Take the position and direction of `camera`, at rest; speed and mode are kept."""
        self.position = glm.dvec3(*camera.position)
        self.yaw, self.pitch = heading(camera.look, self.yaw)
        self.fov = camera.fov
        self.velocity = glm.dvec3()

    @property
    def camera(self) -> Camera:
        """Return the camera at the viewer's eyes; its target is one metre ahead."""
        ahead = self.position + direction(self.yaw, self.pitch)
        return Camera(components(self.position), components(ahead), self.fov)

    def look(self, right: float, down: float) -> None:
        """Turn by a mouse movement of `right` and `down` pixels, RADIANS_PER_PIXEL each."""
        self.yaw = math.remainder(self.yaw - right * RADIANS_PER_PIXEL, math.tau)
        self.pitch = glm.clamp(self.pitch - down * RADIANS_PER_PIXEL, -MAX_PITCH, MAX_PITCH)

    def spin(self, angle: float) -> None:
        """Turn to the right by `angle`, radians, on the spot."""
        self.yaw = math.remainder(self.yaw - angle, math.tau)

    def change_speed(self, notches: float) -> None:
        """Multiply the speed by SPEED_PER_NOTCH for each notch of the wheel, within SPEED_RANGE.

        Negative `notches` make the viewer slower.
        """
        self.speed = glm.clamp(self.speed * SPEED_PER_NOTCH**notches, *SPEED_RANGE)

    def advance(self, held: Mapping[Move, float], dt: float, *, fast: bool = False, ground: float = 0.0) -> None:
        """Move by the keys that are held, for the duration of one frame.

        Parameters
        ----------
        held
            For how long each move was held, seconds, 0 to `dt`; missing moves were not held.
        dt
            Time since the last frame, seconds; the viewer moves for at most LONGEST_STEP.
        fast
            Whether to move FAST times as fast.
        ground
            Height of the ground on which a walking viewer stands, metres, world y.
        """
        if dt <= 0:
            return
        step = min(dt, LONGEST_STEP)
        target = self._direction([min(held.get(move, 0.0), dt) / dt for move in Move])
        target *= self.speed * (FAST if fast else 1.0)
        decay = math.exp(-_RESPONSE * step)
        excess = self.velocity - target  # decays: v(t) = target + excess · e^(−kt), and the path is its integral
        self.position = self.position + target * step + excess * ((1 - decay) / _RESPONSE)
        self.velocity = target + excess * decay
        if glm.length(excess) * decay < _STANDSTILL:  # take the rest of the way at once, so that a viewer comes to rest
            self.velocity = target
            self.position = self.position + excess * (decay / _RESPONSE)
        if self.walking:
            eye = ground + self.eye_height
            above = (self.position.y - eye) * decay
            self.position.y = eye + (above if abs(above) > _LEVEL else 0.0)

    def _direction(self, shares: Sequence[float]) -> glm.dvec3:
        """Return the world direction, of length 1 at most, of moves that are held for these parts of the frame."""
        right, left, up, down, ahead, back = shares
        pitch, lift = (0.0, 0.0) if self.walking else (self.pitch, up - down)
        direction = orientation(self.yaw, pitch) * glm.dvec3(right - left, 0, back - ahead) + glm.dvec3(0, lift, 0)
        return direction / max(1.0, glm.length(direction))


def natural_speed(radius: float) -> float:
    """Return the speed, m/s, that suits a scene whose objects are within a sphere of `radius`, metres.

    It is a brisk walking pace, unless crossing the scene would then take less than 5 or more than 120 seconds.
    """
    fastest, slowest = (glm.clamp(2 * radius / seconds, *SPEED_RANGE) for seconds in _CROSSING)
    return float(glm.clamp(_SPEED, slowest, fastest))


def orientation(yaw: float, pitch: float) -> glm.dquat:
    """Return the rotation, world, that turns the direction −z into a viewing direction.

    Parameters
    ----------
    yaw
        Turn about +Y, radians, positive to the left; 0 looks along −z.
    pitch
        Angle of the viewing direction above the horizon, radians, positive upward.

    Returns
    -------
    glm.dquat
        The rotation.
    """
    return glm.dquat(glm.dvec3(pitch, yaw, 0))


def direction(yaw: float, pitch: float) -> glm.dvec3:
    """Return the unit vector, world, along which a viewer looks; see `orientation` for `yaw` and `pitch`, radians."""
    return orientation(yaw, pitch) * glm.dvec3(0, 0, -1)


def heading(look: glm.dvec3, yaw: float = 0.0) -> tuple[float, float]:
    """Return the yaw and the pitch of a viewer who looks along a vector.

    Parameters
    ----------
    look
        Viewing direction, world, of any length.
    yaw
        Yaw to return for a direction straight up or down, which does not determine one, radians.

    Returns
    -------
    tuple[float, float]
        Yaw, and pitch within ±MAX_PITCH, radians.
    """
    level = math.hypot(look.x, look.z)
    if level > 1e-9:
        yaw = math.atan2(-look.x, -look.z)
    return yaw, glm.clamp(math.atan2(look.y, level), -MAX_PITCH, MAX_PITCH)
