"""Reduce a depth buffer for occlusion tests, as the twin of shaders/occlusion/farthest.frag.

An object is hidden if it is farther than the farthest depth of every cell that it covers (Greene, Kass and Miller 1993,
"Hierarchical Z-Buffer Visibility"; here one level of the pyramid is read back and searched on the CPU).
"""

import numpy as np
from numpy.typing import NDArray


def farthest_cells(depth: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """Return the greatest depth in each cell of `side` × `side` pixels.

    Parameters
    ----------
    depth
        (H, W) depth buffer, 0 near to 1 far, row 0 at the bottom.
    side
        Edge of a cell, pixels. Cells at the upper and right end may be cut off.

    Returns
    -------
    NDArray[np.float32]
        (⌈H/side⌉, ⌈W/side⌉) greatest depths, 0 near to 1 far.
    """
    height, width = depth.shape
    padded = np.pad(depth, ((0, -height % side), (0, -width % side)))
    rows, columns = (length // side for length in padded.shape)
    return np.asarray(padded.reshape(rows, side, columns, side).max((1, 3)))
