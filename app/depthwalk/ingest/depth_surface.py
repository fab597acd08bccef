"""Estimate from a depth image alone how noisy it is, how its surface slopes, and where it is torn.

`values` (H, W) are a quantity that is linear over the image for a plane: depth where the rays are parallel, inverse
depth where they meet in a pinhole. They are NaN or infinite where there is no surface.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array

STEEP = 4.0  # texel widths: a step between neighbours up to this depth always counts as a slope (76°)
_NOISE_MARGIN = 6.0  # standard deviations that a step between neighbours may have by noise alone
_SLOPE_CHANGE = 0.5  # by how much, relative to itself, a slope may change from one step to the next
_SLOPE_LENGTH = 3  # steps that make a slope
_WINDOW = 2  # texels on each side: normals are fitted over 5 × 5
_COUNTED_DEPTHS = 32  # number of different depths from which a file's quantisation unit can be determined
_BLOCK = 256  # rows fitted at a time


def noise(values: Array) -> float:
    """Return the standard deviation of the noise of `values` (H, W), in their unit; 0 where too few are finite.

    It is estimated from the median absolute deviation (Hampel 1974) of second differences along rows and columns.
    Slopes do not change these differences, and edges hardly change their median.
    """
    with np.errstate(invalid="ignore"):
        bends = np.concatenate([np.diff(values, 2, axis=axis).ravel() for axis in (0, 1)])
    bends = np.abs(bends[np.isfinite(bends)])
    return float(1.4826 * np.median(bends) / np.sqrt(6)) if bends.size else 0.0


def tolerance(values: Array, cell: Array | float) -> Array:
    """Return the largest steps between neighbouring texels that always count as one surface.

    Such a step is the largest of three: a depth of STEEP texel widths, the effect of noise, and two of the units in
    which the file is quantised.

    Parameters
    ----------
    values
        (H, W) float, metres or 1/m: depths of a relief, or inverse depths of a range image.
    cell
        (H, W) or one number: how much `values` changes by a step in depth as large as a texel is wide.

    Returns
    -------
    Array
        (H, W) float, in the unit of `values`.
    """
    levels = np.unique(values[np.isfinite(values)])
    # A file with two or three depths is not coarsely quantised: it shows two or three surfaces.
    count = float(np.diff(levels).min()) if len(levels) >= _COUNTED_DEPTHS else 0.0
    least = max(_NOISE_MARGIN * noise(values), 2 * count)
    return np.broadcast_to(np.maximum(STEEP * np.asarray(cell), least), values.shape)


def continues(values: Array, allowed: Array, axis: int) -> NDArray[np.bool_]:
    """Return whether the surface continues from each texel to the next one along an axis.

    A step larger than allowed is a slope if it is one of three similar steps in a row. Otherwise it is a tear: depth
    cameras render an edge as one or two such steps, with a pixel between foreground and background.

    Parameters
    ----------
    values
        (H, W) float, metres or 1/m: depths of a relief, or inverse depths of a range image.
    allowed
        (H, W) float in the unit of `values`, the result of `tolerance`.
    axis
        0 for steps between rows, 1 for steps between columns.

    Returns
    -------
    numpy.ndarray
        (H − 1, W) bool for axis 0, (H, W − 1) bool for axis 1: True where the surface continues.
    """
    rows, limit = (np.moveaxis(array, axis, 1) for array in (values, allowed))
    with np.errstate(invalid="ignore"):
        steps = np.diff(rows, axis=1)
        limit = np.maximum(limit[:, 1:], limit[:, :-1])
        kept = np.abs(steps) <= limit
    doubtful = np.nonzero(np.isfinite(steps) & ~kept)
    if len(doubtful[0]):
        padded = np.pad(np.where(np.isfinite(steps), steps, np.nan), ((0, 0), (2, 2)), constant_values=np.nan)
        around = np.stack([padded[doubtful[0], doubtful[1] + k] for k in range(5)], -1)
        slope = steps[doubtful]
        margin = np.maximum(limit[doubtful], _SLOPE_CHANGE * np.abs(slope))
        before, last, _, following, after = (np.abs(around - slope[:, None]) <= margin[:, None]).T
        run = 1 + last + (last & before) + following + (following & after)
        kept[doubtful] = run >= _SLOPE_LENGTH
    return np.moveaxis(kept, 1, axis)


def fit_planes(values: Array, cell: Array | float) -> tuple[NDArray[np.float64], ...]:
    """Fit the plane a + b·Δi + c·Δj to the 5 × 5 neighbourhood of every texel.

    The more a neighbour's value differs from the texel's, beyond the effect of noise, the less it weighs, because there
    is another surface beyond an edge.

    Parameters
    ----------
    values
        (H, W) float, metres or 1/m: depths of a relief, or inverse depths of a range image.
    cell
        (H, W) or one number: how much `values` changes by a step in depth as large as a texel is wide.

    Returns
    -------
    tuple
        a, b, c, each (H, W) float64: the value at the texel, and its change per column (Δi) and per row (Δj). They are
        NaN where there is no surface.
    """
    scale = np.broadcast_to(np.maximum(np.maximum(cell, 3 * noise(values)), 1e-30), values.shape)
    padded = np.pad(np.where(np.isfinite(values), values, np.nan).astype(np.float64), _WINDOW, constant_values=np.nan)
    planes = np.empty((3, *values.shape))
    for row in range(0, len(values), _BLOCK):  # bounds the memory
        rows = slice(row, min(row + _BLOCK, len(values)))
        planes[:, rows] = _fit_planes(padded[rows.start : rows.stop + 2 * _WINDOW], scale[rows])
    return tuple(planes)


def _fit_planes(padded: NDArray[np.float64], scale: Array) -> NDArray[np.float64]:
    """Return `fit_planes` (3, h, W) of a block of rows, given with _WINDOW more texels on all sides."""
    height, width = scale.shape
    centre = padded[_WINDOW:-_WINDOW, _WINDOW:-_WINDOW]
    moments = np.zeros((9, height, width))  # of 1, i, j, ii, ij, jj, d, di, dj
    for j in range(-_WINDOW, _WINDOW + 1):
        for i in range(-_WINDOW, _WINDOW + 1):
            step = padded[_WINDOW + j : _WINDOW + j + height, _WINDOW + i : _WINDOW + i + width] - centre
            known = np.isfinite(step)
            step = np.where(known, step, 0)
            weight = known / (1 + (step / np.where(known, scale, 1)) ** 2) ** 2
            for k, power in enumerate((1, i, j, i * i, i * j, j * j)):
                if power:
                    moments[k] += weight * power
            weight *= step
            for k, power in enumerate((1, i, j), 6):
                if power:
                    moments[k] += weight * power
    moments /= np.where(moments[0] > 0, moments[0], np.nan)
    _, mean_i, mean_j, ii, ij, jj, mean, di, dj = moments
    # A trace of stiffness: a row of texels without neighbours above and below has no slope in that direction.
    ii, jj, ij = ii - mean_i**2 + 1e-12, jj - mean_j**2 + 1e-12, ij - mean_i * mean_j
    di, dj = di - mean * mean_i, dj - mean * mean_j
    determinant = ii * jj - ij**2
    b, c = (jj * di - ij * dj) / determinant, (ii * dj - ij * di) / determinant
    return np.stack([centre + mean - b * mean_i - c * mean_j, b, c])
