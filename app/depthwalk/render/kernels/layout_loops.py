"""Compute the planes and tiles of impostors.

The reference is `render.impostors.warp_planes`, `tile_mapping.screen_tiles` and `tile_placement`, which calls them.
"""

import math

import numpy as np

from depthwalk.kernels.compilation import compiled
from depthwalk.types import Array, Mask, Rows

_TOP, _SIDE = 0, 1  # of `bake.images.Face`


@compiled()
def turned_axes(rotation: Array, matrix: Array) -> None:
    """Write the rotation matrix of a unit quaternion x, y, z, w into `matrix` (3, 3), for column vectors."""
    x, y, z, w = rotation[0], rotation[1], rotation[2], rotation[3]
    matrix[0, 0], matrix[0, 1], matrix[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    matrix[1, 0], matrix[1, 1], matrix[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


@compiled()
def _product(a: Array, b: Array, product: Array) -> None:
    """Write the matrix product of `a` and `b` into `product`, (3, 3) all."""
    for i in range(3):
        for j in range(3):
            product[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@compiled()
def _support(footprint: Array, x: float, z: float) -> float:
    """Return how far an object reaches along the unit vector (x, z), see `geometry.support_function.support`."""
    directions = len(footprint)
    step = 2 * math.pi / directions
    turn = math.atan2(z, x) / step
    before = math.floor(turn)
    first, part = int(before), turn - before
    one, other = footprint[first % directions], footprint[(first + 1) % directions]
    return float(math.sin((1 - part) * step) * one + math.sin(part * step) * other) / math.sin(step)


@compiled()
def _rectangle(
    footprint: Array, radius: float, bottom: float, top: float, side: bool, frame: Array, distance: float, bound: Array
) -> None:
    """Write the rectangle of an object's warped samples, its low and high corner from the epipole, to `bound` (2, 2).

    frame: (5, 3), see `place`. See `warp_planes._rectangles`.
    """
    distance = max(distance, 1e-9)
    far = distance / (distance + (2 * radius if side else top - bottom))
    for axis in range(2):
        x, z, epipole = frame[axis, 0], frame[axis, 2], frame[3, axis]
        if side and axis == 1:
            first, last = bottom, top
        else:
            first, last = -_support(footprint, -x, -z), _support(footprint, x, z)
        low, high = min(first, epipole + far * (first - epipole)), max(last, epipole + far * (last - epipole))
        if side and axis == 0:
            silhouette = radius * math.sqrt(far)
            low, high = max(low, -silhouette), min(high, silhouette)
        bound[0, axis], bound[1, axis] = low - epipole, high - epipole


@compiled()
def _clipped(polygon: Array, count: int, a: float, b: float, c: float, clipped: Array) -> int:
    """Clip a convex polygon to a·s + b·v + c ≥ 0; write the corners to `clipped`, and return their number.

    polygon: its first `count` rows are the corners (s, v). See Sutherland and Hodgman 1974.
    """
    kept = 0
    for k in range(count):
        before = k - 1 if k else count - 1
        s, v, last_s, last_v = polygon[k, 0], polygon[k, 1], polygon[before, 0], polygon[before, 1]
        now, last = a * s + b * v + c, a * last_s + b * last_v + c
        if (now >= 0) != (last >= 0):
            part = last / (last - now)
            clipped[kept, 0], clipped[kept, 1] = last_s + part * (s - last_s), last_v + part * (v - last_v)
            kept += 1
        if now >= 0:
            clipped[kept, 0], clipped[kept, 1] = s, v
            kept += 1
    return kept


@compiled()
def _seen_rectangle(
    camera: Array, distance: float, tangent: Array, guard: float, size: Array, bound: Array, pixel: Array
) -> int:
    """Crop a rectangle on a plane to what the camera sees; see `warp_planes.crop_to_frustum`.

    Parameters
    ----------
    camera : (3, 3) from plane coordinates (s, v, −distance) to camera coordinates.
    distance : the viewer's distance to the plane, metres.
    tangent, size : of the `View`: `half_extent` and `size`.
    guard : the factor by which the picture is wider and higher than the view's.
    bound : (2, 2) low and high corner, which are replaced by those of the visible part.
    pixel : (2, 2) receives the bounds of that part on the screen, low and high, pixels.

    Returns
    -------
    2 if the whole rectangle is visible, 1 if a part is, 0 if nothing is.
    """
    polygon, clipped = np.empty((12, 2)), np.empty((12, 2))
    for k in range(4):
        polygon[k, 0], polygon[k, 1] = bound[1 if k in (1, 2) else 0, 0], bound[k // 2, 1]
    count, whole = 4, True
    for axis in range(2):
        wide = guard * tangent[axis]
        for way in (-1.0, 1.0):
            a, b = wide * camera[2, 0] + way * camera[axis, 0], wide * camera[2, 1] + way * camera[axis, 1]
            c = -distance * (wide * camera[2, 2] + way * camera[axis, 2])
            inside = True
            for k in range(count):
                inside &= a * polygon[k, 0] + b * polygon[k, 1] + c >= 0
            if not inside:
                whole = False
                count = _clipped(polygon, count, a, b, c, clipped)
                polygon, clipped = clipped, polygon
    if not count:
        return 0
    pixel[0], pixel[1] = np.inf, -np.inf
    seen_low, seen_high = np.full(2, np.inf), np.full(2, -np.inf)
    for k in range(count):
        s, v = polygon[k, 0], polygon[k, 1]
        forward = max(camera[2, 0] * s + camera[2, 1] * v - camera[2, 2] * distance, 1e-9)
        for axis in range(2):
            sideways = camera[axis, 0] * s + camera[axis, 1] * v - camera[axis, 2] * distance
            place = min(max(sideways / (tangent[axis] * forward), -guard), guard)
            pixels = (place + 1) / 2 * size[axis]
            pixel[0, axis], pixel[1, axis] = min(pixel[0, axis], pixels), max(pixel[1, axis], pixels)
            seen_low[axis] = min(seen_low[axis], polygon[k, axis])
            seen_high[axis] = max(seen_high[axis], polygon[k, axis])
    if not whole:
        bound[0], bound[1] = seen_low, seen_high
    return 2 if whole else int(bound[1, 0] > bound[0, 0] and bound[1, 1] > bound[0, 1])


@compiled()
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


@compiled()
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


@compiled("I1 I1 D2 N1 D1 D1 D1 D2 B1 F2 F2 F1 F1 D1 D2 D1 D1 f f f f f i")
def place(
    number: Rows,
    at: Rows,
    viewer: Array,
    volume: Rows,
    radius: Array,
    bottom: Array,
    top: Array,
    footprint: Array,
    has_side: Mask,
    rotation: Array,
    centre: Array,
    bounding_radius: Array,
    scale: Array,
    position: Array,
    axes: Array,
    tangent: Array,
    size: Array,
    near: float,
    guard: float,
    kept_guard: float,
    texels: float,
    detail_pixels: float,
    limit: int,
) -> tuple[Rows, Rows, Array, Array, Array, Array, Rows, Array, Array, Mask, Array, Array]:
    """Find planes and tiles for those objects `number` that are in sight.

    Parameters
    ----------
    number : (k,) indices, among the m impostors below, of those to place.
    at, viewer : (m,) index of each impostor among the n objects below, and (m, 3) the viewer in its frame, metres.
    volume : (n,) index of each object's cylinder among those below.
    radius, bottom, top, footprint, has_side : (v, …) cylinders, see `warp_planes.Volumes`.
    rotation, centre, bounding_radius, scale : (n, …) the objects and their bounding spheres.
    position, axes, tangent, size, detail_pixels : of the `View`; `tangent` is its `half_extent`.
    near : the near plane, metres.
    guard : the factor by which the picture is wider and higher than the view's.
    kept_guard : the same for the picture in which a cropped tile may be shown later.
    texels : texels per pixel.
    limit : the largest width and height of a tile, texels.

    Returns
    -------
    number (j,), face (j,), frame (j, 5, 3), bounds (j, 2, 2), texel (j, 3, 3), nearest (j,), size (j, 2), pixel (j, 2),
    depths (j, 2), whole (j,), density (j,) and frustum (j, 3, 3), see `Planes`, `Tiles` and `PlacedTiles`. The rows
    of a frame are right, up, normal; the epipole and, third, the viewer's place along the normal; the distance of the
    viewer and the offset. The rows of bounds are the low and the high corner.
    """
    count = len(number)
    kept, faces = np.empty(count, np.int64), np.empty(count, np.int64)
    frames, bounds, texel = np.empty((count, 5, 3)), np.empty((count, 2, 2)), np.empty((count, 3, 3))
    nearest, sizes, pixels = np.empty(count), np.empty((count, 2), np.int64), np.empty((count, 2))
    depths, wholes = np.empty((count, 2)), np.empty(count, np.bool_)
    density, frustum = np.empty(count), np.empty((count, 3, 3))
    turned, to_object, camera, pixel = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((2, 2))
    found = 0
    for impostor in number:
        index = at[impostor]
        a = volume[index]
        frame, bound = frames[found], bounds[found]
        face = _plane(viewer[impostor], radius[a], bottom[a], top[a], has_side[a], frame)
        side, distance = face == _SIDE, frame[4, 0]
        _rectangle(footprint[a], radius[a], bottom[a], top[a], side, frame, distance, bound)
        turned_axes(rotation[index], turned)
        _product(axes, turned, to_object)
        for i in range(3):
            for j in range(3):
                camera[i, j] = (
                    to_object[i, 0] * frame[j, 0] + to_object[i, 1] * frame[j, 1] + to_object[i, 2] * frame[j, 2]
                )
        seen = _seen_rectangle(camera, distance, tangent, guard, size, bound, pixel)
        if not seen:
            continue
        for axis in range(2):
            low, high = math.floor(pixel[0, axis]), math.ceil(pixel[1, axis])
            factor = min(texels, limit / max(high - low, 1))
            for j in range(3):
                away = -distance if j == 2 else 1.0
                sideways, forward = camera[axis, j] * away, camera[2, j] * away
                place_on_screen = (sideways / tangent[axis] + forward) * size[axis] / 2
                texel[found, axis, j] = (place_on_screen - low * forward) * factor
                texel[found, 2, j] = forward
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
            x, z = frame[2, 0], frame[2, 2]
            depths[found, 0] = radius[a] - min(_support(footprint[a], x, z), radius[a])
            depths[found, 1] = radius[a] + min(_support(footprint[a], -x, -z), radius[a])
        kept[found], faces[found], wholes[found] = impostor, face, seen == 2
        found += 1
    return (
        kept[:found],
        faces[:found],
        frames[:found],
        bounds[:found],
        texel[:found],
        nearest[:found],
        sizes[:found],
        pixels[:found],
        depths[:found],
        wholes[:found],
        density[:found],
        frustum[:found],
    )
