"""Compute the areas of subpixel morphological anti-aliasing, as the twin of shaders/smaa/line.glsl.

SMAA (Jimenez et al. 2012, "SMAA: Enhanced Subpixel Morphological Antialiasing", §4.2) interprets the jagged edge of
pixels as a line, and blends every pixel along the edge by the area that this line cuts off. It looks the areas up in a
precomputed table; the shader and this twin compute them in closed form.
"""

import numpy as np

from depthwalk.types import Array


def areas_cut(before: Array, after: Array, heights: Array) -> Array:
    """Return the areas that a line cuts off the pixels above and below at a position on an edge between pixel rows.

    The line crosses the edge at the edge's midpoint, so that each half of the line cuts off a wedge.

    Parameters
    ----------
    before
        (n,) number of pixels between the edge's beginning and the place.
    after
        (n,) number of pixels between the place and the edge's end.
    heights
        (n, 2) height of the line at the edge's beginning and end, pixels: ½ where the edge continues a row above, −½
        where it continues a row below, 0 where it ends.

    Returns
    -------
    Array
        (n, 2), 0 to ½, squared pixels: of the pixel above the edge, and of that below.
    """
    length = before + 1 + after
    wedges = np.stack([_wedge(before, length), _wedge(after, length)], -1)
    return np.stack([(wedges * np.maximum(side * heights, 0)).sum(-1) for side in (1, -1)], -1)


def _wedge(start: Array, length: Array) -> Array:
    """Return the area (n,) from `start` to `start` + 1 below a line that falls from 1 at 0 to 0 at half of `length`."""
    low, high = np.minimum(start, length / 2), np.minimum(start + 1, length / 2)
    return (high - high**2 / length) - (low - low**2 / length)
