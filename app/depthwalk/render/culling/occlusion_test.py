"""Test which objects are hidden behind what is drawn already.

After each phase of a frame (`render.occlusion_phases`) the remaining objects are compared with the depth buffer of this
frame, holes and all. Nothing is guessed from the last frame, and nothing assumed about what an object covers, so the
picture is the same as if all objects were drawn. Greene, Kass and Miller 1993 test a hierarchy of depths (HZB). Here a
sparse table holds the maximum of windows at every position, not only at multiples of their size, so that few windows
cover any rectangle tightly: the far objects of a crowd are only a few cells large. The windows of NumPy are squares,
which together may reach beyond a rectangle; the compiled loop tests exactly the cells of the rectangle, and so finds a
few more objects hidden. Neither hides anything that is visible.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.render import kernels
from depthwalk.render.view.bounds import Cylinders
from depthwalk.render.view.view import View
from depthwalk.types import Array, Mask, Rows

FIRST_PHASE = 64  # objects
FIRST_BATCH = 8192  # objects tested singly; the others are tested by whole cells first
GROWTH = 8  # factor from phase to phase: a test costs as much as drawing some objects
_ACROSS = 4  # windows that cover a rectangle, along each axis
_ROUNDING = 2.0**-21  # of depths on the GPU: eight steps of a 24-bit buffer


@dataclass(frozen=True)
class ScreenExtents:
    """Hold the rectangles on the screen, and the nearest depths, that n cylinders may cover.

    Attributes
    ----------
    low : (n, 2) lower left corners, pixels.
    high : (n, 2) upper right corners, pixels.
    depth : (n,) nearest points of the cylinders, as values of the depth buffer; 0 where one reaches the near plane.
    """

    low: Array
    high: Array
    depth: Array


IsHidden = Callable[[Cylinders], Mask]
"""Returns which (n,) of n cylinders are hidden."""


def screen_extents(view: View, cylinders: Cylinders, margin: float) -> ScreenExtents:
    """Return bounds of n cylinders on the screen.

    In camera coordinates, with t = x/z at its centre, a cylinder lies between the planes x − t·z = ±e. Here e is its
    support along the normal g = (1, 0, −t) of these planes: half_height·|g·axis| + radius·√(g² − (g·axis)²). So no
    point of the cylinder is farther from t than e divided by the least z of the cylinder. The same holds for y.

    Parameters
    ----------
    view : the view of the picture, near and far plane fitted.
    cylinders : the n cylinders, world.
    margin : pixels by which the rectangles are widened on every side; the nearest depths come nearer by the length that
        they cover there.

    Returns
    -------
    The rectangles and nearest depths.
    """
    c = cylinders
    x, y, z = ((c.centre - view.position) @ view.axes.T).astype(np.float32).T
    axis = (c.axis @ view.axes.T).astype(np.float32).T
    nearest = z - _support(c, np.float32(1), axis[2])
    nearest -= nearest * np.float32(margin / view.focal_pixels)
    near, far = view.depth_range
    clipped = nearest <= near  # by the near plane: its extent has no bounds
    nearest[clipped] = np.inf
    low, high = [], []
    extents = zip(view.half_extent, view.shear, view.size, strict=True)
    for sideways, along, (tangent, shear, size) in zip((x, y), axis[:2], extents, strict=True):
        t = sideways / np.where(clipped, np.inf, z)
        e = _support(c, 1 + (t - np.float32(shear)) ** 2, along - t * axis[2]) / nearest
        middle, half = (t / tangent + 1) * (size / 2), e * (size / 2 / tangent) + margin
        low.append(middle - half)
        high.append(middle + half)
    depth = far / (far - near) * (1 - near / nearest.astype(np.float64))
    return ScreenExtents(np.stack(low, -1), np.stack(high, -1), np.where(clipped, 0, depth))


def _support(cylinders: Cylinders, squared: Array | np.floating, along: Array) -> Array:
    """Return how far (n,) cylinders reach along vectors g. squared: g²; along: g·axis (n,)."""
    across = np.sqrt(np.maximum(squared - along * along, 0))
    return np.asarray(cylinders.half_height * np.abs(along) + cylinders.radius * across)


def depth_test(farthest: NDArray[np.float32], side: int, view: View, margin: float) -> IsHidden:
    """Return a test of which cylinders are hidden behind the depth buffer.

    Parameters
    ----------
    farthest : (rows, columns) float32, greatest value of the depth buffer in each cell, row 0 at the bottom.
    side : width and height of a cell, pixels.
    view : the view of the picture, near and far plane fitted.
    margin : pixels by which the rectangles of the cylinders are widened on every side.

    Returns
    -------
    The test.
    """
    loops = kernels.loaded()
    if loops is None:
        depth = DepthRangeMaximum(farthest, side)
        return lambda enclosing: depth.hides(screen_extents(view, enclosing, margin))
    half_extent, shear, size = (np.array(pair, float) for pair in (view.half_extent, view.shear, view.size))
    near, far = view.depth_range

    def hides(enclosing: Cylinders) -> Mask:
        is_hidden = loops.hidden(
            centre=np.asarray(enclosing.centre, np.float32),
            axis=np.asarray(enclosing.axis, np.float32),
            half_height=np.asarray(enclosing.half_height, np.float32),
            radius=np.asarray(enclosing.radius, np.float32),
            farthest=farthest,
            position=view.position,
            axes=view.axes,
            tangent=half_extent,
            shear=shear,
            size=size,
            near=near,
            far=far,
            side=float(side),
            margin=margin,
            rounding=_ROUNDING,
        )
        return np.asarray(is_hidden)

    return hides


class DepthRangeMaximum:
    """Find the farthest depth within any rectangle, by a sparse table of range maxima.

    The table holds the maximum over windows of 1, 2 × 2, 4 × 4 … cells that start at each cell. Windows of a size are
    computed when they are first needed.

    Parameters
    ----------
    farthest : (rows, columns) float32, greatest value of the depth buffer in each cell, row 0 at the bottom.
    side : width and height of a cell, pixels.
    """

    def __init__(self, farthest: NDArray[np.float32], side: int) -> None:
        self._side, self._known = side, 0
        levels = _window_level(np.array([max(farthest.shape)]))[0]
        self._windows = np.empty((levels + 1, *farthest.shape), np.float32)
        self._windows[0] = farthest

    def hides(self, extents: ScreenExtents) -> Mask:
        """Return which cylinders lie entirely behind the depth buffer.

        Parameters
        ----------
        extents : rectangles and nearest depths of n cylinders.

        Returns
        -------
        (n,) whether each is hidden.
        """
        rows, columns = self._windows.shape[1:]
        last = np.array([[columns - 1], [rows - 1]], np.float32)
        low, high = (np.clip(bound.T / self._side, 0, last).astype(np.intp) for bound in (extents.low, extents.high))
        level = _window_level((high - low).max(0) + 1)
        self._extend(int(level.max(initial=0)))
        # Windows side by side, the last ones moved back to where the rectangle ends.
        step = np.arange(_ACROSS)[:, None, None] << level
        column, row = np.minimum(low + step, np.maximum(high + 1 - (1 << level), low)).swapaxes(0, 1)
        corners = ((level * rows + row) * columns)[:, None] + column
        behind = self._windows.take(corners.reshape(_ACROSS**2, -1)).max(0)
        return np.asarray(extents.depth > behind + _ROUNDING)

    def _extend(self, level: int) -> None:
        """Compute the windows up to those of 2^level cells along each side, each from four of half its side."""
        for known in range(self._known, level):
            small, large, half = self._windows[known], self._windows[known + 1], 1 << known
            wide = np.empty_like(small)
            # All rows as one run, which is quicker; where that wraps into the next row, it is overwritten.
            np.maximum(small.ravel()[:-half], small.ravel()[half:], out=wide.ravel()[:-half])
            wide[:, -half:] = small[:, -half:]
            np.maximum(wide[:-half], wide[half:], out=large[:-half])
            large[-half:] = wide[-half:]
        self._known = max(self._known, level)


def _window_level(length: Rows) -> Rows:
    """Return the least levels (n,) at which `_ACROSS` windows cover `length` (n,) cells."""
    return np.ceil(np.log2(np.maximum(length / _ACROSS, 1))).astype(np.intp)
