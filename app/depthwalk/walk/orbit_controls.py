"""Hold the camera of the orbit mode, and move it from frame to frame: by mouse, by keys, and by itself.

The movements themselves are the functions of `orbit`; this module adds what lasts longer than one of them.
"""

from dataclasses import replace

from pyglm import glm

from depthwalk.scene.arrays import Camera
from depthwalk.walk import orbit
from depthwalk.walk.controls import Walker


class OrbitControls:
    """Hold a camera that orbits its target, and let a walker follow it.

    Attributes
    ----------
    camera
        The camera.
    """

    def __init__(self, walker: Walker, camera: Camera) -> None:
        self.camera = camera
        self._walker = walker
        self._next_target: glm.dvec3 | None = None  # metres, world: the point that the camera is turning towards

    def place(self, camera: Camera) -> None:
        """Continue from `camera` and about its target, with the walker at rest; end a turn towards another point."""
        self.camera, self._next_target = camera, None
        self._walker.place(camera)

    def stop(self) -> None:
        """End a turn towards another point."""
        self._next_target = None

    def turn(self, right: float, down: float) -> None:
        """Turn the camera about its target by a mouse drag of `right` and `down` pixels."""
        self._move(orbit.turn(self.camera, right, down))

    def spin(self, angle: float) -> None:
        """Turn the camera about its target by `angle`, radians, around the vertical."""
        self.turn(angle / orbit.RADIANS_PER_PIXEL, 0.0)

    def pan(self, right: float, down: float) -> None:
        """Move camera and target sideways by a mouse drag of `right` and `down` heights of the window."""
        self._next_target = None
        self._move(orbit.pan(self.camera, right, down))

    def dolly(self, notches: float) -> None:
        """Bring the camera nearer to its target by `notches` of the wheel; negative numbers move it away."""
        self._move(orbit.dolly(self.camera, notches))

    def set_fov(self, fov: float) -> None:
        """Change the vertical field of view to `fov`, radians."""
        self.camera = replace(self.camera, fov=fov)

    def aim_at(self, point: glm.dvec3) -> None:
        """Turn towards `point`, metres, world, during the next frames; it becomes the target."""
        self._next_target = point

    def advance(self, shift: glm.dvec3, dt: float) -> None:
        """Take the camera and its target along with the walker, then turn it towards the next target.

        Parameters
        ----------
        shift
            How far keys have moved the walker in this frame, metres, world.
        dt
            Time since the last frame, seconds.
        """
        self._move(self.camera.moved(shift))
        if self._next_target is not None:
            point = self._next_target + shift
            camera, has_arrived = orbit.aim(self.camera, point, dt)
            self._next_target = None if has_arrived else point
            self._move(camera)

    def _move(self, camera: Camera) -> None:
        """Move the camera and, with it, the walker, who keeps the velocity from the keys."""
        velocity = self._walker.velocity
        self._walker.place(camera)
        self._walker.velocity = velocity
        self.camera = camera
