"""What a depth image alone tells of its surface: how noisy it is, how it slopes, and where it is torn.

`values` (H, W) are a quantity that is linear over the image for a plane: depth where the rays are parallel, inverse
depth where they meet in a pinhole. NaN or infinite where there is no surface.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

STEEP = 4.0  # cells: a step of this depth between neighbours is always taken for a slope (76°)
_NOISE_MARGIN = 6.0  # standard deviations that a step between neighbours may have by noise alone
_SLOPE_CHANGE = 0.5  # how much a slope may change, of itself, from one step to the next ones
_WINDOW = 2  # texels on each side: normals are fitted over 5 × 5


def noise(values: Array) -> float:
    """Standard deviation of the noise: the median second difference along rows and columns knows no slope and, being a
    median, no edges."""
    with np.errstate(invalid="ignore"):
        bends = np.concatenate([np.diff(values, 2, axis=axis).ravel() for axis in (0, 1)])
    bends = np.abs(bends[np.isfinite(bends)])
    return float(1.4826 * np.median(bends) / np.sqrt(6)) if bends.size else 0.0


def tolerance(values: Array, cell: Array | float) -> Array:
    """Steps (H, W) between neighbours that need no explanation: a slope of STEEP cells, noise, or two counts of the file.

    cell: (H, W) or one number, what a step as deep as a texel is wide makes in `values`.
    """
    with np.errstate(invalid="ignore"):
        steps = np.abs(np.concatenate([np.diff(values, axis=axis).ravel() for axis in (0, 1)]))
    count = steps[np.isfinite(steps) & (steps > 0)].min(initial=np.inf)
    least = max(_NOISE_MARGIN * noise(values), 2 * count if np.isfinite(count) else 0.0)
    return np.broadcast_to(np.maximum(STEEP * np.asarray(cell), least), values.shape)


def continues(values: Array, allowed: Array, axis: int) -> NDArray[np.bool_]:
    """Whether the surface goes on from each texel to the next along `axis`: (H, W − 1) for 1, (H − 1, W) for 0.

    allowed: (H, W) as of `tolerance`. A step beyond it is a slope if the steps around it are alike, and a tear if not:
    it is compared with the median of five in a row, so that a slope needs three. One or two alike are an edge with a
    pixel between foreground and background on it, as depth cameras see edges.
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
        slope = np.nanmedian(around, axis=1)
        off = np.abs(steps[doubtful] - slope)
        alike = off <= np.maximum(limit[doubtful], _SLOPE_CHANGE * np.abs(slope))
        kept[doubtful] = alike & (np.isfinite(around).sum(1) >= 3)
    return np.moveaxis(kept, 1, axis)


def fit_planes(values: Array, cell: Array | float) -> tuple[NDArray[np.float64], ...]:
    """The plane a + b·Δi + c·Δj through each texel's 5 × 5 neighbourhood: a, b, c, each (H, W); i runs along rows, j
    along columns. NaN where there is no surface.

    Neighbours weigh the less, the more their value differs from the texel's: beyond an edge is another surface. `cell`
    as in `tolerance`; the noise is allowed for.
    """
    known = np.isfinite(values)
    centre = np.where(known, values, 0).astype(np.float64)
    scale = np.maximum(np.maximum(cell, 3 * noise(values)), 1e-30)
    padded = np.pad(centre, _WINDOW), np.pad(known, _WINDOW)
    height, width = values.shape
    moments = np.zeros((9, height, width))  # of 1, i, j, ii, ij, jj, d, di, dj
    for j in range(-_WINDOW, _WINDOW + 1):
        for i in range(-_WINDOW, _WINDOW + 1):
            window = np.s_[_WINDOW + j : _WINDOW + j + height, _WINDOW + i : _WINDOW + i + width]
            step = padded[0][window] - centre
            weight = padded[1][window] / (1 + (step / scale) ** 2) ** 2
            for moment, power in zip(moments, (1, i, j, i * i, i * j, j * j, step, step * i, step * j), strict=True):
                moment += weight * power
    total = np.where(known, moments[0], 1)
    mean_i, mean_j, mean = moments[1] / total, moments[2] / total, moments[6] / total
    # A trace of stiffness: a row of texels without neighbours above and below has no slope that way.
    ii, jj = (moments[k] / total - mean_k**2 + 1e-12 for k, mean_k in ((3, mean_i), (5, mean_j)))
    ij = moments[4] / total - mean_i * mean_j
    di, dj = moments[7] / total - mean * mean_i, moments[8] / total - mean * mean_j
    determinant = ii * jj - ij**2
    b, c = (jj * di - ij * dj) / determinant, (ii * dj - ij * di) / determinant
    a = centre + mean - b * mean_i - c * mean_j
    return tuple(np.where(known, part, np.nan) for part in (a, b, c))
