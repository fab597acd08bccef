"""Compare two runs of the same frames: the factor by which one takes longer, with confidence bounds.

Frames of a walk differ more among themselves than between two runs, and neighbours resemble each other. So each frame
is compared with the same frame of the other run, and the bounds come from a bootstrap over blocks of neighbours (Künsch
1989, "The jackknife and the bootstrap for general stationary observations").
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_RESAMPLED = 2000
_CERTAINTY = 95  # per cent


@dataclass(frozen=True, kw_only=True)
class Ratio:
    """Hold a factor between times, and the bounds between which it lies with a confidence of 95 %.

    Attributes
    ----------
    median
        The median over the frames.
    low, high
        The bounds.
    """

    median: float
    low: float
    high: float

    def __str__(self) -> str:
        """Return the factor and its bounds, as "1.23 × (1.20 to 1.27)"."""
        return f"{self.median:.3g} × ({self.low:.3g} to {self.high:.3g})"


def paired_ratio(over: Sequence[float], under: Sequence[float]) -> Ratio:
    """Return the factor by which the frames of one run take longer than the same frames of another.

    Parameters
    ----------
    over
        (n,) times of the run that is compared, n ≥ 1, each above 0.
    under
        (n,) times of the run that it is compared with, each above 0, in the same unit.

    Returns
    -------
    Ratio
        The factor. For a single frame there are no real bounds: they equal the factor.
    """
    ratios = np.asarray(over, np.float64) / np.asarray(under, np.float64)
    count = len(ratios)
    block = max(1, round(count ** (1 / 3)))
    starts = np.random.default_rng(0).integers(0, count, (_RESAMPLED, -(-count // block)))
    rows = (starts[:, :, None] + np.arange(block)).reshape(_RESAMPLED, -1)[:, :count] % count
    medians = np.median(ratios[rows], axis=1)
    low, high = np.percentile(medians, (50 - _CERTAINTY / 2, 50 + _CERTAINTY / 2))
    return Ratio(median=float(np.median(ratios)), low=float(low), high=float(high))
