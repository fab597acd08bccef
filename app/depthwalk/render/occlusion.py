"""Which objects are hidden behind what is drawn already.

A frame is drawn in rounds, from the nearest objects to the farthest. After each, the objects that remain are compared
with the depth buffer, and those that cannot show are left out. The depth is that of this frame, holes and all: nothing
is guessed from the frame before, nothing is assumed about what an object covers, and so the picture is the one that
drawing all objects gives. Greene, Kass and Miller 1993 test a hierarchy of depths; here any rectangle is covered by
windows of a size that suits it, wherever it lies, for the far objects of a crowd are a few cells large.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.view import View
from depthwalk.scene.arrays import Objects

Array = NDArray[np.floating]
Rows = NDArray[np.integer]

FIRST_ROUND = 64  # objects
FIRST_PORTION = 8192  # objects looked at one by one; of the others, whole cells may be hidden
_GROWTH = 2, 8  # how many times as many the next round draws: where many of the rest are hidden, and where few are
_MANY = 0.25  # of the rest
_ACROSS = 4  # windows that cover a rectangle, along each axis
_ROUNDING = 2.0**-21  # of depths on the GPU: eight steps of a 24-bit buffer


@dataclass(frozen=True)
class Cylinders:
    """What holds n objects. centre: (n, 3), world; axis: (n, 3), unit, world; half_height, radius: (n,) metres."""

    centre: Array
    axis: Array
    half_height: Array
    radius: Array


@dataclass(frozen=True)
class Outlines:
    """What n cylinders may cover. low, high: (n, 2) pixels; depth: (n,) of their nearest points in the depth buffer, 0
    where they reach the near plane."""

    low: Array
    high: Array
    depth: Array


Hider = Callable[[Cylinders], NDArray[np.bool_]]  # which of n cylinders (n,) are hidden


def growth(unseen: NDArray[np.bool_]) -> int:
    """How many times as many objects as the last the next round draws, where `unseen` (n,) of the rest were hidden: a
    test costs as much as drawing some objects, and must be worth it."""
    return _GROWTH[0 if not len(unseen) or unseen.mean() > _MANY else 1]


def cylinders(objects: Objects, centre: Array, half_height: Array, radius: Array) -> Cylinders:
    """Of n objects whose bounds' centres are `centre` (n, 3), world; half_height, radius: (a,) of assets, metres."""
    x, y, z, w = objects.rotation.T
    axis = np.stack([2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)], -1)  # +Y turned
    asset, scale = objects.asset, objects.scale
    return Cylinders(centre, axis, half_height[asset] * scale, radius[asset] * scale)


def box_cylinders(low: Array, high: Array) -> Cylinders:
    """Upright, about n boxes from `low` to `high` (n, 3), world."""
    half = (high - low) / 2
    upright = np.broadcast_to(np.array([0, 1, 0], np.float32), half.shape)
    return Cylinders(low + half, upright, half[:, 1], np.hypot(half[:, 0], half[:, 2]))


def outlines(view: View, cylinders: Cylinders, margin: float) -> Outlines:
    """Bounds of n cylinders on the screen, wider by `margin` pixels.

    In camera coordinates, with t = x/z at its centre, a cylinder spans x − t·z = ±e, the support of g = (1, 0, −t):
    e = half_height·|g·axis| + radius·√(g² − (g·axis)²). So all of it is within e / (its least z) of t.
    """
    c = cylinders
    x, y, z = ((c.centre - view.position) @ view.axes.T).astype(np.float32).T
    axis = (c.axis @ view.axes.T).astype(np.float32).T
    nearest = z - _support(c, np.float32(1), axis[2])
    nearest -= nearest * np.float32(margin / view.focal_pixels)
    near, far = view.depth_range
    before = nearest <= near  # no outline
    nearest[before] = np.inf
    low, high = [], []
    for sideways, along, tangent, size in zip((x, y), axis[:2], view.half_extent, view.size, strict=True):
        t = sideways / np.where(before, np.inf, z)
        e = _support(c, 1 + t * t, along - t * axis[2]) / nearest
        middle, half = (t / tangent + 1) * (size / 2), e * (size / 2 / tangent) + margin
        low.append(middle - half)
        high.append(middle + half)
    depth = far / (far - near) * (1 - near / nearest.astype(np.float64))
    return Outlines(np.stack(low, -1), np.stack(high, -1), np.where(before, 0, depth))


def _support(cylinders: Cylinders, squared: Array | np.floating, along: Array) -> Array:
    """How far cylinders reach along vectors g: `squared` is g², `along` g·axis."""
    across = np.sqrt(np.maximum(squared - along * along, 0))
    return np.asarray(cylinders.half_height * np.abs(along) + cylinders.radius * across)


def hidden(found: Outlines, farthest: NDArray[np.float32], side: int) -> NDArray[np.bool_]:
    """Whether (n,) what outlines cover lies behind the depth buffer.

    farthest: (rows, columns), its maximum in cells of `side` × `side` pixels.
    """
    last = np.array(farthest.shape[::-1]) - 1
    low, high = (np.clip(bound / side, 0, last).astype(np.int32) for bound in (found.low, found.high))
    longest = (high - low).max(1) + 1
    level = np.ceil(np.log2(np.maximum(longest / _ACROSS, 1))).astype(np.int32)
    window = _windows(farthest, int(level.max(initial=0)))
    behind = np.zeros(len(low), np.float32)
    # Windows side by side, the last ones moved back to where the rectangle ends.
    start = [
        np.minimum(low + (k << level)[:, None], np.maximum(high + 1 - (1 << level)[:, None], low))
        for k in range(_ACROSS)
    ]
    first = level * farthest.size
    for row in start:
        along = first + row[:, 1] * farthest.shape[1]
        for column in start:
            np.maximum(behind, window.take(along + column[:, 0]), out=behind)
    return np.asarray(found.depth > behind + _ROUNDING)


def _windows(farthest: NDArray[np.float32], levels: int) -> NDArray[np.float32]:
    """The maximum (levels + 1, rows, columns) of the 1, 2 × 2, 4 × 4 … cells from each one on, as far as they go."""
    windows = np.empty((levels + 1, *farthest.shape), np.float32)
    windows[0] = farthest
    wider = np.empty_like(farthest)
    for level in range(levels):
        one, two, reach = windows[level], windows[level + 1], 1 << level
        np.maximum(one[:, :-reach], one[:, reach:], out=wider[:, :-reach])
        wider[:, -reach:] = one[:, -reach:]
        np.maximum(wider[:-reach], wider[reach:], out=two[:-reach])
        two[-reach:] = wider[-reach:]
    return windows
