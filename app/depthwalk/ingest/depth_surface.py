"""What a depth image alone tells of its surface: how noisy it is, how it slopes, and where it is torn.

`values` (H, W) are a quantity that is linear over the image for a plane: depth where the rays are parallel, inverse
depth where they meet in a pinhole. NaN or infinite where there is no surface.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array

STEEP = 4.0  # cells: a step of this depth between neighbours is always taken for a slope (76°)
_NOISE_MARGIN = 6.0  # standard deviations that a step between neighbours may have by noise alone
_SLOPE_CHANGE = 0.5  # how much a slope may change, of itself, from one step to the next ones
_SLOPE_LENGTH = 3  # steps that make a slope
_WINDOW = 2  # texels on each side: normals are fitted over 5 × 5
_LEVELS = 32  # different depths that tell how fine a file counts
_BLOCK = 256  # rows fitted at a time


def noise(values: Array) -> float:
    """Return the standard deviation of the noise.

    The median second difference along rows and columns knows no slope and, being a median, no edges.
    """
    with np.errstate(invalid="ignore"):
        bends = np.concatenate([np.diff(values, 2, axis=axis).ravel() for axis in (0, 1)])
    bends = np.abs(bends[np.isfinite(bends)])
    return float(1.4826 * np.median(bends) / np.sqrt(6)) if bends.size else 0.0


def tolerance(values: Array, cell: Array | float) -> Array:
    """Return the steps (H, W) between neighbours that need no explanation.

    They are a slope of STEEP cells, noise, or two counts of the file, whichever is largest.

    cell: (H, W) or one number, what a step as deep as a texel is wide makes in `values`.
    """
    levels = np.unique(values[np.isfinite(values)])
    # Two or three depths in all are not a coarse file's stairs but so many surfaces.
    count = float(np.diff(levels).min()) if len(levels) >= _LEVELS else 0.0
    least = max(_NOISE_MARGIN * noise(values), 2 * count)
    return np.broadcast_to(np.maximum(STEEP * np.asarray(cell), least), values.shape)


def continues(values: Array, allowed: Array, axis: int) -> NDArray[np.bool_]:
    """Whether the surface goes on from each texel to the next along `axis`: (H, W − 1) for 1, (H − 1, W) for 0.

    allowed: (H, W) as of `tolerance`. A step beyond it is a slope if it is one of three alike in a row, and a tear if
    not: one or two are an edge with a pixel between foreground and background on it, as depth cameras see edges.
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
    """The plane a + b·Δi + c·Δj through each texel's 5 × 5 neighbourhood: a, b, c, each (H, W); i runs along rows, j
    along columns. NaN where there is no surface.

    Neighbours weigh the less, the more their value differs from the texel's: beyond an edge is another surface. `cell`
    as in `tolerance`; the noise is allowed for.
    """
    scale = np.broadcast_to(np.maximum(np.maximum(cell, 3 * noise(values)), 1e-30), values.shape)
    padded = np.pad(np.where(np.isfinite(values), values, np.nan).astype(np.float64), _WINDOW, constant_values=np.nan)
    planes = np.empty((3, *values.shape))
    for row in range(0, len(values), _BLOCK):  # bounds the memory
        rows = slice(row, min(row + _BLOCK, len(values)))
        planes[:, rows] = _fit_planes(padded[rows.start : rows.stop + 2 * _WINDOW], scale[rows])
    return tuple(planes)


def _fit_planes(padded: NDArray[np.float64], scale: Array) -> NDArray[np.float64]:
    """`fit_planes` (3, h, W) of some rows, with _WINDOW more texels on all sides."""
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
    # A trace of stiffness: a row of texels without neighbours above and below has no slope that way.
    ii, jj, ij = ii - mean_i**2 + 1e-12, jj - mean_j**2 + 1e-12, ij - mean_i * mean_j
    di, dj = di - mean * mean_i, dj - mean * mean_j
    determinant = ii * jj - ij**2
    b, c = (jj * di - ij * dj) / determinant, (ii * dj - ij * di) / determinant
    return np.stack([centre + mean - b * mean_i - c * mean_j, b, c])
