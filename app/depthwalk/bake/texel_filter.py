"""Filter the texels of textures that repeat."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Ints

Fetch = Callable[[Ints, Ints], NDArray[np.float32]]
"""Returns texels (n, k) by their rows and columns (n,) each."""


def bilinear(fetch: Fetch, size: tuple[int, int], uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sample a repeating texture bilinearly.

    Parameters
    ----------
    fetch
        Returns texels by their rows, from 0 at v = 1, and columns.
    size
        Height and width of the texture, texels.
    uv
        (n, 2) texture coordinates, v upward.

    Returns
    -------
    numpy.ndarray
        (n, k) float32, what `fetch` returns, interpolated.
    """
    height, width = size
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - i)[:, None].astype(np.float32), (y - j)[:, None].astype(np.float32)
    i0, i1, j0, j1 = i % width, (i + 1) % width, j % height, (j + 1) % height
    corners = [fetch(row, column) for row in (j0, j1) for column in (i0, i1)]
    low = corners[0] * (1 - fx) + corners[1] * fx
    high = corners[2] * (1 - fx) + corners[3] * fx
    return np.asarray(low * (1 - fy) + high * fy)
