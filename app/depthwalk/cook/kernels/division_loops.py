"""Divide runs of points into leaves of k-d trees. The reference is `geometry.spatial_order.kd_tree_order`."""

import numpy as np

from depthwalk.kernels.compilation import Float32Array2, Int64Array1, compiled, compiled_as_annotated
from depthwalk.types import Array, Ints


@compiled
def _divide(placed: Array, order: Ints, together: int, size: int) -> None:
    """Sort points and their order into the leaves of a tree whose root has room for `together`."""
    stack = np.empty((128, 3), np.int64)
    _push(stack, 0, 0, len(order), together)
    depth = 1
    while depth:
        depth -= 1
        low, high, together = stack[depth]
        if together <= size or high - low <= size:
            continue
        half = together // 2
        if low + half < high:
            _select(placed, order, low, high, low + half, _longest_axis(placed, low, high))
            _push(stack, depth, low + half, high, half)
            depth += 1
            _push(stack, depth, low, low + half, half)
            depth += 1
        else:
            _push(stack, depth, low, high, half)
            depth += 1


@compiled
def _push(stack: Ints, depth: int, low: int, high: int, together: int) -> None:
    """Write a row (low, high, together) of the stack of runs."""
    stack[depth, 0], stack[depth, 1], stack[depth, 2] = low, high, together


@compiled
def _longest_axis(placed: Array, low: int, high: int) -> int:
    """Return the axis along which points from `low` to `high` extend farthest."""
    best, longest = 0, -1.0
    for axis in range(placed.shape[1]):
        least = greatest = placed[low, axis]
        for row in range(low + 1, high):
            least, greatest = min(least, placed[row, axis]), max(greatest, placed[row, axis])
        if greatest - least > longest:
            best, longest = axis, greatest - least
    return best


@compiled
def _select(placed: Array, order: Ints, low: int, high: int, middle: int, axis: int) -> None:
    """Exchange points from `low` to `high` until those before `middle` come before the others along an axis.

    See Hoare 1961, "Algorithm 65: Find".
    """
    high -= 1
    while low < high:
        pivot = placed[(low + high) // 2, axis]
        i, j = low, high
        while i <= j:
            while placed[i, axis] < pivot:
                i += 1
            while pivot < placed[j, axis]:
                j -= 1
            if i <= j:
                for k in range(placed.shape[1]):
                    placed[i, k], placed[j, k] = placed[j, k], placed[i, k]
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@compiled_as_annotated
def divide(points: Float32Array2, begins: Int64Array1, sizes: Int64Array1) -> Ints:
    """Return an order of points (n, k), float32, in which each run is in the order of a k-d tree.

    begins: (r + 1,) first point of each run, and n; sizes: (r,) points in a leaf of each.
    """
    order = np.arange(len(points))
    for run in range(len(sizes)):
        low, high = begins[run], begins[run + 1]
        placed = points[low:high].copy()
        together = sizes[run]
        while together < high - low:
            together *= 2
        _divide(placed, order[low:high], together, sizes[run])
    return order
