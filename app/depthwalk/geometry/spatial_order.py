"""TODO docstring."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array, Rows


def within_runs(counts: Rows) -> Rows:
    """0, 1, 2 … of each of k runs that have `counts` (k,) members, one run after the other; of the same type."""
    dtype = counts.dtype
    return np.arange(int(counts.sum()), dtype=dtype) - np.repeat(np.cumsum(counts, dtype=dtype) - counts, counts)


def runs(first: Rows, cells: Rows) -> NDArray[np.int64]:
    """The numbers of all that `cells` (k,) hold, in their order: of each, those from its `first` to the next one's."""
    counts = first[cells + 1] - first[cells]
    ends = np.cumsum(counts)
    return np.arange(int(counts.sum())) + np.repeat(first[cells] - ends + counts, counts)


def neighbours(points: Array, size: int) -> Rows:
    """An order (n,) of points (n, 3) in which each run of `size` is a leaf of a balanced k-d tree, and each run of
    twice, four times … that is a node: their boxes cover a third of what those about runs of a Morton curve do."""
    order = np.arange(len(points))
    together = size
    while together < len(points):
        together *= 2
    while together > size:
        placed, starts = points[order], np.arange(0, len(points), together)
        low = np.minimum.reduceat(placed, starts)
        extent = np.maximum.reduceat(placed, starts) - low
        axis = extent.argmax(1)
        group = np.arange(len(points)) // together
        along = placed[np.arange(len(points)), axis[group]] - low[group, axis[group]]
        longest = np.maximum(extent.max(1), 1e-9)[group]
        order = order[np.argsort(group + 0.99 * (along / longest), kind="stable")]
        together //= 2
    return order


_MORTON_BITS = 10  # per axis: a thousandth of the scene


def morton(points: Array) -> NDArray[np.uint32]:
    """Places (n,) on a Morton curve through the box around points (n, 3)."""
    if not len(points):
        return np.zeros(0, np.uint32)
    low = points.min(0)
    extent = max(float((points.max(0) - low).max()), 1e-9)
    code = np.zeros(len(points), np.uint32)
    for axis in range(3):
        place = ((points[:, axis] - low[axis]) * (((1 << _MORTON_BITS) - 1) / extent)).astype(np.uint32)
        for mask, shift in ((0x030000FF, 16), (0x0300F00F, 8), (0x030C30C3, 4), (0x09249249, 2)):
            place = (place | place << shift) & mask
        code |= place << axis
    return code
