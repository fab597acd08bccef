"""Measure how the animated objects of a scene move at a moment."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from depthwalk.geometry.quaternions import conjugate, multiply
from depthwalk.render.view.bounds import Cylinders
from depthwalk.render.world.object_rows import rows_of
from depthwalk.scene.animation import show_moment
from depthwalk.scene.scene import Scene
from depthwalk.types import Array, Ints, Rows

_STEP = 1 / 120  # seconds between the two moments that are compared


@dataclass(frozen=True, kw_only=True)
class MovingObjects:
    """Hold how n moving objects move, each as a rigid body that may also grow.

    Attributes
    ----------
    cylinders : that enclose them, world.
    pivot : (n, 3) metres, world: a point of each object.
    velocity : (n, 3) metres per second, world: of that point.
    turn : (n, 3) radians per second, world: the axis about which the object turns, times how fast.
    growth : (n,) by how many times its size it grows in a second.
    """

    cylinders: Cylinders
    pivot: Array
    velocity: Array
    turn: Array
    growth: Array


def moving_objects(
    scene: Scene, moment: float, owners: Ints, in_sight: Callable[[Rows], Rows], cylinders: Callable[[Rows], Cylinders]
) -> MovingObjects:
    """Return how the animated objects that are in sight move.

    Parameters
    ----------
    scene : the scene, as it is at the moment; it is so again afterwards.
    moment : seconds since the animations began.
    owners : (r,) the object that each row of `RenderWorld.objects` shows.
    in_sight : returns those of some rows that are in sight.
    cylinders : returns the cylinders of rows.

    Returns
    -------
    The rows of these objects that are in sight.
    """
    numbers = show_moment(scene, moment + _STEP)
    later = scene.objects.take(numbers)
    show_moment(scene, moment)
    now = scene.objects.take(numbers)
    rows = in_sight(rows_of(numbers, owners))
    k = np.searchsorted(numbers, owners[rows])
    turned = multiply(later.rotation[k], conjugate(now.rotation[k])).astype(float)
    turned *= np.where(turned[:, 3:] < 0, -1, 1)  # the shorter way
    return MovingObjects(
        cylinders=cylinders(rows),
        pivot=now.position[k].astype(float),
        velocity=(later.position[k].astype(float) - now.position[k]) / _STEP,
        turn=2 * turned[:, :3] / _STEP,  # of a small angle
        growth=(later.scale[k] / now.scale[k].astype(float) - 1) / _STEP,
    )
