"""Compute quadrics of colours: how much the colours of a surface change when two of its vertices become one.

Hoppe 1999, "New Quadric Metric for Simplifying Meshes with Appearance Attributes": across each triangle, a colour is a
linear function of position. Its quadric is the squared difference of a vertex's colour from these functions at the
vertex's position, for the triangles that the vertex represents. The colour that minimises it follows from the position
(his section 4). With that colour put in, what is left is again a quadric of the position alone, which is simply added
to the one of the planes.

All triangles are weighted by their areas, and once more by their areas, since a difference in colour counts as a
distance in proportion to a triangle's edges (`cook.cluster_error`).
"""

import numpy as np

from depthwalk.cook.kernels.collapse_costs import COLOUR
from depthwalk.types import Array, Ints, Mask

WIDTH = 13  # values of a tint
_PAIRS = np.triu_indices(4)


def colour_quadrics(point: Array, corners: Ints, colours: Array, single: Mask) -> tuple[Array, Array]:
    """Return the quadrics (p, 10) and tints (p, 13) of places.

    A tint holds weighted sums over triangles: a red, a green and a blue function of position, each of them a gradient
    and the value at the origin, and the weight.

    Parameters
    ----------
    point
        (p, 3) places, in a frame in which the size of the mesh is about 1.
    corners
        (t, 3) rows of `point`.
    colours
        (t, 3, 3) colours at the corners, 0 to 1.
    single
        (p,) which places have one vertex, and so one colour. All others get zeros: along seams, colours are not kept.
    """
    function, weight = _functions(point[corners], colours)
    values = np.concatenate([function.reshape(-1, 12), np.ones((len(function), 1))], 1) * weight[:, None]
    squares = np.einsum("tki,tkj->tij", function, function)[:, *_PAIRS] * weight[:, None]
    sums = np.zeros((len(point), 10 + WIDTH))
    for sum_, column in zip(sums.T, np.concatenate([squares, values], 1).T, strict=True):
        for corner in np.ascontiguousarray(corners.T):
            sum_ += np.bincount(corner, column, len(point))
    sums *= single[:, None]
    return sums[:, :10], sums[:, 10:]


def reduced(quadric: Array, tint: Array) -> Array:
    """Return quadrics in which the colours are those that suit the position best.

    quadric (10, n), tint (13, n): their columns are quadrics with colours, and tints.
    """
    scaled = tint[:12] / np.maximum(tint[12], 1e-300)
    left = quadric.copy()
    for row, one, other in zip(left, *_PAIRS, strict=True):
        for first in range(0, 12, 4):
            row -= scaled[first + one] * tint[first + other]
    return left


def best_colours(tint: Array, point: Array) -> Array:
    """Return the colours (n, 3), 0 to 1, that suit points (n, 3) best. tint: (13, n) whose columns are tints."""
    x, y, z = point.T
    weight = np.maximum(tint[12], 1e-300)
    value = [(tint[k] * x + tint[k + 1] * y + tint[k + 2] * z + tint[k + 3]) / weight for k in range(0, 12, 4)]
    return np.asarray(np.clip(np.stack(value, -1), 0, 1))


def _functions(corners: Array, colours: Array) -> tuple[Array, Array]:
    """Return gradients and values at the origin (t, 3, 4) of the colours of triangles (t, 3, 3), and weights (t,)."""
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ab, ac)
    squared = np.square(normal).sum(1)
    scale = 1 / np.maximum(squared, 1e-60)[:, None]
    # Gradients of the barycentric coordinates of the second and the third corner.
    along_b, along_c = np.cross(ac, normal) * scale, np.cross(normal, ab) * scale
    step = colours[:, 1:] - colours[:, :1]
    gradient = step[:, 0, :, None] * along_b[:, None] + step[:, 1, :, None] * along_c[:, None]
    value = colours[:, 0] - np.einsum("tki,ti->tk", gradient, corners[:, 0])
    weight = COLOUR**2 * squared / 4
    return np.concatenate([gradient, value[..., None]], -1), weight
