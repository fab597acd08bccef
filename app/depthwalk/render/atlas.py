"""Where each intermediate image lies in the atlas: shelf packing, highest tiles first."""

import numpy as np
from numpy.typing import NDArray


def pack_shelves(sizes: NDArray[np.int64], width: int) -> tuple[NDArray[np.int64], int]:
    """Lower left corners (n, 2) of tiles of `sizes` (n, 2) in a strip `width` texels wide, and the height used.

    Next-fit decreasing height: sorted by height, tiles fill a shelf until its width is spent. The loop runs over
    shelves, not tiles. No size may exceed `width`.
    """
    corners = np.zeros_like(sizes)
    order = np.argsort(-sizes[:, 1], kind="stable")
    ends = np.cumsum(sizes[order, 0])
    start, y = 0, 0
    while start < len(order):
        before = ends[start - 1] if start else 0
        stop = int(np.searchsorted(ends, before + width, side="right"))
        shelf = order[start:stop]
        corners[shelf, 0] = ends[start:stop] - sizes[shelf, 0] - before
        corners[shelf, 1] = y
        y += int(sizes[order[start], 1])
        start = stop
    return corners, y
