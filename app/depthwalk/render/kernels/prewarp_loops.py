"""Warp height fields within their pictures' planes, row by row and then column by column.

The reference is `render.relief_prewarp`.
"""

import math

import numpy as np

from depthwalk.kernels.compilation import Float32Picture, Float64Array1, Float64Array2, compiled, compiled_as_annotated
from depthwalk.types import Array


@compiled
def _segment(numbers: int, epipole: float, k: int) -> int:
    """Return which of the segments between `numbers` texels is drawn as number `k`, see `segment_order`."""
    before = min(max(math.floor(epipole), 0), numbers - 1)
    after = min(max(math.ceil(epipole), 0), numbers - 1)
    if k < before:
        return k
    return numbers - 2 - (k - before) if k < before + numbers - 1 - after else before


@compiled
def _pixels_between(start: float, end: float, low: float, step: float, count: int) -> tuple[int, int]:
    """Return the first pixel of a line of `count` that a segment covers, and one after the last."""
    return max(math.ceil((start - low) / step), 0), min(math.floor((end - low) / step), count - 1) + 1


@compiled
def _interpolated(at_start: float, at_end: float, start: float, end: float, place: float) -> float:
    """Return the value at `place` of a segment whose ends, at `start` and `end`, have the given values."""
    return at_start + min(max((place - start) / max(end - start, 1e-300), 0.0), 1.0) * (at_end - at_start)


@compiled
def _columns(ratio: Array, epipole: float, low: float, step: float, warped: Array) -> None:
    """Move each row of `ratio` (h, w) along itself into `warped` (h, columns), see `warped_lines`."""
    rows, numbers = ratio.shape
    for row in range(rows):
        for k in range(numbers - 1):
            j = _segment(numbers, epipole, k)
            at_start, at_end = np.float64(ratio[row, j]), np.float64(ratio[row, j + 1])
            if at_start <= 0 or at_end <= 0:
                continue
            start, end = epipole + (j - epipole) * at_start, epipole + (j + 1 - epipole) * at_end
            first, after = _pixels_between(start, end, low, step, warped.shape[1])
            for column in range(first, after):
                warped[row, column] = _interpolated(at_start, at_end, start, end, low + step * column)


@compiled
def _rows(ratio: Array, epipole: float, low: float, step: float, warped: Array) -> None:
    """Move each column of `ratio` (h, w) along itself into `warped` (rows, w), see `warped_lines`.

    All columns are moved side by side, in the order of memory.
    """
    numbers, columns = ratio.shape
    for k in range(numbers - 1):
        j = _segment(numbers, epipole, k)
        for column in range(columns):
            at_start, at_end = np.float64(ratio[j, column]), np.float64(ratio[j + 1, column])
            if at_start <= 0 or at_end <= 0:
                continue
            start, end = epipole + (j - epipole) * at_start, epipole + (j + 1 - epipole) * at_end
            first, after = _pixels_between(start, end, low, step, warped.shape[0])
            for row in range(first, after):
                warped[row, column] = _interpolated(at_start, at_end, start, end, low + step * row)


@compiled_as_annotated
def prewarp(
    depth: Float32Picture,
    epipole: Float64Array2,
    distance: Float64Array1,
    low: Float64Array2,
    step: Float64Array2,
    rows: int,
    columns: int,
) -> Array:
    """Return the pre-warped images (n, rows, columns) of a height field; see `relief_prewarp.prewarp`."""
    warped = np.zeros((len(distance), rows, columns), np.float32)
    ratio, moved = np.empty(depth.shape, np.float32), np.empty((depth.shape[0], columns), np.float32)
    for k in range(len(distance)):
        for row in range(depth.shape[0]):
            for column in range(depth.shape[1]):
                behind = depth[row, column]
                ratio[row, column] = distance[k] / (distance[k] + behind) if behind <= 1 else 0.0
        moved[:] = 0
        _columns(ratio, epipole[k, 0], low[k, 0], step[k, 0], moved)
        _rows(moved, epipole[k, 1], low[k, 1], step[k, 1], warped[k])
    return warped
