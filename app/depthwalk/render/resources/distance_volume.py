"""Compute the distance volume of a height field: how far points in front of it are from the surface (Donnelly 2005)."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates

from depthwalk.bake.images import BakedObject
from depthwalk.render.resources.relative_depth import relative_depth

_MAX_FINE_SLICES = 256  # of the volume that distances are computed in: a second or two for 256 × 256 texels


def distance_volume(baked: BakedObject, size: tuple[int, int, int]) -> NDArray[np.float32]:
    """Return the distances of points in the box about a height field from its surface.

    Parameters
    ----------
    baked
        An object of one planar depth image.
    size
        Width, height and depth of the volume, texels. Distances are computed with more slices, so many that texels are
        about cubes; the volume keeps some of them.

    Returns
    -------
    NDArray[np.float32]
        (depth, height, width) metres, 0 behind the surface; the diagonal of the box if there is no surface at all.
    """
    columns, rows, slices = size
    volume = baked.cylinder
    extent = np.array([volume.height, 2 * volume.half_depth, 2 * volume.half_width])
    finer = round(extent[0] / slices / (extent[2] / columns))
    finer = min(max(finer, 1), _MAX_FINE_SLICES // slices) // 2 * 2 + 1  # odd: one of them is in the middle
    relative = relative_depth(baked)
    row, column = (
        (np.arange(count) + 0.5) / count * texels - 0.5
        for count, texels in zip((rows, columns), relative.shape, strict=True)
    )
    surface = map_coordinates(relative, np.meshgrid(row, column, indexing="ij"), order=1, mode="nearest")
    depth = (np.arange(slices * finer) + 0.5) / (slices * finer)
    in_front = depth[:, None, None] < surface
    if in_front.all():
        return np.full((slices, rows, columns), np.linalg.norm(extent), np.float32)
    found = distance_transform_edt(in_front, sampling=extent / (slices * finer, rows, columns))
    return np.asarray(found[finer // 2 :: finer], np.float32)
