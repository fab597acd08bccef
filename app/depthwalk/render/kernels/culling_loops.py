"""Cull objects: by the frustum, and by the depth buffer. Cull meshlets likewise, and by the cones of their normals.

The reference is `Bounds.visible` with `SpatialCells.visible`, `render.culling.occlusion_test` and `Meshlets.seen`.
"""

import math

import numpy as np

from depthwalk.kernels.compilation import (
    Float32Array1,
    Float32Array2,
    Float32Picture,
    Float64Array1,
    Float64Array2,
    Int32Array1,
    Int64Array1,
    compiled,
    compiled_as_annotated,
)
from depthwalk.render.kernels.layout_loops import turned_axes
from depthwalk.types import Array, Mask, Rows


@compiled_as_annotated
def cells_in_sight(
    low: Float32Array2,
    high: Float32Array2,
    largest: Float32Array1,
    position: Float64Array1,
    axes: Float64Array2,
    tangent: Float64Array1,
    min_size: float,
) -> tuple[Rows, Array]:
    """Return the spatial cells that hold any object that a view may show, see `SpatialCells.batches`.

    Parameters
    ----------
    low, high : (c, 3) corners of the cells' boxes, metres, world.
    largest : (c,) the largest radius of an object in each, metres.
    position, axes, tangent : of the `View`; `tangent` is its `half_extent`.
    min_size : least radius of an object, over its distance from the viewer.

    Returns
    -------
    (k,) numbers of the cells, in their order, and (k,) metres along the view axis to the nearest corner of each.
    """
    planes = np.empty((5, 3))
    for axis in range(3):
        planes[0, axis] = axes[0, axis] - tangent[0] * axes[2, axis]
        planes[1, axis] = -axes[0, axis] - tangent[0] * axes[2, axis]
        planes[2, axis] = axes[1, axis] - tangent[1] * axes[2, axis]
        planes[3, axis] = -axes[1, axis] - tangent[1] * axes[2, axis]
        planes[4, axis] = -axes[2, axis]
    found, nearest_corner, count = np.empty(len(largest), np.int64), np.empty(len(largest)), 0
    for cell in range(len(largest)):
        inside, squared, corner = True, 0.0, 0.0
        for plane in range(5):
            nearest = 0.0  # how far outside the box's nearest corner is
            for axis in range(3):
                half, middle = (high[cell, axis] - low[cell, axis]) / 2, (high[cell, axis] + low[cell, axis]) / 2
                nearest += planes[plane, axis] * (middle - position[axis]) - abs(planes[plane, axis]) * half
            if nearest >= 0:
                inside = False
                break
        if not inside:
            continue
        for axis in range(3):
            gap = max(low[cell, axis] - position[axis], position[axis] - high[cell, axis], 0.0)
            squared += gap * gap
            half, middle = (high[cell, axis] - low[cell, axis]) / 2, (high[cell, axis] + low[cell, axis]) / 2
            corner += axes[2, axis] * (middle - position[axis]) - abs(axes[2, axis]) * half
        if largest[cell] >= min_size * math.sqrt(squared):
            found[count], nearest_corner[count] = cell, corner
            count += 1
    return found[:count], nearest_corner[:count]


@compiled
def _slants(tangent: Array, shear: Array) -> Array:
    """Return how far the sides of a frustum are from a sphere's centre where they touch it, (2, 2), over its radius."""
    slant = np.empty((2, 2))
    for axis in range(2):
        slant[axis, 0] = math.hypot(1, tangent[axis] - shear[axis])
        slant[axis, 1] = math.hypot(1, tangent[axis] + shear[axis])
    return slant


@compiled
def _is_between(
    x: float, y: float, z: float, ahead: float, reach: float, axes: Array, tangent: Array, slant: Array
) -> bool:
    """Return whether a sphere reaches between the sides of a frustum.

    x, y, z: its centre relative to the viewer, metres, world. ahead, reach: the same along the view axis, and its
    radius, metres. slant: see `_slants`.
    """
    for axis in range(2):
        sideways = axes[axis, 0] * x + axes[axis, 1] * y + axes[axis, 2] * z
        side = tangent[axis] * ahead
        if sideways - side >= reach * slant[axis, 0] or -sideways - side >= reach * slant[axis, 1]:
            return False
    return True


@compiled_as_annotated
def meshlets(
    centre: Float64Array2,
    radius: Float64Array1,
    axis: Float64Array2,
    sine: Float64Array1,
    origin: Float64Array1,
    rotation: Float64Array1,
    scale: float,
    axes: Float64Array2,
    tangent: Float64Array1,
    shear: Float64Array1,
    solid: bool,
) -> tuple[Rows, Array]:
    """Return the meshlets of an object that may be seen, see `Meshlets.seen`.

    Parameters
    ----------
    centre, radius, axis, sine : (m, …) of `Meshlets`.
    origin, rotation, scale : of the object, see `placed_records`.
    axes, tangent, shear : of the `View`: `axes`, `half_extent` and `shear`.
    solid : whether back faces cannot be seen.

    Returns
    -------
    (k,) rows of the meshlets, rising, and (k,) distances of their centres, metres along the view axis.
    """
    rows, forward, count = np.empty(len(radius), np.int64), np.empty(len(radius)), 0
    slant, turn, middle = _slants(tangent, shear), np.empty((3, 3)), np.empty(3)
    turned_axes(rotation, turn)
    for row in range(len(radius)):
        for j in range(3):
            turned = turn[j, 0] * centre[row, 0] + turn[j, 1] * centre[row, 1] + turn[j, 2] * centre[row, 2]
            middle[j] = origin[j] + scale * turned
        x, y, z, reach = middle[0], middle[1], middle[2], scale * radius[row]
        ahead = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
        if ahead <= -reach or not _is_between(x, y, z, ahead, reach, axes, tangent, slant):
            continue
        if solid:
            along, squared = 0.0, 0.0  # of the vector to the centre, in the object's frame
            for j in range(3):
                component = (turn[0, j] * x + turn[1, j] * y + turn[2, j] * z) / scale
                along += component * axis[row, j]
                squared += component * component
            if along >= sine[row] * math.sqrt(squared) + radius[row]:
                continue
        rows[count], forward[count] = row, ahead
        count += 1
    return rows[:count], forward[:count]


@compiled_as_annotated
def visible(
    centre: Float32Array2,
    radius: Float32Array1,
    order: Int32Array1,
    first: Int64Array1,
    cells: Int64Array1,
    position: Float64Array1,
    axes: Float64Array2,
    tangent: Float64Array1,
    shear: Float64Array1,
    min_size: float,
) -> tuple[Rows, Array]:
    """Return the objects of `cells` that a view may show, in the order of the cells.

    Parameters
    ----------
    centre, radius : (n, 3) and (n,) bounding spheres of all objects, metres, world.
    order, first : the rows of the objects, cell by cell, and where those of each cell begin, see `SpatialCells`.
    cells : (k,) numbers of the cells.
    position, axes, tangent, shear : of the `View`: `position`, `axes`, `half_extent` and `shear`.
    min_size : least radius of an object, over its distance from the viewer.

    Returns
    -------
    (m,) rows of the objects, and (m,) distances of their centres, metres along the view axis.
    """
    count = 0
    for cell in cells:
        count += first[cell + 1] - first[cell]
    rows, forward = np.empty(count, np.int64), np.empty(count)
    slant, found = _slants(tangent, shear), 0
    for cell in cells:
        for row in order[first[cell] : first[cell + 1]]:
            x, y, z = centre[row, 0] - position[0], centre[row, 1] - position[1], centre[row, 2] - position[2]
            reach = np.float64(radius[row])
            ahead = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
            if ahead <= -reach or not _is_between(x, y, z, ahead, reach, axes, tangent, slant):
                continue
            if min_size > 0 and reach < min_size * math.sqrt(x * x + y * y + z * z):
                continue
            rows[found], forward[found] = row, ahead
            found += 1
    return rows[:found], forward[:found]


@compiled_as_annotated
def boxes_about(rows: Int64Array1, centre: Float32Array2, radius: Float32Array1, size: int) -> tuple[Array, Array]:
    """Return the boxes around each run of `size` consecutive objects, see `spatial_cells`.

    Parameters
    ----------
    rows : (m,) rows of the objects.
    centre, radius : (n, 3) and (n,) bounding spheres of all objects, metres, world.
    size : how many objects a box holds.

    Returns
    -------
    (k, 3) least and (k, 3) greatest corners, float32, metres, world.
    """
    boxes = (len(rows) + size - 1) // size
    low, high = np.full((boxes, 3), np.inf, np.float32), np.full((boxes, 3), -np.inf, np.float32)
    for k in range(len(rows)):
        row, box = rows[k], k // size
        for axis in range(3):
            low[box, axis] = min(low[box, axis], centre[row, axis] - radius[row])
            high[box, axis] = max(high[box, axis], centre[row, axis] + radius[row])
    for box in range(boxes):  # rounding must not shrink the boxes
        for axis in range(3):
            low[box, axis] = np.nextafter(low[box, axis], np.float32(-np.inf))
            high[box, axis] = np.nextafter(high[box, axis], np.float32(np.inf))
    return low, high


@compiled_as_annotated
def upright_cylinders(
    rows: Int64Array1,
    centre: Float32Array2,
    rotation: Float32Array2,
    asset: Int32Array1,
    scale: Float32Array1,
    half_height: Float64Array1,
    radius: Float64Array1,
) -> tuple[Array, Array, Array, Array]:
    """Return the cylinders that enclose the objects `rows`, see `view.bounds.cylinders`.

    Parameters
    ----------
    rows : (m,) rows of the objects.
    centre, rotation, asset, scale : (n, …) of all objects: centres of the cylinders, metres, world; unit quaternions x,
        y, z, w; numbers of their assets; scales.
    half_height, radius : (a,) of the assets' cylinders, metres.

    Returns
    -------
    centre (m, 3), axis (m, 3), half height (m,) and radius (m,), float32, metres, world.
    """
    count = len(rows)
    middle, axis = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
    half, across = np.empty(count, np.float32), np.empty(count, np.float32)
    for k in range(count):
        row = rows[k]
        x, y, z, w = rotation[row, 0], rotation[row, 1], rotation[row, 2], rotation[row, 3]
        axis[k, 0], axis[k, 1], axis[k, 2] = 2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)
        middle[k, 0], middle[k, 1], middle[k, 2] = centre[row, 0], centre[row, 1], centre[row, 2]
        half[k], across[k] = half_height[asset[row]] * scale[row], radius[asset[row]] * scale[row]
    return middle, axis, half, across


@compiled
def _extent(half_height: float, radius: float, squared: float, along: float) -> float:
    """Return how far a cylinder reaches along a vector g. squared: g²; along: g·axis. See `occlusion_test`."""
    return half_height * abs(along) + radius * math.sqrt(max(squared - along * along, 0.0))


@compiled_as_annotated
def hidden(
    centre: Float32Array2,
    axis: Float32Array2,
    half_height: Float32Array1,
    radius: Float32Array1,
    farthest: Float32Picture,
    position: Float64Array1,
    axes: Float64Array2,
    tangent: Float64Array1,
    shear: Float64Array1,
    size: Float64Array1,
    near: float,
    far: float,
    side: float,
    margin: float,
    rounding: float,
) -> Mask:
    """Return which cylinders lie entirely behind the depth buffer.

    Parameters
    ----------
    centre, axis, half_height, radius : (n, …) the cylinders, see `view.bounds.Cylinders`.
    farthest : (rows, columns) greatest value of the depth buffer in each cell, row 0 at the bottom.
    position, axes, tangent, shear, size : of the `View`: `position`, `axes`, `half_extent`, `shear` and `size`.
    near, far : near and far plane, metres.
    side : width and height of a cell of `farthest`, pixels.
    margin : pixels by which the rectangles of the cylinders are widened on every side.
    rounding : largest error of values of the depth buffer.

    Returns
    -------
    (n,) whether each is hidden.
    """
    count = len(radius)
    found = np.zeros(count, np.bool_)
    nearer = margin * 2 * tangent[1] / size[1]
    last = np.array([farthest.shape[1] - 1, farthest.shape[0] - 1])
    low, high = np.empty(2, np.int64), np.empty(2, np.int64)
    for k in range(count):
        x, y, z = centre[k, 0] - position[0], centre[k, 1] - position[1], centre[k, 2] - position[2]
        forward = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
        along_z = axes[2, 0] * axis[k, 0] + axes[2, 1] * axis[k, 1] + axes[2, 2] * axis[k, 2]
        nearest = forward - _extent(half_height[k], radius[k], 1.0, along_z)
        nearest -= nearest * nearer
        if nearest <= near:
            continue
        for j in range(2):
            t = (axes[j, 0] * x + axes[j, 1] * y + axes[j, 2] * z) / forward
            along = axes[j, 0] * axis[k, 0] + axes[j, 1] * axis[k, 1] + axes[j, 2] * axis[k, 2]
            reach = _extent(half_height[k], radius[k], 1 + (t - shear[j]) ** 2, along - t * along_z) / nearest
            middle, half = (t / tangent[j] + 1) * size[j] / 2, reach * size[j] / (2 * tangent[j]) + margin
            low[j] = int(min(max((middle - half) / side, 0.0), last[j]))
            high[j] = int(min(max((middle + half) / side, 0.0), last[j]))
        # In single precision, as the cells are, so that several are compared by one instruction.
        depth = np.float32(far / (far - near) * (1 - near / nearest) - rounding)
        behind = True
        for row in range(low[1], high[1] + 1):
            for column in range(low[0], high[0] + 1):
                behind &= depth > farthest[row, column]
            if not behind:
                break
        found[k] = behind
    return found
