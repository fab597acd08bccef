"""Pack masks of any shape into one picture, the tighter the less memory a virtual texture takes."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Mask


def pack_masks(masks: list[Mask]) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Place masks in one picture so that they do not overlap.

    Large ones first, each goes to the lowest place where it fits: masks of any shape fill each other's bays.

    Parameters
    ----------
    masks
        (h, w) bool each: which cells it needs.

    Returns
    -------
    tuple
        Row and column of each mask in the picture, and the picture's height and width.
    """
    width = max(int(np.sqrt(sum(mask.sum() for mask in masks))), *(mask.shape[1] for mask in masks))
    taken = np.zeros((sum(mask.shape[0] for mask in masks), width), np.float32)
    places = [(0, 0)] * len(masks)
    height = 0
    for number in sorted(range(len(masks)), key=lambda number: int(masks[number].sum()), reverse=True):
        rows, columns = masks[number].shape
        overlap = _overlaps(taken[: height + rows], masks[number].astype(np.float32))
        row, column = divmod(int((overlap < 0.5).argmax()), overlap.shape[1])
        taken[row : row + rows, column : column + columns] += masks[number]
        places[number] = row, column
        height = max(height, row + rows)
    return places, (height, width)


def _overlaps(taken: NDArray[np.float32], mask: NDArray[np.float32]) -> NDArray[np.float32]:
    """Count the taken cells that `mask` (h, w) would cover at each place in `taken` (H, W).

    Returns (H − h + 1, W − w + 1), whole numbers but for the rounding of the Fourier transform. A circular correlation
    does: no place at which the mask lies inside reaches round the edge. `scipy.signal.fftconvolve` does the same with
    a transform four times as large, and importing it takes a second.
    """
    from scipy.fft import irfft2, next_fast_len, rfft2

    shape = [next_fast_len(side, real=True) for side in taken.shape]
    counts = irfft2(rfft2(taken, shape) * rfft2(mask, shape).conj(), shape)
    return np.asarray(counts[: taken.shape[0] - mask.shape[0] + 1, : taken.shape[1] - mask.shape[1] + 1])
