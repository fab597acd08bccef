"""Measure how far points in front of a height field are from its surface (Donnelly 2005)."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates

from depthwalk.bake.images import BakedObject
from depthwalk.render.resources.relative_depth import relative_depth

_MAX_FINE_SLICES = 256  # of the volume in which distances are measured: a second or two for 256 × 256 texels


def distance_volume(baked: BakedObject, size: tuple[int, int, int]) -> NDArray[np.float32]:
    """Return how far points in the box about a height field are from what is behind its surface.

    Parameters
    ----------
    baked
        An object of one planar depth image.
    size
        Width, height and depth of the volume, texels. Distances are measured in one with as many times more slices as
        make its texels about cubes, of which the volume keeps some.

    Returns
    -------
    NDArray[np.float32]
        (depth, height, width) metres, 0 behind the surface; +inf becomes the length of the box where there is none.
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
