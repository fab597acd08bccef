"""Allocate slots of the atlas, and write the records of impostor tiles that the shaders read.

The reference is `render.impostors.atlas_allocator` and `tile_records`.
"""

import numpy as np

from depthwalk.kernels.compilation import (
    Float32Array1,
    Float32Array2,
    Float64Array1,
    Float64Array2,
    Float64Array3,
    Int32Array1,
    Int64Array1,
    Int64Array2,
    compiled,
    compiled_as_annotated,
)
from depthwalk.types import Array, Mask, Rows


@compiled_as_annotated
def warp_records(
    right: Float64Array2,
    up: Float64Array2,
    normal: Float64Array2,
    epipole: Float64Array2,
    offset: Float64Array1,
    distance: Float64Array1,
    texel: Float64Array3,
    nearest: Float64Array1,
    size: Int64Array2,
    corner: Int64Array2,
    width: float,
    height: float,
    rotation: Float32Array2,
) -> Array:
    """Return the records of n tiles for pass 1, see `tile_records.warp_records`.

    Parameters
    ----------
    right, up, normal, epipole, offset, distance : (n, …) see `Planes`.
    texel, nearest, size : (n, …) see `Tiles`.
    corner : (n, 2) where the tiles lie in the atlas, texels.
    width, height : size of the atlas, texels.
    rotation : (n, 4) unit quaternions (x, y, z, w) of the objects.

    Returns
    -------
    (n, 32) float32, a WARP_RECORD each.
    """
    count, atlas = len(nearest), (width, height)
    record = np.zeros((count, 32), np.float32)
    for k in range(count):
        for j in range(3):
            record[k, j], record[k, 4 + j], record[k, 8 + j] = right[k, j], up[k, j], normal[k, j]
            w = texel[k, 2, j]
            for axis in range(2):
                record[k, 15 + 3 * axis + j] = 2 * (texel[k, axis, j] + corner[k, axis] * w) / atlas[axis] - w
            record[k, 21 + j] = w
        record[k, 3], record[k, 7], record[k, 11] = epipole[k, 0], epipole[k, 1], offset[k]
        record[k, 12], record[k, 13] = distance[k], nearest[k]
        for axis in range(2):
            low = corner[k, axis]
            record[k, 24 + axis] = 2 * low / atlas[axis] - 1
            record[k, 26 + axis] = 2 * (low + size[k, axis]) / atlas[axis] - 1
        for j in range(4):
            record[k, 28 + j] = rotation[k, j]
    return record


@compiled_as_annotated
def tile_records(
    viewer: Float64Array2,
    right: Float64Array2,
    up: Float64Array2,
    normal: Float64Array2,
    distance: Float64Array1,
    low: Float64Array2,
    high: Float64Array2,
    diagonals: Float64Array2,
    depths: Float64Array2,
    texel: Float64Array3,
    nearest: Float64Array1,
    size: Int64Array2,
    pixel: Float64Array2,
    corner: Int64Array2,
) -> Array:
    """Return the records of n tiles for pass 2, see `tile_records.tile_records`.

    Parameters
    ----------
    viewer : (n, 3) the viewer that the tiles are warped for, in the objects' frames, metres.
    right, up, normal, distance, low, high, diagonals : (n, …) see `Planes`.
    depths : (n, 2) least and greatest depth of each object behind its plane, metres.
    texel, nearest, size, pixel : (n, …) see `Tiles`.
    corner : (n, 2) where the tiles lie in the atlas, texels.

    Returns
    -------
    (n, 49) float32, a COMPOSITE_RECORD each, without the fields that `place_tiles` adds.
    """
    count = len(nearest)
    record = np.zeros((count, 49), np.float32)
    for k in range(count):
        for j in range(3):
            record[k, j], record[k, 4 + j], record[k, 8 + j] = right[k, j], up[k, j], normal[k, j]
            record[k, 16 + j] = viewer[k, j]
            for axis in range(3):
                record[k, 20 + 3 * axis + j] = texel[k, axis, j]
        record[k, 3], record[k, 7], record[k, 11], record[k, 19] = low[k, 0], low[k, 1], distance[k], nearest[k]
        for j in range(4):
            record[k, 33 + j] = diagonals[k, j]
        for axis in range(2):
            record[k, 12 + axis] = high[k, axis]
            record[k, 14 + axis] = distance[k] / (distance[k] + depths[k, axis])
            record[k, 29 + axis], record[k, 31 + axis] = corner[k, axis], size[k, axis]
            record[k, 45 + axis] = pixel[k, axis]
    return record


@compiled_as_annotated
def composite_records(
    cached: Float32Array2,
    row: Int32Array1,
    viewer: Float64Array2,
    scale: Float32Array1,
    rotation: Float32Array2,
    at: Int64Array1,
) -> Array:
    """Return the records by which pass 2 draws tiles where their objects are now, see `tile_records.place_tiles`.

    Parameters
    ----------
    cached : (t, 49) the records of all cached tiles.
    row : (d,) indices of those to draw.
    viewer : (d, 3) the viewer in the frames of the objects that they show, metres.
    scale, rotation : (n, …) objects.
    at : (d,) index of the object that each tile shows.

    Returns
    -------
    (d, 49) float32, a COMPOSITE_RECORD each.
    """
    count = len(row)
    record = np.empty((count, 49), np.float32)
    for k in range(count):
        number = at[k]
        for j in range(49):
            record[k, j] = cached[row[k], j]
        for j in range(3):
            record[k, 37 + j] = viewer[k, j]
        record[k, 40] = scale[number]
        for j in range(4):
            record[k, 41 + j] = rotation[number, j]
        record[k, 47], record[k, 48] = k, 1.0
    return record


@compiled
def _write(rectangles: Rows, row: int, x: int, y: int, width: int, height: int) -> None:
    """Write a row of rectangles (n, 4)."""
    rectangles[row, 0], rectangles[row, 1], rectangles[row, 2], rectangles[row, 3] = x, y, width, height


@compiled
def _copy(source: Rows, row: int, target: Rows, target_row: int) -> None:
    """Copy a row of rectangles (n, 4) to a row of others."""
    _write(target, target_row, source[row, 0], source[row, 1], source[row, 2], source[row, 3])


@compiled
def _merged(free: Rows, axis: int) -> Rows:
    """Merge rectangles (n, 4) that touch end to end along `axis`, 0 or 1, see `atlas_allocator`."""
    key = (free[:, 1 - axis] << 40) + (free[:, 3 - axis] << 20) + free[:, axis]
    merged, count = np.empty_like(free), 0
    for k in np.argsort(key):
        last = merged[count - 1]
        if (
            count
            and last[1 - axis] == free[k, 1 - axis]
            and last[3 - axis] == free[k, 3 - axis]
            and last[axis] + last[2 + axis] == free[k, axis]
        ):
            last[2 + axis] += free[k, 2 + axis]
        else:
            _copy(free, k, merged, count)
            count += 1
    return merged[:count]


@compiled_as_annotated
def released(free: Int64Array2, slots: Int64Array2) -> Rows:
    """Return the free rectangles of an atlas after slots are released, see `Atlas.release`.

    Parameters
    ----------
    free : (f, 4) free rectangles before: x, y, width, height, texels.
    slots : (n, 4) slots to release.

    Returns
    -------
    (g, 4) free rectangles.
    """
    joined, count = np.empty((len(free) + len(slots), 4), np.int64), 0
    for rectangles in (free, slots):
        for k in range(len(rectangles)):
            if rectangles[k, 2] > 0 and rectangles[k, 3] > 0:
                _copy(rectangles, k, joined, count)
                count += 1
    merged: Rows = joined[:count]
    for axis in range(2):  # not `_merged(…, 0)` and `_merged(…, 1)`, each of which numba would compile
        merged = _merged(merged, axis)
    return merged


@compiled_as_annotated
def areas(row: Int32Array1, slot: Int64Array2) -> Array:
    """Return the texels (m,) of the slots (t, 4) in the rows `row` (m,), 0 where that is −1, see `TileCache.areas`."""
    area = np.zeros(len(row))
    for k in range(len(row)):
        if row[k] >= 0:
            area[k] = slot[row[k], 2] * slot[row[k], 3]
    return area


@compiled_as_annotated
def kept_slots(row: Int32Array1, slot: Int64Array2, sizes: Int64Array2) -> tuple[Rows, Rows, Mask]:
    """Return which tiles may stay in their slots, see `tile_cache.kept_slots`.

    Parameters
    ----------
    row : (n,) row in `slot` of the slot that the object of each tile has, −1 for none.
    slot : (t, 4) slots, x, y, width, height, texels.
    sizes : (n, 2) width and height of the tiles, texels.

    Returns
    -------
    (n, 4) slots that the objects have, 0 for none, (n, 2) sizes of new slots, and (n,) whether each tile stays.
    """
    had, padded = np.zeros((len(row), 4), np.int64), np.empty_like(sizes)
    stays = np.zeros(len(row), np.bool_)
    for k in range(len(row)):
        for axis in range(2):
            step = 1
            while 16 * step <= sizes[k, axis]:
                step *= 2
            padded[k, axis] = -(-sizes[k, axis] // step) * step
        if row[k] < 0:
            continue
        _copy(slot, row[k], had, k)
        width, height = had[k, 2], had[k, 3]
        fits = width >= sizes[k, 0] and height >= sizes[k, 1]
        stays[k] = fits and width * height <= 2 * padded[k, 0] * padded[k, 1]
    return had, padded, stays


@compiled_as_annotated
def allocate(free: Int64Array2, sizes: Int64Array2) -> tuple[Rows, Rows, int]:
    """Allocate slots of an atlas one after the other, until one does not fit, see `Atlas.allocate`.

    Parameters
    ----------
    free : (f, 4) free rectangles: x, y, width, height, texels.
    sizes : (n, 2) width and height of the tiles, texels.

    Returns
    -------
    The slots (n, 4), the free rectangles that are left (g, 4), and how many slots were allocated.
    """
    count = len(free)
    left, slots = np.empty((count + len(sizes), 4), np.int64), np.zeros((len(sizes), 4), np.int64)
    for k in range(count):
        _copy(free, k, left, k)
    for k in range(len(sizes)):
        width, height = sizes[k, 0], sizes[k, 1]
        best, snug = -1, 0
        for j in range(count):
            wide, high = left[j, 2] - width, left[j, 3] - height
            if wide >= 0 and high >= 0 and (best < 0 or min(wide, high) < snug):
                best, snug = j, min(wide, high)
        if best < 0:
            return slots, left[:count], k
        x, y, wide, high = left[best]
        _write(slots, k, x, y, width, height)
        if wide - width > high - height:  # cut the remaining L so that its larger part stays whole
            _write(left, best, x + width, y, wide - width, high)
            rest = x, y + height, width, high - height
        else:
            _write(left, best, x, y + height, wide, high - height)
            rest = x + width, y, wide - width, height
        if rest[2] * rest[3]:
            _write(left, count, *rest)
            count += 1
    return slots, left[:count], len(sizes)
