"""Place a camera so that it sees all of some objects."""

import math

from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.render.view.bounds import Bounds
from depthwalk.scene.arrays import Camera

IN_FRONT = glm.dvec3(0, 0.25, 1)  # world, from the objects to a camera that sees them all, a little from above


def camera_on(bounds: Bounds, aspect: float, fov: float, away: glm.dvec3) -> Camera:
    """Return a camera that looks at the middle of some objects and sees all of them.

    Parameters
    ----------
    bounds : the bounding spheres of the objects, world.
    aspect : width of the picture over its height.
    fov : vertical angle of view, radians.
    away : direction from the objects to the camera, world, of any length.

    Returns
    -------
    The camera, world; one near the origin where there are no objects.
    """
    if not len(bounds.bounding_radius):
        return Camera((0.0, 1.6, 5.0), (0.0, 1.0, 0.0), fov)
    middle, radius = bounds.sphere()
    narrower = min(fov, 2 * math.atan(math.tan(fov / 2) * aspect))
    target = glm.dvec3(middle)
    place = target + glm.normalize(away) * (radius / math.sin(narrower / 2))
    return Camera(components(place), components(target), fov)
