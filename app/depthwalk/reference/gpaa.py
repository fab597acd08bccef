"""Compute the areas of geometric post-process anti-aliasing, as the twin of shaders/gpaa/edge.frag.

A pixel that an edge of the geometry divides is blended with its neighbour across that edge by the area that lies on the
neighbour's side (Persson 2011, "Geometric Post-process Anti-Aliasing"; edge-optimised GPAA, §1.3, takes the distance
along the minor axis in place of the area, which is exact for edges of slope 0 alone).
"""

import numpy as np

from depthwalk.types import Array


def part_beyond(ends: Array, middle: Array) -> Array:
    """Return the part of each pixel that lies beyond a line, seen from the pixel's centre.

    The area is exact for the infinite line through the two ends. Only lines shorter than a pixel are assumed to cross
    the pixel parallel to their major axis, since their slope is not known precisely enough.

    Parameters
    ----------
    ends
        (n, 4) x and y of the line's first end, then of its second, pixels.
    middle
        (n, 2) x and y of the pixels' centres, pixels; a pixel is a square of edge 1 about its centre.

    Returns
    -------
    Array
        (n,) parts, 0 to ½; 0 where the line misses the pixel.
    """
    along = ends[:, 2:] - ends[:, :2]
    steep = np.abs(along[:, 1]) > np.abs(along[:, 0])
    major = np.where(steep[:, None], along[:, ::-1], along)
    start = np.where(steep[:, None], ends[:, 1::-1], ends[:, :2])
    at = np.where(steep[:, None], middle[:, ::-1], middle)
    slope = major[:, 1] / major[:, 0]
    away = np.abs(start[:, 1] + slope * (at[:, 0] - start[:, 0]) - at[:, 1])
    spread = np.where(np.abs(major[:, 0]) < 1, 0, np.abs(slope))
    overlap = np.maximum(0.5 + 0.5 * spread - away, 0)
    corner = overlap**2 / np.maximum(2 * spread, 1e-6)  # the triangle cut off by a line past the centre
    return np.asarray(np.where(away <= 0.5 - 0.5 * spread, 0.5 - away, corner))
