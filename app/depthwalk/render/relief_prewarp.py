"""Warp height fields within the planes of their pictures, so that, drawn as flat textures, they look like the surfaces.

This is the pre-warp of relief texture mapping (Oliveira, Bishop and McAllister 2000). A texel at (u, v), d behind the
picture's plane, is seen through the point of that plane that lies λ = D / (D + d) of the way from the epipole to
(u, v), where D is the viewer's distance from the plane and the epipole the point of the plane that is nearest to the
viewer. The displacements along u and along v do not depend on each other, so that two one-dimensional passes suffice:
each row of texels is moved and interpolated along u, then each column of the result along v.

Only λ is moved. The true depth of the surface follows from it, and so does the place of a texel in the second pass,
which the publication carries along. On a plane in space λ changes linearly over the picture, so that interpolating it
linearly is exact, as it is for 1 / depth.

Compiled loops do the same where they are loaded (`render.kernels`); this is their reference.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from depthwalk.render import kernels
from depthwalk.types import Array, Rows

MAX_SIDE = 2048
"""Most texels along either side of a pre-warped image; a larger one gets coarser texels than the picture."""

_LEAST_DISTANCE = 1e-9  # of a viewer from the plane, parts of the depth: from the plane itself nothing is seen
_GROWTH = 2  # most texels along a side, times the picture's: seen at a grazing angle, its image is long


@dataclass(frozen=True, kw_only=True)
class PlaneImages:
    """Place the pre-warped images for n viewers on the picture's plane, in texels of the picture.

    Attributes
    ----------
    low : (n, 2) where the middle of the first texel is, along u and v; the picture's first texel is at 0.
    step : (n, 2) how far apart texels are, 1 unless there would be too many.
    count : (n, 2) int64, how many texels there are along u and v.
    """

    low: Array
    step: Array
    count: Rows


def most_texels(shape: tuple[int, int]) -> Rows:
    """Return the largest width and height, (2,) texels, of the pre-warped images of a picture (H, W) of that shape."""
    return np.array([min(_GROWTH * side, MAX_SIDE) for side in shape[::-1]])


def plane_images(shape: tuple[int, int], viewer: Array) -> PlaneImages:
    """Return the smallest rectangles of the picture's plane through which viewers see all of the box behind it.

    Parameters
    ----------
    shape
        Height H and width W of the picture, texels.
    viewer
        (n, 3) where the viewers stand: u, v and depth, field coordinates (`render.resources.height_field`), depth < 0.

    Returns
    -------
    PlaneImages
        The rectangles.
    """
    size = np.array(shape[::-1])
    epipole, distance = _epipoles(shape, viewer)
    nearest = (distance / (distance + 1))[:, None]  # λ at the back of the box
    last = size - 1
    low = np.floor(np.minimum(0.0, epipole * (1 - nearest)))
    high = np.ceil(np.maximum(last, epipole + (last - epipole) * nearest))
    most = most_texels(shape)
    step = np.maximum((high - low) / (most - 1), 1.0)
    count = np.minimum(np.ceil((high - low) / step).astype(np.int64) + 1, most)
    return PlaneImages(low=low, step=step, count=count)


def prewarp(depth: NDArray[np.float32], viewer: Array, images: PlaneImages) -> NDArray[np.float32]:
    """Warp a height field for n viewers.

    Parameters
    ----------
    depth
        (H, W) depth behind the picture's plane, 1 at the back of the box, more where there is no surface.
    viewer
        (n, 3) where the viewers stand, field coordinates, depth < 0.
    images
        Where their images lie.

    Returns
    -------
    NDArray[np.float32]
        (n, rows, columns), as large as the largest of the images: λ of what is seen there, 0 where nothing is.
    """
    epipole, distance = _epipoles((depth.shape[0], depth.shape[1]), viewer)
    columns, rows = images.count.max(0).tolist()
    if (loops := kernels.loaded()) is not None:
        found = loops.prewarp(depth, epipole, distance, images.low, images.step, rows, columns)
        return cast(NDArray[np.float32], found)
    warped = np.empty((len(viewer), rows, columns), np.float32)
    for k in range(len(viewer)):
        ratio = np.where(depth <= 1, distance[k] / (distance[k] + depth), 0).astype(np.float32)
        moved = warped_lines(ratio, epipole[k, 0], images.low[k, 0], images.step[k, 0], columns)
        warped[k] = warped_lines(moved.T, epipole[k, 1], images.low[k, 1], images.step[k, 1], rows).T
    return warped


def warped_lines(
    ratio: NDArray[np.float32], epipole: float, low: float, step: float, count: int
) -> NDArray[np.float32]:
    """Move the texels of lines along their lines toward the epipole, and interpolate between neighbours.

    Segments between two texels are drawn in an order in which what is in front comes last (McMillan 1997); those that
    show their back, and those that end where there is no surface, are left out.

    Parameters
    ----------
    ratio
        (n, m) λ of the texels of n lines, 0 where there is no surface.
    epipole
        The place that texels move toward, in texels from the first one of a line.
    low, step
        Place of the first texel of the result, and spacing of its texels, likewise.
    count
        Texels per line of the result.

    Returns
    -------
    NDArray[np.float32]
        (n, count) λ of the moved texels, 0 where there are none.
    """
    order = segment_order(ratio.shape[1], epipole)
    at_start, at_end = ratio[:, order].astype(np.float64), ratio[:, order + 1].astype(np.float64)
    start, end = epipole + (order - epipole) * at_start, epipole + (order + 1 - epipole) * at_end
    first = np.maximum(np.ceil((start - low) / step), 0).astype(np.int64)
    last = np.minimum(np.floor((end - low) / step), count - 1).astype(np.int64)
    texels = np.where((at_start > 0) & (at_end > 0), np.maximum(last - first + 1, 0), 0).ravel()
    segment = np.repeat(np.arange(texels.size), texels)
    within = np.arange(len(segment)) - np.repeat(np.cumsum(texels) - texels, texels)
    column = first.ravel()[segment] + within
    at_start, at_end, start, end = (values.ravel()[segment] for values in (at_start, at_end, start, end))
    part = np.clip((low + step * column - start) / np.maximum(end - start, 1e-300), 0, 1)
    warped = np.zeros((len(ratio), count), np.float32)
    warped[segment // len(order), column] = at_start + part * (at_end - at_start)  # the last of several wins
    return warped


def segment_order(numbers: int, epipole: float) -> NDArray[np.int64]:
    """Return the order in which the segments between the `numbers` texels of a line are drawn.

    They go from both ends of the line to the `epipole` (texels from the first one); the segment that contains it is the
    last. For texels move toward the epipole, and of two that meet, the one nearer to it is in front.
    """
    before, after = (int(np.clip(end, 0, numbers - 1)) for end in (np.floor(epipole), np.ceil(epipole)))
    from_left, from_right = np.arange(before), np.arange(numbers - 2, after - 1, -1)
    return np.concatenate([from_left, from_right, np.arange(before, after)])


def _epipoles(shape: tuple[int, int], viewer: Array) -> tuple[Array, Array]:
    """Return the points (n, 2) of the plane nearest to viewers, texels, and distances (n,) from it in depths."""
    return viewer[:, :2] * shape[::-1] - 0.5, np.maximum(-viewer[:, 2], _LEAST_DISTANCE)
