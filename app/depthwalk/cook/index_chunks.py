"""Index lists of 16 bits: triangles come in chunks, whose indices count from a vertex of their own."""

import numpy as np
from numpy.typing import NDArray

MOST_VERTICES = 1 << 16  # of a chunk
WHOLE = np.zeros((1, 2), np.int64)  # one chunk, from the first vertex on

Chunks = NDArray[np.int64]  # (c, 2), rising: of each chunk the first index, and the vertex from which its indices count


def vertex_numbers(indices: NDArray[np.unsignedinteger], chunks: Chunks, first: int, count: int) -> NDArray[np.int64]:
    """The vertices (count,) of a run of `indices`."""
    place = np.arange(first, first + count)
    return chunks[np.searchsorted(chunks[:, 0], place, "right") - 1, 1] + indices[place]


def chunk_runs(chunks: Chunks, first: int, count: int) -> list[tuple[int, int, int]]:
    """A run of indices as runs within one chunk each: first index, number of indices, vertex from which they count."""
    ends = np.append(chunks[1:, 0], first + count)
    start, stop = np.maximum(chunks[:, 0], first), np.minimum(ends, first + count)
    some = stop > start
    columns = start[some], (stop - start)[some], chunks[some, 1]
    return list(zip(*(column.tolist() for column in columns), strict=True))
