"""Twin of shaders/smaa/line.glsl: what a line cuts off the pixels along an edge."""

import numpy as np

from depthwalk.types import Array


def areas_cut(before: Array, after: Array, heights: Array) -> Array:
    """Areas (n, 2), 0 to ½, that a line cuts off the pixels above and below an edge of pixels, which begins `before`
    (n,) pixels earlier and ends `after` (n,) later (Jimenez et al. 2012, §4.2, where they come from a table).

    heights: (n, 2), of the line at the ends: ½ where the edge goes on a row above, −½ below, 0 where it does not. The
    line crosses the edge in the middle.
    """
    reach = before + 1 + after
    wedges = np.stack([_wedge(before, reach), _wedge(after, reach)], -1)
    return np.stack([(wedges * np.maximum(way * heights, 0)).sum(-1) for way in (1, -1)], -1)


def _wedge(start: Array, reach: Array) -> Array:
    """The area (n,) from `start` to `start` + 1 below a line that falls from 1 at 0 to 0 at half of `reach`."""
    low, high = np.minimum(start, reach / 2), np.minimum(start + 1, reach / 2)
    return (high - high**2 / reach) - (low - low**2 / reach)
