"""Twin of shaders/occlusion."""

import numpy as np
from numpy.typing import NDArray


def farthest_cells(depth: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """The greatest of a depth buffer (H, W) in each cell of `side` × `side` pixels; the last ones may be cut off."""
    height, width = depth.shape
    padded = np.pad(depth, ((0, -height % side), (0, -width % side)))
    rows, columns = (length // side for length in padded.shape)
    return np.asarray(padded.reshape(rows, side, columns, side).max((1, 3)))
