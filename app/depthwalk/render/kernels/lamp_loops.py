"""Find the lamps in sight, and sort them into clusters of the view.

The reference is `render.lighting.light_clusters`.
"""

import math

import numpy as np

from depthwalk.kernels.compilation import Float64Array1, Float64Array2, Int64Array1, compiled, compiled_as_annotated
from depthwalk.render.kernels.detail_loops import extent
from depthwalk.types import Array, Rows


@compiled_as_annotated
def boxes_in_sight(
    centre: Float64Array2,
    reach: Float64Array1,
    tile: Int64Array1,
    eye: Float64Array1,
    axes: Float64Array2,
    tangent: Float64Array1,
    shear: Float64Array1,
    near: float,
    squares: Float64Array1,
    slices: float,
) -> tuple[Rows, int, Array, Array]:
    """Return which lamps may light something in sight, and the boxes of clusters that they reach.

    Parameters
    ----------
    centre, reach : (n, 3) and (n,) positions and ranges of all lamps, metres, world.
    tile : (n,) the tile of each lamp's shadow map, −1 for none.
    eye, axes, tangent, shear : of the `View`: `position`, `axes`, `half_extent` and `shear`.
    near : the near plane, metres.
    squares : (2,) width and height of the picture in clusters, not rounded.
    slices : slices of clusters in which the distance doubles.

    Returns
    -------
    (k,) rows of the lamps, first those with shadow maps, how many these are, and (k, 3) lower and upper corners of
    their boxes, in columns, rows and slices.
    """
    seen, first, last = np.empty(len(reach), np.int64), np.empty((len(reach), 3)), np.empty((len(reach), 3))
    count, mapped = 0, 0
    for maps in (True, False):
        for lamp in range(len(reach)):
            if (tile[lamp] >= 0) != maps:
                continue
            x, y, z = centre[lamp, 0] - eye[0], centre[lamp, 1] - eye[1], centre[lamp, 2] - eye[2]
            ahead, radius = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z, reach[lamp]
            inside = ahead + radius > 0
            for j in range(2):
                across = axes[j, 0] * x + axes[j, 1] * y + axes[j, 2] * z
                low, high = extent(across, ahead, radius, shear[j], tangent[j], near)
                first[count, j], last[count, j] = (low + 1) / 2 * squares[j], (high + 1) / 2 * squares[j]
                inside = inside and low < high
            first[count, 2] = slices * math.log2(max(ahead - radius, 1.0))
            last[count, 2] = slices * math.log2(max(ahead + radius, 1.0))
            if inside:
                seen[count] = lamp
                count += 1
        mapped = count if maps else mapped
    return seen[:count], mapped, first[:count], last[:count]


@compiled
def _ranges(first: Array, last: Array, shape: Rows) -> Rows:
    """Return for each box (n,) the clusters that it overlaps along each axis: the first, and one after the last."""
    found = np.zeros((len(first), 3, 2), np.int64)
    for box in range(len(first)):
        for axis in range(3):
            most = shape[axis] - 1
            found[box, axis, 0] = min(max(math.floor(first[box, axis]), 0), most)
            found[box, axis, 1] = min(max(math.floor(last[box, axis]), 0), most) + 1
    return found


@compiled_as_annotated
def cluster_lists(first: Float64Array2, last: Float64Array2, shape: Int64Array1, mapped: int) -> tuple[Array, Array]:
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
