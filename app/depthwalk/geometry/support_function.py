"""How far objects reach from their axes, seen from above: support functions h(u) = max u·p, in some directions.

Between two of them the bound is that of any convex shape: u = a·u₁ + b·u₂ with a, b ≥ 0 has h(u) ≤ a·h(u₁) + b·h(u₂).
"""

import numpy as np

from depthwalk.types import Array

DIRECTIONS = 32  # a circle is overestimated by 1 / cos(π / 32), half a percent
_STEP = 2 * np.pi / DIRECTIONS
_WAYS = np.stack([np.cos(_STEP * np.arange(DIRECTIONS)), np.sin(_STEP * np.arange(DIRECTIONS))], -1)  # x and z


def footprint(points: Array) -> Array:
    """Of an object with samples `points` (n, 3) and of its axis, in `DIRECTIONS` directions; metres."""
    across = points[:, [0, 2]].astype(np.float64)
    return np.array([(across @ way).max(initial=0.0) for way in _WAYS])


def box_footprint(half_width: Array, half_depth: Array) -> Array:
    """Of n boxes about their axes, (n, DIRECTIONS)."""
    half = np.stack([half_width, half_depth], -1)
    return half @ np.abs(_WAYS).T


def support(footprints: Array, direction: Array) -> Array:
    """How far (n,) at most objects of `footprints` (n, DIRECTIONS) reach along unit directions (n, 2), x and z."""
    turn = np.arctan2(direction[:, 1], direction[:, 0]) / _STEP
    before = np.floor(turn)
    rows, first, part = np.arange(len(turn)), before.astype(np.intp), turn - before
    one, other = footprints[rows, first % DIRECTIONS], footprints[rows, (first + 1) % DIRECTIONS]
    return np.asarray((np.sin((1 - part) * _STEP) * one + np.sin(part * _STEP) * other) / np.sin(_STEP))
