"""Bound the reprojection error of cached impostor tiles.

The reference is `render.impostors.reprojection_error`, and `TileScheduler`, which calls it.
"""

import math

import numpy as np

from depthwalk.kernels.compilation import (
    BoolArray1,
    Float32Array1,
    Float32Array2,
    Float64Array1,
    Float64Array2,
    Float64Array3,
    Int32Array1,
    Int64Array1,
    compiled,
    compiled_as_annotated,
)
from depthwalk.render.kernels.layout_loops import turned_axes
from depthwalk.types import Array


@compiled
def _parallax(record: Array, viewer: Array, focal_pixels: float) -> float:
    """Return a bound on the displacement of any point of an object on the screen, pixels; see `parallax`.

    record: (49,), a COMPOSITE_RECORD: rows right, up, normal, high, origin of four numbers come first.
    """
    distance = np.float64(record[11])
    x, y, z = viewer[0] - record[16], viewer[1] - record[17], viewer[2] - record[18]
    ahead = x * record[8] + y * record[9] + z * record[10]
    if distance + ahead <= 1e-3 * distance:
        return np.inf
    distance_now = distance + ahead
    ratio, kappa = distance / distance_now, -ahead / distance
    nearest, farthest = np.float64(record[14]), np.float64(record[15])
    stretch_near, stretch_far = nearest + (1 - nearest) * ratio, farthest + (1 - farthest) * ratio
    middle = (nearest + farthest) / 2
    across, gaps = 0.0, 0.0
    for axis in range(2):
        delta = x * record[4 * axis] + y * record[4 * axis + 1] + z * record[4 * axis + 2]
        low, high = np.float64(record[4 * axis + 3]), np.float64(record[12 + axis])
        across += max(abs(delta - kappa * low), abs(delta - kappa * high)) ** 2
        low_near = (low + (1 - nearest) * ratio * delta) / stretch_near - delta
        low_far = (low + (1 - farthest) * ratio * delta) / stretch_far - delta
        high_near = (high + (1 - nearest) * ratio * delta) / stretch_near - delta
        high_far = (high + (1 - farthest) * ratio * delta) / stretch_far - delta
        gaps += max(min(low_near, low_far), -max(high_near, high_far), 0.0) ** 2
    stretch = min(stretch_near, stretch_far) * (middle + (1 - middle) * ratio)
    apart = (nearest - farthest) / 2 * ratio * math.sqrt(across) / stretch
    return float(focal_pixels * apart / math.sqrt(distance_now * distance_now + gaps))


@compiled
def _covers(
    record: Array, frustum: Array, viewer: Array, turned: Array, ray_from_screen: Array, low: float, high: float
) -> bool:
    """Return whether a tile holds everything that the view sees between two depths; see `covers_view`."""
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.0):
            for depth in (low, high):
                a = b = c = 0.0
                for j in range(3):
                    along = 0.0
                    for i in range(3):
                        ray = ray_from_screen[i, 0] * x + ray_from_screen[i, 1] * y + ray_from_screen[i, 2]
                        along += ray * turned[i, j]
                    corner = along * depth + viewer[j] - record[16 + j]
                    a, b, c = a + frustum[0, j] * corner, b + frustum[1, j] * corner, c + frustum[2, j] * corner
                if abs(a) > c or abs(b) > c:
                    return False
    return True


@compiled_as_annotated
def errors(
    row: Int32Array1,
    record: Float32Array2,
    density: Float64Array1,
    frustum: Float64Array3,
    whole: BoolArray1,
    tile_pieces: Int64Array1,
    provisional: BoolArray1,
    at: Int64Array1,
    viewer: Float64Array2,
    pieces: Int64Array1,
    rotation: Float32Array2,
    centre: Float32Array2,
    bounding_radius: Float32Array1,
    scale: Float32Array1,
    position: Float64Array1,
    axes: Float64Array2,
    ray_from_screen: Float64Array2,
    detail_pixels: float,
    reuse_error: float,
    coarser: float,
    lacking: float,
    limited: bool,
) -> Array:
    """Return the reprojection errors of the tiles of impostors; see `TileScheduler._errors`.

    Parameters
    ----------
    row : (m,) index of each impostor's tile among the cached tiles; −1 for none.
    record, density, frustum, whole, tile_pieces, provisional : (t, …) the cached tiles, see `CachedTiles`; `record` as
        (t, 49) numbers.
    at, viewer, pieces : (m, …) the impostors, see `ImpostorObjects`.
    rotation, centre, bounding_radius, scale : (n, …) the objects that `at` refers to.
    position, axes, ray_from_screen, detail_pixels : of the `View`.
    reuse_error : pixels that count as an error of 1.
    coarser : pixels per texel, or texels per pixel, that count as an error of 1.
    lacking : the error of a tile that lacks pieces, or is provisional.
    limited : whether provisional tiles may stay in use.

    Returns
    -------
    (m,) reprojection errors, 1 where as large as allowed; inf where the tile cannot be used.
    """
    count = len(row)
    error, turned = np.full(count, np.inf), np.empty((3, 3))
    for k in range(count):
        tile = row[k]
        if tile < 0 or (provisional[tile] and not limited):
            continue
        o = at[k]
        x, y, z = centre[o, 0] - position[0], centre[o, 1] - position[1], centre[o, 2] - position[2]
        if not whole[tile]:
            forward = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
            low, high = max(forward - bounding_radius[o], 0.0) / scale[o], (forward + bounding_radius[o]) / scale[o]
            turned_axes(rotation[o], turned)
            if not _covers(record[tile], frustum[tile], viewer[k], turned, ray_from_screen, low, high):
                continue
        target = detail_pixels * scale[o] / math.sqrt(x * x + y * y + z * z)
        coarseness = abs(math.log(target / density[tile])) / math.log(coarser)
        error[k] = max(_parallax(record[tile], viewer[k], detail_pixels) / reuse_error, coarseness)
        if provisional[tile] or pieces[k] & ~tile_pieces[tile]:
            error[k] = max(error[k], lacking)
    return error
