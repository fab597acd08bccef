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

from depthwalk.render.view.bounds import Cylinders
from depthwalk.render.view.view import View
from depthwalk.types import Array, Rows

FIRST_ROUND = 64  # objects
FIRST_PORTION = 8192  # objects looked at one by one; of the others, whole cells may be hidden
_GROWTH = 2, 8  # how many times as many the next round draws: where many of the rest are hidden, and where few are
_MANY = 0.25  # of the rest
_ACROSS = 4  # windows that cover a rectangle, along each axis
_ROUNDING = 2.0**-21  # of depths on the GPU: eight steps of a 24-bit buffer


@dataclass(frozen=True)
class ScreenExtents:
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


def screen_extents(view: View, cylinders: Cylinders, margin: float) -> ScreenExtents:
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
    return ScreenExtents(np.stack(low, -1), np.stack(high, -1), np.where(before, 0, depth))


def _support(cylinders: Cylinders, squared: Array | np.floating, along: Array) -> Array:
    """How far cylinders reach along vectors g: `squared` is g², `along` g·axis."""
    across = np.sqrt(np.maximum(squared - along * along, 0))
    return np.asarray(cylinders.half_height * np.abs(along) + cylinders.radius * across)


class DepthRangeMaximum:
    """The maximum of the depth buffer in windows of 1, 2 × 2, 4 × 4 … cells, as far as anything asks for them."""

    def __init__(self, farthest: NDArray[np.float32], side: int) -> None:
        """farthest: (rows, columns), the buffer's maximum in cells of `side` × `side` pixels."""
        self._side, self._known = side, 0
        most = _levels(np.array([max(farthest.shape)]))[0]
        self._windows = np.empty((most + 1, *farthest.shape), np.float32)  # from each cell on, as far as they go
        self._windows[0] = farthest

    def hide(self, found: ScreenExtents) -> NDArray[np.bool_]:
        """Whether (n,) what outlines cover lies behind the depth buffer."""
        rows, columns = self._windows.shape[1:]
        last = np.array([[columns - 1], [rows - 1]], np.float32)
        low, high = (np.clip(bound.T / self._side, 0, last).astype(np.intp) for bound in (found.low, found.high))
        level = _levels((high - low).max(0) + 1)
        self._extend(int(level.max(initial=0)))
        # Windows side by side, the last ones moved back to where the rectangle ends.
        step = np.arange(_ACROSS)[:, None, None] << level
        column, row = np.minimum(low + step, np.maximum(high + 1 - (1 << level), low)).swapaxes(0, 1)
        corners = ((level * rows + row) * columns)[:, None] + column
        behind = self._windows.take(corners.reshape(_ACROSS**2, -1)).max(0)
        return np.asarray(found.depth > behind + _ROUNDING)

    def _extend(self, level: int) -> None:
        for known in range(self._known, level):
            one, two, bounding_radius = self._windows[known], self._windows[known + 1], 1 << known
            wider = np.empty_like(one)
            # As one run, which is quicker: what goes on in the next row is overwritten.
            np.maximum(
                one.ravel()[:-bounding_radius], one.ravel()[bounding_radius:], out=wider.ravel()[:-bounding_radius]
            )
            wider[:, -bounding_radius:] = one[:, -bounding_radius:]
            np.maximum(wider[:-bounding_radius], wider[bounding_radius:], out=two[:-bounding_radius])
            two[-bounding_radius:] = wider[-bounding_radius:]
        self._known = max(self._known, level)


def _levels(length: Rows) -> Rows:
    """The least levels (n,) of which `_ACROSS` windows cover so many (n,) cells."""
    return np.ceil(np.log2(np.maximum(length / _ACROSS, 1))).astype(np.intp)
