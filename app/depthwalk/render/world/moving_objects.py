"""Measure how the animated objects of a scene move at a moment."""

from dataclasses import dataclass

import numpy as np

from depthwalk.geometry.quaternions import conjugate, multiply
from depthwalk.render.view.bounds import Cylinders
from depthwalk.scene.scene import Scene, show_moment
from depthwalk.types import Array, Rows

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


def moving_objects(scene: Scene, moment: float, objects: Rows, cylinders: Cylinders) -> MovingObjects:
    """Return how animated objects move.

    Parameters
    ----------
    scene : the scene, as it is at the moment; it is so again afterwards.
    moment : seconds since the animations began.
    objects : (n,) rows of `scene.objects`.
    cylinders : that enclose them, or a part of each.

    Returns
    -------
    The n movements.
    """
    show_moment(scene, moment + _STEP)
    later = scene.objects.take(objects)
    show_moment(scene, moment)
    now = scene.objects.take(objects)
    turned = multiply(later.rotation, conjugate(now.rotation)).astype(float)
    turned *= np.where(turned[:, 3:] < 0, -1, 1)  # the shorter way
    return MovingObjects(
        cylinders=cylinders,
        pivot=now.position.astype(float),
        velocity=(later.position.astype(float) - now.position) / _STEP,
        turn=2 * turned[:, :3] / _STEP,  # of a small angle
        growth=(later.scale / now.scale.astype(float) - 1) / _STEP,
    )
