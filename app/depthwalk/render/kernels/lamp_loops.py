"""Sort lamps into clusters of the view.

The reference is `render.lighting.light_clusters.cluster_lists`.
"""

import math

import numpy as np

from depthwalk.kernels.compilation import compiled
from depthwalk.types import Array, Rows


@compiled()
def _ranges(first: Array, last: Array, shape: Rows) -> Rows:
    """Return for each box (n,) the clusters that it overlaps along each axis: the first, and one after the last."""
    found = np.zeros((len(first), 3, 2), np.int64)
    for box in range(len(first)):
        for axis in range(3):
            most = shape[axis] - 1
            found[box, axis, 0] = min(max(math.floor(first[box, axis]), 0), most)
            found[box, axis, 1] = min(max(math.floor(last[box, axis]), 0), most) + 1
    return found


@compiled("D2 D2 I1 i")
def cluster_lists(first: Array, last: Array, shape: Rows, mapped: int) -> tuple[Array, Array]:
    """Return the lists of n boxes that overlap each of c clusters.

    Parameters
    ----------
    first, last : (n, 3) corners of the boxes, in columns, rows and slices of clusters.
    shape : (3,) number of columns, rows and slices.
    mapped : how many boxes, the first of them, are those of lamps with shadow maps.

    Returns
    -------
    (c, 4) and (l, 4) float32, the columns of `LightClusters.cells` and `LightClusters.lists`.
    """
    columns, rows = shape[0], shape[1]
    boxes = _ranges(first, last, shape)
    cells = np.zeros((columns * rows * shape[2], 4), np.float32)
    for box in range(len(boxes)):
        for z in range(boxes[box, 2, 0], boxes[box, 2, 1]):
            for y in range(boxes[box, 1, 0], boxes[box, 1, 1]):
                for x in range(boxes[box, 0, 0], boxes[box, 0, 1]):
                    cell = (z * rows + y) * columns + x
                    cells[cell, 1] += 1
                    if box < mapped:
                        cells[cell, 2] += 1
    ends, total = np.zeros(len(cells), np.int64), 0
    for cell in range(len(cells)):
        cells[cell, 0], ends[cell] = total, total
        total += int(cells[cell, 1])
    lists = np.zeros((-(-total // 4), 4), np.float32)
    for box in range(len(boxes)):
        for z in range(boxes[box, 2, 0], boxes[box, 2, 1]):
            for y in range(boxes[box, 1, 0], boxes[box, 1, 1]):
                for x in range(boxes[box, 0, 0], boxes[box, 0, 1]):
                    cell = (z * rows + y) * columns + x
                    lists[ends[cell] // 4, ends[cell] % 4] = box
                    ends[cell] += 1
    return cells, lists
