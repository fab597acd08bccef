"""Measure how far objects extend from their axes, seen from above: sample their support functions h(u) = max u·p.

The impostor of an object should be as wide as the object appears from the viewer's position, and a circle about the
axis overestimates a wall by far. Between two sampled directions the bound is that of any convex shape: u = a·u₁ + b·u₂
with a, b ≥ 0 has h(u) ≤ a·h(u₁) + b·h(u₂).
"""

import numpy as np

from depthwalk.types import Array

DIRECTIONS = 32  # overestimates a circle by 1 / cos(π / 32), half a percent
_STEP = 2 * np.pi / DIRECTIONS
_SAMPLED = np.stack([np.cos(_STEP * np.arange(DIRECTIONS)), np.sin(_STEP * np.arange(DIRECTIONS))], -1)  # x and z


def support_values(points: Array) -> Array:
    """Return the support function of a set of points and the axis, seen from above.

    Parameters
    ----------
    points
        (n, 3) float, metres, object frame.

    Returns
    -------
    numpy.ndarray
        (DIRECTIONS,) float64, metres from the axis, at least 0: how far they extend in each sampled direction.
    """
    across = points[:, [0, 2]].astype(np.float64)
    return np.array([(across @ direction).max(initial=0.0) for direction in _SAMPLED])


def box_support_values(half_width: Array, half_depth: Array) -> Array:
    """Return the support functions of boxes that are centred on the y axes of their frames.

    Parameters
    ----------
    half_width, half_depth
        (n,) half the extents of the boxes along x and z, metres, object frames.

    Returns
    -------
    Array
        (n, DIRECTIONS) how far each box extends from its axis in each sampled direction, metres.
    """
    half = np.stack([half_width, half_depth], -1)
    return np.asarray(half @ np.abs(_SAMPLED).T)


def support(footprints: Array, direction: Array) -> Array:
    """Return an upper bound on how far objects extend along a direction.

    Parameters
    ----------
    footprints
        (n, DIRECTIONS) support functions of the objects, metres.
    direction
        (n, 2) unit vectors, x and z of the object frame.

    Returns
    -------
    Array
        (n,) metres.
    """
    turn = np.arctan2(direction[:, 1], direction[:, 0]) / _STEP
    before = np.floor(turn)
    rows, first, part = np.arange(len(turn)), before.astype(np.intp), turn - before
    one, other = footprints[rows, first % DIRECTIONS], footprints[rows, (first + 1) % DIRECTIONS]
    return np.asarray((np.sin((1 - part) * _STEP) * one + np.sin(part * _STEP) * other) / np.sin(_STEP))
