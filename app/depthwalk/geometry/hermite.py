"""Interpolate between keyframes along cubic curves."""

import numpy as np
from numpy.typing import NDArray


def hermite(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    leaving: NDArray[np.float64],
    arriving: NDArray[np.float64],
    part: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return points of cubic Hermite curves.

    Parameters
    ----------
    before, after
        (n, c) values at both ends.
    leaving, arriving
        (n, c) tangents there, times the length of the way.
    part
        (n, 1) which part of the way is gone, 0 to 1.

    Returns
    -------
    NDArray[np.float64]
        (n, c) values.
    """
    rest = 1 - part
    return rest * rest * ((1 + 2 * part) * before + part * leaving) + part * part * (
        (1 + 2 * rest) * after - rest * arriving
    )
