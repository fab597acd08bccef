"""Draw the bars of a height field into a picture, pixel by pixel.

Twin of shaders/bar_texture: the strip that a bar takes on the screen, and the distance of its pixels (Li, Wang and Wu
2004, *Bar texture mapping*).
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array

END_ON = 0.01
"""Pixels between the ends of a bar below which it has no direction on the screen."""


def bar_distances(near: Array, far: Array, right: Array, up: Array, size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the distance of the bar that is nearest at the centre of each pixel.

    Parameters
    ----------
    near, far
        (n, 4) clip coordinates of both ends of n bars, in front of the viewer.
    right, up
        (n, 4) clip coordinates of the points half a texel beside the near end.
    size
        Width and height of the picture, pixels.

    Returns
    -------
    NDArray[np.float64]
        (H, W) distances along the view axis, as clip coordinates give them, row 0 below; +inf where there is no bar.
    """
    width, height = size
    centres = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), -1).reshape(-1, 2)
    nearest = np.full(len(centres), np.inf)
    for ends in zip(near, far, right, up, strict=True):
        distance = _strip(*ends, centres - np.array(size) / 2, np.array(size))
        np.minimum(nearest, distance, out=nearest)
    return nearest.reshape(height, width)


def _strip(near: Array, far: Array, right: Array, up: Array, centres: Array, size: Array) -> Array:
    """Return the distance (m,) of one bar at pixels `centres` (m, 2) from the middle; +inf beside its strip."""
    begin, end, beside, above = (point[:2] / point[3] * size / 2 for point in (near, far, right, up))
    extent = float(np.hypot(*(end - begin)))
    along = np.array([1.0, 0.0]) if extent < END_ON else (end - begin) / extent
    axes = np.stack([along, [-along[1], along[0]]], -1)
    u, v = (beside - begin) @ axes, (above - begin) @ axes
    reach = np.abs(u) + np.abs(v)
    # 1 / distance is linear on the screen: along the bar, and on the texel's rectangle, in which it begins.
    inverse = 1 / np.array([near[3], far[3]])
    slope = np.linalg.solve(np.stack([u, v]), 1 / np.array([right[3], up[3]]) - inverse[0])
    place = (centres - begin) @ axes
    clamped = np.clip(place[:, 0], 0, extent)
    found = inverse[0] + (inverse[1] - inverse[0]) * (clamped / extent if extent else 0.0)
    found = found + place @ slope - clamped * slope[0]
    inside = (place[:, 0] >= -reach[0]) & (place[:, 0] <= extent + reach[0]) & (np.abs(place[:, 1]) <= reach[1])
    return np.where(inside, 1 / found, np.inf)
