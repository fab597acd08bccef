"""Read 16-bit index lists: triangles come in chunks, whose indices count from a base vertex.

16-bit indices take half the memory of 32-bit ones, but reach only 65536 vertices; an object may have more.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Ints

MOST_VERTICES = 1 << 16  # of a chunk
WHOLE = np.zeros((1, 2), np.int64)  # one chunk, from the first vertex on

Chunks = Ints  # (c, 2), ascending: for each chunk the first index, and the vertex from which its indices count


def vertex_numbers(indices: NDArray[np.unsignedinteger], chunks: Chunks, first: int, count: int) -> Ints:
    """Return the vertices to which a run of indices refers.

    Parameters
    ----------
    indices
        (i,) uint16 or uint32, all indices of an object.
    chunks
        (c, 2) int64, ascending: first index of each chunk, and the vertex from which its indices count.
    first, count
        First index and number of indices of the run, which may span several chunks.

    Returns
    -------
    Ints
        (count,) numbers of vertices of the whole object.
    """
    place = np.arange(first, first + count)
    return np.asarray(chunks[np.searchsorted(chunks[:, 0], place, "right") - 1, 1] + indices[place])


def chunk_runs(chunks: Chunks, first: int, count: int) -> list[tuple[int, int, int]]:
    """Split a run of indices at the ends of chunks, since a draw call can draw from one chunk only.

    Parameters
    ----------
    chunks
        (c, 2) int64, ascending: first index of each chunk, and the vertex from which its indices count.
    first, count
        First index and number of indices of the run.

    Returns
    -------
    list
        For each draw call: first index, number of indices, and the vertex from which the indices count.
    """
    ends = np.append(chunks[1:, 0], first + count)
    start, stop = np.maximum(chunks[:, 0], first), np.minimum(ends, first + count)
    met = stop > start
    columns = start[met], (stop - start)[met], chunks[met, 1]
    return list(zip(*(column.tolist() for column in columns), strict=True))
