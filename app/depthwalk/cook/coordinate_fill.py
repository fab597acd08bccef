"""Extrapolate texture coordinates a few texels beyond the edges of surfaces, where drawing looks them up.

Simplified triangles and boundary strips end up to a few texels beside the samples that they are made from. There the
colours and normals of the nearest sample are good enough, since they hardly change; coordinates continue at the rate at
which they change.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import COORDINATE_STEPS, HAS_COORDINATES, ONE_CHART, DepthImage
from depthwalk.types import Array, Ints, Mask

T = TypeVar("T", bound=np.generic)

_FARTHEST = 4.0  # texels from a sample, up to which coordinates are extrapolated


def filled_coordinates(image: DepthImage) -> NDArray[np.uint16]:
    """Return the texture coordinates of a depth image, extrapolated into empty texels.

    Parameters
    ----------
    image
        A depth image of (H, W) texels that has coordinates.

    Returns
    -------
    numpy.ndarray
        (H, W, 2) uint16, see `DepthImage.coordinates`. Empty texels near a sample continue the coordinates around it,
        and belong to its chart.
    """
    from scipy.ndimage import distance_transform_edt, label

    assert image.coordinates is not None
    empty = ~np.isfinite(image.depth)
    whole = image.coordinates[..., 1] & ONE_CHART > 0
    if not empty.any() or not whole.any():
        return image.coordinates
    codes = image.coordinates.astype(np.int64)
    distance, (row, column) = distance_transform_edt(~_of_cells(whole), return_indices=True)
    row, column, near = row[empty], column[empty], distance[empty] <= _FARTHEST
    offset = np.argwhere(empty)[:, ::-1] - np.stack([column, row], -1)
    slope = np.stack([_slopes(codes, whole, axis)[row, column] for axis in (1, 0)], -1)  # (n, u and v, along and up)
    continued = codes[row, column] + np.einsum("nij,nj->ni", slope, offset)
    filled = np.where(near[:, None], np.round(continued).astype(np.int64) & COORDINATE_STEPS - 2, 0)
    filled[:, 0] |= near * HAS_COORDINATES
    codes[empty] = filled
    chart = _of_cells(label(whole, np.ones((3, 3)))[0])  # whole cells that touch each other form one chart
    chart[empty] = np.where(near, chart[row, column], 0)
    right, above, across = (np.roll(chart, shift, (0, 1)) for shift in ((0, -1), (-1, 0), (-1, -1)))
    one = (chart > 0) & (right == chart) & (above == chart) & (across == chart)
    one[-1], one[:, -1] = False, False
    solid_cell = ~np.any([np.roll(empty, shift, (0, 1)) for shift in ((0, 0), (0, -1), (-1, 0), (-1, -1))], axis=0)
    codes[..., 1] |= (one & ~solid_cell) * ONE_CHART
    return codes.astype(np.uint16)


def _of_cells(values: NDArray[T]) -> NDArray[T]:
    """Return, for each texel, the greatest of the values (H, W) of the four cells around it.

    The cell of a texel lies between it and those to its right and above it.
    """
    return np.asarray(np.max([np.roll(values, shift, (0, 1)) for shift in ((0, 0), (0, 1), (1, 0), (1, 1))], axis=0))


def _slopes(codes: Ints, whole: Mask, axis: int) -> Array:
    """Return how much coordinates (H, W, 2) change from texel to texel along an axis, at each texel.

    It is the mean over the surrounding cells that are `whole` (H, W); 0 where there are none.
    """
    known = (whole | np.roll(whole, 1, 1 - axis))[..., None]
    difference = np.roll(codes, -1, axis) - codes + COORDINATE_STEPS // 2
    step = np.where(known, difference % COORDINATE_STEPS - COORDINATE_STEPS // 2, 0)  # since the texture repeats
    count = known.astype(int) + np.roll(known, 1, axis)
    return np.asarray((step + np.roll(step, 1, axis)) / np.maximum(count, 1), np.float64)
