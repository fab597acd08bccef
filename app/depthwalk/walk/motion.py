"""Track the motion of a camera to predict where it will be."""

import math
from dataclasses import replace

from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.scene.arrays import Camera

_SMOOTHED = 0.1  # s over which velocities are averaged
_LEAST = 1e-9  # radians


class Motion:
    """Hold a camera's velocity and rate of turn."""

    def __init__(self) -> None:
        self._camera: Camera | None = None
        self._velocity = glm.dvec3()  # m/s, world
        self._pace = 0.0  # seconds of the scene's time in a second: 1 while its animations run, otherwise 0
        self._turn = glm.dvec3()  # rotation axis, world, whose length is the angle per second, radians

    def follow(self, camera: Camera, dt: float) -> None:
        """Record that the camera is at `camera` now, `dt` seconds after the last call.

        Velocities are averaged over a tenth of a second, except that those of a camera at rest are 0 at once.
        """
        before, self._camera = self._camera, camera
        if before is None or dt <= 0:
            return
        self._pace = (camera.time - before.time) / dt
        if (before.position, before.target) == (camera.position, camera.target):
            self._velocity, self._turn = glm.dvec3(), glm.dvec3()
            return
        moved = glm.dvec3(*camera.position) - glm.dvec3(*before.position)
        weight = min(1.0, dt / _SMOOTHED)
        self._velocity = glm.mix(self._velocity, moved / dt, weight)
        self._turn = glm.mix(self._turn, turn_between(before.look, camera.look) / dt, weight)

    def ahead(self, seconds: float) -> Camera:
        """Return the predicted camera in `seconds`, if its motion continues; see `follow`.

        Raises ValueError before the first call of `follow`.
        """
        if self._camera is None:
            raise ValueError("no camera has been followed yet")
        if seconds <= 0:
            return self._camera
        camera = replace(self._camera, time=self._camera.time + self._pace * seconds)
        if not (glm.length(self._velocity) or glm.length(self._turn)):
            return camera
        position = glm.dvec3(*self._camera.position) + self._velocity * seconds
        look, angle = self._camera.look, glm.length(self._turn) * seconds
        if angle > _LEAST:
            look = glm.angleAxis(angle, glm.normalize(self._turn)) * look
        return replace(camera, position=components(position), target=components(position + look))


def turn_between(before: glm.dvec3, after: glm.dvec3) -> glm.dvec3:
    """Return the rotation from one direction to another: its axis, world, whose length is the angle, radians.

    Parameters
    ----------
    before, after
        Directions, world, of any length above 0.

    Returns
    -------
    glm.dvec3
        The axis; 0 if both point the same way.
    """
    axis = glm.cross(glm.normalize(before), glm.normalize(after))
    sine = glm.length(axis)
    if sine < _LEAST:
        return glm.dvec3()
    return axis / sine * math.atan2(sine, glm.dot(glm.normalize(before), glm.normalize(after)))
