"""Continue texture coordinates a few texels beyond the edges of surfaces, as what is drawn there looks them up.

Simplified triangles and boundary strips end beside the samples that they are made of, up to a few texels on. Colours and
normals of the nearest sample do there, since they hardly change; coordinates go on at the rate at which they change.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import DepthImage
from depthwalk.bake.texture_coordinates import HAS_COORDINATES, ONE_CHART, STEPS
from depthwalk.types import Array, Ints, Mask

_FARTHEST = 4.0  # texels from a sample, up to which coordinates are continued


def filled_coordinates(image: DepthImage) -> NDArray[np.uint16]:
    """Return the texture coordinates of a depth image, continued into empty texels.

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
    known = whole | _before(whole, 0) | _before(whole, 1) | _before(_before(whole, 0), 1)  # corners of whole cells
    distance, (row, column) = distance_transform_edt(~known, return_indices=True)
    row, column = row[empty], column[empty]
    offset = np.stack([empty.nonzero()[1] - column, empty.nonzero()[0] - row], -1)
    near = distance[empty] <= _FARTHEST
    slope = np.stack([_slopes(codes, whole, axis)[row, column] for axis in (1, 0)], -1)  # (n, u and v, along and up)
    continued = codes[row, column] + np.einsum("nij,nj->ni", slope, offset)
    filled = np.where(near[:, None], np.round(continued).astype(np.int64) & STEPS - 2, 0)
    filled[:, 0] |= near * HAS_COORDINATES
    codes[empty] = filled
    # Charts are told apart by the whole cells that touch each other.
    chart = label(whole, np.ones((3, 3)))[0]
    of_texel = np.max([chart, _before(chart, 0), _before(chart, 1), _before(_before(chart, 0), 1)], axis=0)
    of_texel[empty] = np.where(near, of_texel[row, column], 0)
    corners = [of_texel, *(np.roll(of_texel, shift, (0, 1)) for shift in ((0, -1), (-1, 0), (-1, -1)))]
    same = np.all([corner == of_texel for corner in corners], axis=0) & (of_texel > 0)
    around = np.any([np.roll(empty, shift, (0, 1)) for shift in ((0, 0), (0, -1), (-1, 0), (-1, -1))], axis=0)
    same[-1], same[:, -1] = False, False
    codes[..., 1] |= (same & around) * ONE_CHART
    return codes.astype(np.uint16)


def _before(values: Ints | Mask, axis: int) -> NDArray[np.generic]:
    """Return at each texel the value of the texel before it along an axis; the first gets the last one's."""
    return np.roll(values, 1, axis)


def _slopes(codes: Ints, whole: Mask, axis: int) -> Array:
    """Return by how much coordinates (H, W, 2) change from a texel to the next along an axis, at each texel.

    It is a mean over the cells that are `whole` (H, W), which hold a texel and those above and to its right; 0 where
    there are none.
    """
    step = (np.roll(codes, -1, axis) - codes + STEPS // 2) % STEPS - STEPS // 2
    valid = (whole | _before(whole, 1 - axis))[..., None]
    count = valid + _before(valid, axis).astype(int)
    return np.where(valid, step, 0) / np.maximum(count, 1) + _before(np.where(valid, step, 0), axis) / np.maximum(count, 1)
