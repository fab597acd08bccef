"""Compute the colours that show normals and distances; this is the twin of shaders/inspection/inspection.glsl."""

import numpy as np

from depthwalk.types import Array


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
