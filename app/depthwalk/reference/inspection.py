"""Compute the colours that show normals, distances and objects: the twin of shaders/inspection/inspection.glsl."""

import numpy as np

from depthwalk.types import Array

SIDEWAYS = 0.4  # part of its colour that a surface seen edge-on has


def normal_colour(normal: Array) -> Array:
    """Return the sRGB colours, 0 to 1, of unit normals (..., 3) in world axes: −1 is 0 and 1 is 1, x is red."""
    return np.asarray(0.5 + 0.5 * normal)


def distance_grey(distance: Array, half_distance: float) -> Array:
    """Return the sRGB grey, 0 to 1, of distances: 1 at the viewer, half as much after each `half_distance`.

    Parameters
    ----------
    distance
        Distances along the view axis, metres, any shape.
    half_distance
        Metres over which the grey falls by half.

    Returns
    -------
    Array
        The greys, of the shape of `distance`; 0 where that is infinite.
    """
    return np.asarray(np.exp2(-distance / half_distance))


def shaded(colour: Array, normal: Array, ray: Array) -> Array:
    """Return false colours, darker where a surface is seen from aside, so that its shape shows.

    Parameters
    ----------
    colour
        (..., 3) sRGB, 0 to 1.
    normal
        (..., 3) unit normals, world.
    ray
        (..., 3) from the viewer to the surface, of any length, world.

    Returns
    -------
    Array
        (..., 3) sRGB, 0 to 1.
    """
    facing = np.abs((normal * ray).sum(-1, keepdims=True)) / np.linalg.norm(ray, axis=-1, keepdims=True)
    return np.asarray((SIDEWAYS + (1 - SIDEWAYS) * facing) * colour)
