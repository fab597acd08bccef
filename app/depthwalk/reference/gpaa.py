"""Twin of shaders/gpaa/edge.frag: what part of a pixel lies beyond an edge."""

import numpy as np

from depthwalk.types import Array


def part_beyond(ends: Array, middle: Array) -> Array:
    """The part (n,), 0 to ½, of unit squares about `middle` (n, 2) on the other side of lines through `ends` (n, 4),
    x and y of both, of those that do not hold the middle; pixels.

    Exact where the line crosses the whole square, or passes it by; the distance along the minor axis (edge-optimised
    GPAA, §1.3) is so for slope 0 alone. What is shorter than a pixel is taken to be parallel to the major axis.
    """
    along = ends[:, 2:] - ends[:, :2]
    steep = np.abs(along[:, 1]) > np.abs(along[:, 0])
    major = np.where(steep[:, None], along[:, ::-1], along)
    start = np.where(steep[:, None], ends[:, 1::-1], ends[:, :2])
    at = np.where(steep[:, None], middle[:, ::-1], middle)
    slope = major[:, 1] / major[:, 0]
    away = np.abs(start[:, 1] + slope * (at[:, 0] - start[:, 0]) - at[:, 1])
    spread = np.where(np.abs(major[:, 0]) < 1, 0, np.abs(slope))
    left = np.maximum(0.5 + 0.5 * spread - away, 0)
    return np.where(away <= 0.5 - 0.5 * spread, 0.5 - away, left**2 / np.maximum(2 * spread, 1e-6))
