"""Compute the planes and tiles of impostors.

The reference is `render.impostors.warp_planes`, `frustum_crop`, `tile_mapping.screen_tiles` and `tile_placement`, which
calls them.
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
from depthwalk.render.kernels.outline_loops import crop_outline, cylinder_rectangle, hull_outline
from depthwalk.types import Array, Mask, Rows

_TOP, _SIDE = 0, 1  # of `bake.images.Face`


@compiled
def turned_axes(rotation: Array, matrix: Array) -> None:
    """Write the rotation matrix of a unit quaternion x, y, z, w into `matrix` (3, 3), for column vectors."""
    x, y, z, w = rotation[0], rotation[1], rotation[2], rotation[3]
    matrix[0, 0], matrix[0, 1], matrix[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    matrix[1, 0], matrix[1, 1], matrix[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


@compiled
def _product(a: Array, b: Array, product: Array) -> None:
    """Write the matrix product of `a` and `b` into `product`, (3, 3) all."""
    for i in range(3):
        for j in range(3):
            product[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@compiled
def warp_face(viewer: Array, radius: float, bottom: float, top: float, has_side: bool) -> tuple[int, float]:
    """Return the face in whose plane an object is warped, and the viewer's distance from it, metres.

    See `warp_planes.warp_faces`.
    """
    above, beside, below = viewer[1] - top, math.hypot(viewer[0], viewer[2]) - radius, bottom - viewer[1]
    if not has_side:
        beside = below = -np.inf
    face, distance = _TOP, above
    if beside > distance:
        face, distance = _SIDE, beside
    if below > distance:
        face, distance = 2, below
    return face, distance


@compiled
def _plane(viewer: Array, radius: float, bottom: float, top: float, has_side: bool, frame: Array) -> int:
    """Write the warp plane of an object to `frame` (5, 3), see `place`; return the number of its face."""
    x, y, z = viewer[0], viewer[1], viewer[2]
    face, distance = warp_face(viewer, radius, bottom, top, has_side)
    frame[:] = 0.0
    if face == _SIDE:
        rho = math.hypot(x, z)
        out_x, out_z = x / max(rho, 1e-12), z / max(rho, 1e-12)
        frame[0, 0], frame[0, 2], frame[1, 1] = out_z, -out_x, 1.0
        frame[2, 0], frame[2, 2] = out_x, out_z
    else:
        toward = -1.0 if face == _TOP else 1.0
        frame[0, 0], frame[1, 2], frame[2, 1] = 1.0, toward, -toward
    for axis in range(3):
        frame[3, axis] = x * frame[axis, 0] + y * frame[axis, 1] + z * frame[axis, 2]
    frame[4, 0], frame[4, 1] = distance, frame[3, 2] - distance
    return face


@compiled
def _screen_texels(
    camera: Array, distance: float, axis: int, tangent: float, size: float, low: int, factor: float, texel: Array
) -> None:
    """Write the rows of `axis` and of w of the homography `texel` (3, 3), see `tile_mapping.screen_tiles`.

    camera: (3, 3) camera from plane. distance: of the viewer from the plane. tangent, size: of the `View`, along the
    axis. low: the first pixel of the tile. factor: texels per pixel.
    """
    for j in range(3):
        away = -distance if j == 2 else 1.0
        sideways, forward = camera[axis, j] * away, camera[2, j] * away
        place_on_screen = (sideways / tangent + forward) * size / 2
        texel[axis, j] = (place_on_screen - low * forward) * factor
        texel[2, j] = forward


@compiled
def _depths_behind_side(hull: Array, radius: float, normal: Array) -> tuple[float, float]:
    """Return the least and greatest depth of an object behind a plane at its side, see `warp_planes.depths_behind`."""
    nearest, farthest = -radius, radius
    for k in range(len(hull)):
        along = hull[k, 0] * normal[0] + hull[k, 2] * normal[2]
        nearest, farthest = max(nearest, along), min(farthest, along)
    return radius - min(nearest, radius), radius - max(farthest, -radius)


@compiled_as_annotated
def place(
    number: Int64Array1,
    at: Int64Array1,
    viewer: Float64Array2,
    volume: Int32Array1,
    radius: Float64Array1,
    bottom: Float64Array1,
    top: Float64Array1,
    hull: Float64Array3,
    has_side: BoolArray1,
    rotation: Float32Array2,
    centre: Float32Array2,
    bounding_radius: Float32Array1,
    scale: Float32Array1,
    position: Float64Array1,
    axes: Float64Array2,
    tangent: Float64Array1,
    size: Float64Array1,
    near: float,
    guard: float,
    kept_guard: float,
    texels: float,
    detail_pixels: float,
    limit: int,
) -> tuple[Rows, Rows, Array, Array, Array, Array, Array, Rows, Array, Array, Mask, Array, Array]:
    """Find planes and tiles for those objects `number` that are in sight.

    Parameters
    ----------
    number : (k,) indices, among the m impostors below, of those to place.
    at, viewer : (m,) index of each impostor among the n objects below, and (m, 3) the viewer in its frame, metres.
    volume : (n,) index of each object's cylinder among those below.
    radius, bottom, top, hull, has_side : (v, …) cylinders, see `warp_planes.Volumes`.
    rotation, centre, bounding_radius, scale : (n, …) the objects and their bounding spheres.
    position, axes, tangent, size, detail_pixels : of the `View`; `tangent` is its `half_extent`.
    near : the near plane, metres.
    guard : the factor by which the picture is wider and higher than the view's.
    kept_guard : the same for the picture in which a cropped tile may be shown later.
    texels : texels per pixel.
    limit : the largest width and height of a tile, texels.

    Returns
    -------
    number (j,), face (j,), frame (j, 5, 3), bounds (j, 2, 2), diagonals (j, 4), texel (j, 3, 3), nearest (j,), size
    (j, 2), pixel (j, 2), depths (j, 2), whole (j,), density (j,) and frustum (j, 3, 3), see `Planes`, `Tiles` and
    `PlacedTiles`. The rows of a frame are right, up, normal; the epipole and, third, the viewer's place along the
    normal; the distance of the viewer and the offset. The rows of bounds are the low and the high corner.
    """
    count = len(number)
    kept, faces = np.empty(count, np.int64), np.empty(count, np.int64)
    frames, bounds, texel = np.empty((count, 5, 3)), np.empty((count, 2, 2)), np.empty((count, 3, 3))
    nearest, sizes, pixels = np.empty(count), np.empty((count, 2), np.int64), np.empty((count, 2))
    depths, wholes = np.empty((count, 2)), np.empty(count, np.bool_)
    density, frustum, diagonals = np.empty(count), np.empty((count, 3, 3)), np.empty((count, 4))
    corners, polygon, clipped = np.empty((hull.shape[1], 2)), np.empty((16, 2)), np.empty((16, 2))
    turned, to_object, camera, pixel = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((2, 2))
    found = 0
    for impostor in number:
        index = at[impostor]
        a = volume[index]
        frame, bound = frames[found], bounds[found]
        face = _plane(viewer[impostor], radius[a], bottom[a], top[a], has_side[a], frame)
        side, distance = face == _SIDE, frame[4, 0]
        cylinder_rectangle(radius[a], bottom[a], top[a], side, frame, distance, bound)
        edges = hull_outline(hull[a], frame, bound, corners, polygon, clipped)
        turned_axes(rotation[index], turned)
        _product(axes, turned, to_object)
        for i in range(3):
            for j in range(3):
                camera[i, j] = (
                    to_object[i, 0] * frame[j, 0] + to_object[i, 1] * frame[j, 1] + to_object[i, 2] * frame[j, 2]
                )
        ends = diagonals[found]
        seen = crop_outline(camera, distance, tangent, guard, size, polygon, clipped, edges, bound, ends, pixel)
        if not seen:
            continue
        for axis in range(2):
            low, high = math.floor(pixel[0, axis]), math.ceil(pixel[1, axis])
            factor = min(texels, limit / max(high - low, 1))
            _screen_texels(camera, distance, axis, tangent[axis], size[axis], low, factor, texel[found])
            sizes[found, axis] = min(max(math.ceil((high - low) * factor), 1), limit)
            pixels[found, axis] = low if factor == 1 else np.nan
        ahead, squared = 0.0, 0.0
        for axis in range(3):
            apart = centre[index, axis] - position[axis]
            ahead, squared = ahead + axes[2, axis] * apart, squared + apart * apart
        density[found] = detail_pixels * scale[index] / math.sqrt(squared)
        for j in range(3):
            frustum[found, 0, j] = to_object[0, j] / (tangent[0] * kept_guard)
            frustum[found, 1, j] = to_object[1, j] / (tangent[1] * kept_guard)
            frustum[found, 2, j] = to_object[2, j]
        nearest[found] = max(ahead - bounding_radius[index], near) / scale[index]
        depths[found, 0], depths[found, 1] = 0.0, top[a] - bottom[a]
        if side:
            depths[found, 0], depths[found, 1] = _depths_behind_side(hull[a], radius[a], frame[2])
        kept[found], faces[found], wholes[found] = impostor, face, seen == 2
        found += 1
    return (
        kept[:found],
        faces[:found],
        frames[:found],
        bounds[:found],
        diagonals[:found],
        texel[:found],
        nearest[:found],
        sizes[:found],
        pixels[:found],
        depths[:found],
        wholes[:found],
        density[:found],
        frustum[:found],
    )
