"""Find distinct integers in ascending order, and number them, in less time than `numpy.unique`, which hashes."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.spatial_order import stable_order
from depthwalk.types import Rows

T = TypeVar("T", bound=np.integer)

_MOST_ROOM = 4  # entries of a table per number that is looked up in it


def sorted_distinct(numbers: NDArray[T]) -> NDArray[T]:
    """Return the distinct values (d,), ascending, of integers of any shape and type, of which there may be none."""
    ordered: NDArray[T] = np.sort(numbers, axis=None)
    return np.asarray(ordered[np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)]])


def distinct_numbers(numbers: Rows) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Find the distinct values among non-negative integers.

    The result is that of `numpy.unique` with its indices and inverse. Small numbers are looked up in a table, which is
    faster than sorting; others are sorted by `stable_order`.

    Parameters
    ----------
    numbers
        (n,) of an integer type, such as rows of vertices.

    Returns
    -------
    tuple
        The d distinct numbers (d,), ascending; the position of each one's first occurrence (d,); and for each of the
        given numbers its row (n,) among the distinct ones. All int64.
    """
    count, most = len(numbers), int(numbers.max(initial=-1))
    if most >= _MOST_ROOM * count:
        return _distinct_by_order(numbers)
    first = np.full(most + 1, -1)
    first[numbers[::-1]] = np.arange(count - 1, -1, -1)  # of several, the last one written stays
    known = np.flatnonzero(first >= 0)
    row = np.empty(most + 1, np.int64)
    row[known] = np.arange(len(known))
    return known, first[known], row[numbers]


def _distinct_by_order(numbers: Rows) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    order = stable_order(np.asarray(numbers, np.int64))
    ordered = numbers[order]
    begins = np.concatenate([[True], ordered[1:] != ordered[:-1]])
    row = np.empty(len(numbers), np.int64)
    row[order] = np.cumsum(begins) - 1
    return np.asarray(ordered[begins], np.int64), order[begins], row
