"""Enclose objects in convex polytopes of few corners, by which their extent in any view is found quickly.

The impostor of an object should be no larger than the object appears from the viewer's position. A polytope is seen
within the outline of its corners, in any perspective, and so is what it encloses.
"""

import math

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.extreme_points import farthest
from depthwalk.types import Array

CORNERS = 128  # the polytope of a ball is 4 % wider than the ball, with 64 it would be 7 %
_ADDED = 24  # corners a round
_EXACT = 1e-3  # part of the distance from the centre: nothing is gained by less
_ROUNDING = 1e-5  # of the largest extent: corners are rounded to that or finer, so that files are small


def bounding_hull(points: Array, margin: float = 0.0) -> NDArray[np.float64]:
    """Return the corners of a convex polytope that encloses points.

    Corners are points of the set, taken greedily where the convex hull of those before is exceeded most, as QuickHull
    does (Barber, Dobkin and Huhdanpaa 1996), and then moved away from the centre until nothing is outside.

    Parameters
    ----------
    points
        (n, 3) at least one, in any unit and frame.
    margin
        How far from the points the polytope must reach at least, in their unit.

    Returns
    -------
    numpy.ndarray
        (CORNERS, 3) float64; the last corner is repeated where fewer suffice.
    """
    points = np.asarray(points, np.float64)
    low, high = points.min(0), points.max(0)
    size = max((high - low).max(), margin, 1e-30)
    margin += _ROUNDING * size
    centre, half = (low + high) / 2, (high - low) / 2 + margin
    corners = box_corners(half[None])[0]
    if half.min() > 2 * _ROUNDING * size:  # then within a cube, so that thin sets are enclosed as tightly as others
        corners = half * _enclosing((points - centre) / half, margin / half, corners / half)
    digits = -math.floor(math.log10(_ROUNDING * size))
    return padded_hull(np.unique(np.round(centre + corners, digits), axis=0))


def padded_hull(corners: Array) -> NDArray[np.float64]:
    """Return corners (k, 3) as (CORNERS, 3), the last repeated.

    Raises ValueError if they are not 1 to CORNERS finite points.
    """
    if corners.ndim != 2 or corners.shape[1] != 3 or not 1 <= len(corners) <= CORNERS or not np.isfinite(corners).all():
        raise ValueError(f"a hull must have 1 to {CORNERS} corners")
    return np.concatenate([corners, np.repeat(corners[-1:], CORNERS - len(corners), 0)])


def box_corners(half: Array) -> NDArray[np.float64]:
    """Return the corners (n, 8, 3) of boxes about the origin. half: (n, 3) half their extents."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return np.asarray(half[:, None] * signs, np.float64)


def prism_corners(reach: Array, bottom: float, top: float) -> NDArray[np.float64]:
    """Return the corners of an upright prism, from its extents in directions spread evenly around the y axis.

    Parameters
    ----------
    reach
        (m,) how far it extends from the axis at the angles 2πk / m, from +x towards +z.
    bottom, top
        Heights of its ends.

    Returns
    -------
    numpy.ndarray
        (2 m, 3) float64.
    """
    step = 2 * np.pi / len(reach)
    angle, following = step * np.arange(len(reach)), np.roll(reach, -1)
    along = (following - reach * np.cos(step)) / np.sin(step)  # from where the line k touches to where k + 1 meets it
    x, z = reach * np.cos(angle) - along * np.sin(angle), reach * np.sin(angle) + along * np.cos(angle)
    return np.concatenate([np.stack([x, np.full_like(x, height), z], -1) for height in (bottom, top)])


def _enclosing(points: Array, margin: Array, box: Array) -> Array:
    """Return up to CORNERS corners of a polytope that encloses `points` and an ellipsoid of radii `margin` about each.

    box: the corners to return if the points have no volume.
    """
    from scipy.spatial import ConvexHull, QhullError  # here, since drawing already cooked objects does not need it

    directions = np.concatenate([np.eye(3), -np.eye(3), box_corners(np.ones((1, 3)))[0]])
    chosen = np.unique(farthest(points, directions)[0])
    while True:
        centre = points[chosen].mean(0)
        try:
            facets = ConvexHull(points[chosen] - centre).equations  # n · p + e ≤ 0 within
        except QhullError:
            return box
        found, distance = farthest(points, facets[:, :3])
        beyond = distance - facets[:, :3] @ centre + facets[:, 3]
        worst = np.argsort(beyond / facets[:, 3])  # the offsets e are negative
        worst = worst[beyond[worst] > -_EXACT * facets[worst, 3]]
        new = list(dict.fromkeys(found[worst].tolist()))[: min(_ADDED, CORNERS - len(chosen))]
        if not new:
            beyond += np.linalg.norm(facets[:, :3] * margin, axis=1)
            growth = (beyond / -facets[:, 3]).max(initial=0.0)
            return np.asarray(centre + (points[chosen] - centre) * (1 + growth))
        chosen = np.append(chosen, new)
