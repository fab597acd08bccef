"""Let a viewer walk among the surfaces of a scene, from frame to frame."""

import math
from collections.abc import Mapping

import numpy as np
from pyglm import glm

from depthwalk.scene.arrays import Camera
from depthwalk.walk.collision.body import Body
from depthwalk.walk.collision.footing import stand
from depthwalk.walk.collision.placed_collider import Placed
from depthwalk.walk.collision.sliding import slide
from depthwalk.walk.collision.surroundings import Surroundings, reach_of
from depthwalk.walk.controls import EYE_HEIGHTS, Move, Walker

_STRIDE = 0.1  # metres: longest motion between two looks at the ground
_MOST_STRIDES = 64  # in a frame; faster viewers make longer ones
_RISE = 10.0  # 1/s: rate at which the height of the feet follows that of the ground
_LEVEL = 1e-4  # metres: within this distance, it has reached it
_REST = 0.25  # seconds between looks at what has changed around a viewer who stands
_STILL = 1e-9  # metres


class Obstacles:
    """Stop a walking viewer at surfaces, and carry the viewer up and down steps.

    Parameters
    ----------
    placed
        Knows the objects near the viewer.
    ground
        Height of the endless ground, metres, world y; None where the scene has none.
    """

    def __init__(self, placed: Placed, ground: float | None) -> None:
        self._around = Surroundings(placed)
        self._ground = ground
        self._left: glm.dvec3 | None = None  # where the last frame left the eyes
        self._is_placed = False  # whether the viewer has not moved since being placed at eye height
        self._feet = 0.0  # metres, world y
        self._eased = 0.0  # the same, following smoothly
        self._rested = math.inf  # seconds since the surroundings were last looked at

    def walk(self, walker: Walker, held: Mapping[Move, float], dt: float, *, fast: bool = False) -> None:
        """Move a walking viewer for the duration of one frame; parameters as in `Walker.advance`."""
        if walker.position != self._left:
            self._begin(walker)
        self._rested += dt
        self._ease(dt)
        before = _in_plan(walker)
        walker.advance(held, dt, fast=fast, ground=self._eased)
        wanted = _in_plan(walker) - before
        if abs(wanted) > _STILL:
            self._move(walker, before, wanted)
        elif self._rested > _REST:
            self._look(walker, before, _STRIDE)
        self._left = glm.dvec3(walker.position)

    def reachable(self, walker: Walker, camera: Camera) -> Camera:
        """Return how far a walking viewer gets on the way to a camera, by the surfaces that are known around.

        Parameters
        ----------
        walker
            The viewer.
        camera
            Where the viewer would be soon if nothing were in the way.

        Returns
        -------
        Camera
            The camera, moved back where something is.
        """
        here, body = _in_plan(walker), Body(eye_height=walker.eye_height)
        wanted = complex(camera.position[0], camera.position[2]) - here
        if walker.position != self._left or abs(wanted) < _STILL:
            return camera
        short = slide(self._around.outlines(self._feet, body), here, wanted, body.radius) - wanted
        return camera.moved(glm.dvec3(short.real, 0, short.imag)) if short else camera

    def _begin(self, walker: Walker) -> None:
        """Begin to walk where the viewer was placed."""
        self._around.forget()
        base = 0.0 if self._ground is None else self._ground
        self._feet = self._eased = walker.position.y - walker.eye_height
        self._is_placed = abs(self._feet - base) < _LEVEL
        self._rested = math.inf

    def _look(self, walker: Walker, here: complex, motion: float) -> None:
        """Gather the surfaces around a viewer at `here`, world x + i z, for a motion of `motion`, metres.

        Where the viewer stands on one that has just become known, a viewer who was placed at some height keeps it.
        """
        body = Body(eye_height=walker.eye_height)
        self._rested = 0.0
        if not self._around.update(np.array([here.real, self._feet, here.imag]), reach_of(body, motion), body):
            return
        self._stand(here, body)
        height = walker.position.y - self._feet
        if self._is_placed and EYE_HEIGHTS[0] <= height <= EYE_HEIGHTS[1]:
            walker.eye_height, self._eased = height, self._feet

    def _ease(self, dt: float) -> None:
        """Let the eased height of the feet follow for `dt` seconds."""
        above = (self._eased - self._feet) * math.exp(-_RISE * max(dt, 0.0))
        self._eased = self._feet + (above if abs(above) > _LEVEL else 0.0)

    def _move(self, walker: Walker, before: complex, wanted: complex) -> None:
        """Move a viewer from `before` by as much of the `wanted` motion as is possible, stride by stride; x + i z."""
        strides = min(math.ceil(abs(wanted) / _STRIDE), _MOST_STRIDES)
        stride, here = wanted / strides, before
        for _ in range(strides):
            self._look(walker, here, abs(stride))
            body = Body(eye_height=walker.eye_height)
            motion = slide(self._around.outlines(self._feet, body), here, stride, body.radius)
            if abs(motion) < _STILL:
                break
            self._is_placed = False
            here += motion
            self._stand(here, body)
        lost = before + wanted - here
        _brake(walker, glm.dvec3(lost.real, 0, lost.imag))
        walker.position = glm.dvec3(here.real, walker.position.y, here.imag)

    def _stand(self, here: complex, body: Body) -> None:
        """Set the height of the feet of a viewer at `here`, metres, world x + i z."""
        height = stand(self._around.footing.heights(here), self._feet, body.step, body.top)
        if height is None and self._around.is_waiting:
            return  # nobody falls through a floor that is not known yet
        if height is None:
            height = min(self._feet, 0.0) if self._ground is None else self._ground
        self._feet = height if self._ground is None else max(height, self._ground)


def _in_plan(walker: Walker) -> complex:
    """Return where a viewer is, seen from above: x + i z, metres, world."""
    return complex(walker.position.x, walker.position.z)


def _brake(walker: Walker, lost: glm.dvec3) -> None:
    """Take from a viewer's velocity the part along `lost`, the motion, metres, that surfaces have stopped."""
    if glm.length(lost) > _STILL:
        stopped = glm.normalize(lost)
        walker.velocity = walker.velocity - stopped * max(glm.dot(walker.velocity, stopped), 0.0)
