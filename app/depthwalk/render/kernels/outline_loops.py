"""Compute the outlines of impostors on their planes, and crop them to what the camera sees.

The reference is `render.impostors.warp_planes` and `frustum_crop`. `frame` (5, 3) is a plane, see `layout_loops.place`.
"""

import math

import numpy as np

from depthwalk.kernels.compilation import compiled
from depthwalk.types import Array

_NEAREST_CORNER = 0.25  # of `warp_planes`


@compiled
def cylinder_rectangle(
    radius: float, bottom: float, top: float, side: bool, frame: Array, distance: float, bound: Array
) -> None:
    """Write the rectangle that a cylinder's warped points fill, its low and high corner from the epipole, to `bound`.

    frame: (5, 3), see `place`; bound: (2, 2). See `warp_planes._rectangles`.
    """
    distance = max(distance, 1e-9)
    far = distance / (distance + (2 * radius if side else top - bottom))
    for axis in range(2):
        epipole, first, last = frame[3, axis], -radius, radius
        if side and axis == 1:
            first, last = bottom, top
        low, high = first - epipole, last - epipole
        low, high = min(low, far * low), max(high, far * high)
        if side and axis == 0:
            silhouette = radius * math.sqrt(far)
            low, high = max(low, -silhouette - epipole), min(high, silhouette - epipole)
        bound[0, axis], bound[1, axis] = low, high


@compiled
def _seen_hull(hull: Array, frame: Array, seen: Array) -> bool:
    """Write where the corners (k, 3) of a hull are seen on the plane, from the epipole, to `seen` (k, 2).

    Returns whether all corners are well in front of the viewer. frame: (5, 3), see `place`. See
    `warp_planes._outlines`.
    """
    distance = frame[4, 0]
    if distance <= 0:
        return False
    for k in range(len(hull)):
        x, y, z = hull[k, 0], hull[k, 1], hull[k, 2]
        ahead = frame[3, 2] - (x * frame[2, 0] + y * frame[2, 1] + z * frame[2, 2])
        if ahead <= _NEAREST_CORNER * distance:
            return False
        for axis in range(2):
            along = x * frame[axis, 0] + y * frame[axis, 1] + z * frame[axis, 2]
            seen[k, axis] = distance / ahead * (along - frame[3, axis])
    return True


@compiled
def _diagonals(points: Array, count: int, diagonals: Array) -> None:
    """Write to `diagonals` (4,) those of the least outline that holds the first `count` of `points` (k, 2).

    See `Planes.diagonals`.
    """
    diagonals[0], diagonals[1], diagonals[2], diagonals[3] = np.inf, -np.inf, np.inf, -np.inf
    for k in range(count):
        s, v = points[k, 0], points[k, 1]
        diagonals[0], diagonals[1] = min(diagonals[0], s + v), max(diagonals[1], s + v)
        diagonals[2], diagonals[3] = min(diagonals[2], s - v), max(diagonals[3], s - v)


@compiled
def hull_outline(hull: Array, frame: Array, bound: Array, seen: Array, polygon: Array, clipped: Array) -> int:
    """Write the corners of an object's outline on its plane to `polygon`; return their number, up to 8.

    frame: (5, 3), see `place`; bound: (2, 2) the rectangle of its cylinder; seen, clipped: memory for intermediate
    results, as long as hull and `polygon`. See `warp_planes._outlines`.
    """
    usable = _seen_hull(hull, frame, seen)
    if usable:
        for axis in range(2):
            low, high = np.inf, -np.inf
            for k in range(len(hull)):
                low, high = min(low, seen[k, axis]), max(high, seen[k, axis])
            bound[0, axis], bound[1, axis] = max(bound[0, axis], low), min(bound[1, axis], high)
    for k in range(4):
        polygon[k, 0], polygon[k, 1] = bound[1 if k in (1, 2) else 0, 0], bound[k // 2, 1]
    if not usable:
        return 4
    diagonals = np.empty(4)
    _diagonals(seen, len(hull), diagonals)
    count = 4
    for k in range(4):
        inward, across = (1.0 if k % 2 == 0 else -1.0), (1.0 if k < 2 else -1.0)
        count = _clipped(polygon, count, inward, inward * across, -inward * diagonals[k], clipped)
        for row in range(count):
            polygon[row, 0], polygon[row, 1] = clipped[row, 0], clipped[row, 1]
    return count


@compiled
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


@compiled
def crop_outline(
    camera: Array,
    distance: float,
    tangent: Array,
    guard: float,
    size: Array,
    polygon: Array,
    clipped: Array,
    count: int,
    bound: Array,
    diagonals: Array,
    pixel: Array,
) -> int:
    """Crop an outline on a plane to what the camera sees; see `frustum_crop.crop_to_frustum`.

    Parameters
    ----------
    camera : (3, 3) from plane coordinates (s, v, −distance) to camera coordinates.
    distance : the viewer's distance to the plane, metres.
    tangent, size : of the `View`: `half_extent` and `size`.
    guard : the factor by which the picture is wider and higher than the view's.
    polygon : the outline's corners (s, v), in its first `count` rows, of at least 12.
    clipped : as many rows, for intermediate results.
    bound, diagonals : (2, 2) and (4,) receive the outline of the visible part, see `Planes`.
    pixel : (2, 2) receives the bounds of that part on the screen, low and high, pixels.

    Returns
    -------
    2 if the whole outline is visible, 1 if a part is, 0 if nothing is.
    """
    whole = True
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
    bound[0], bound[1], pixel[0], pixel[1] = np.inf, -np.inf, np.inf, -np.inf
    for k in range(count):
        s, v = polygon[k, 0], polygon[k, 1]
        forward = max(camera[2, 0] * s + camera[2, 1] * v - camera[2, 2] * distance, 1e-9)
        for axis in range(2):
            sideways = camera[axis, 0] * s + camera[axis, 1] * v - camera[axis, 2] * distance
            place = min(max(sideways / (tangent[axis] * forward), -guard), guard)
            pixels = (place + 1) / 2 * size[axis]
            pixel[0, axis], pixel[1, axis] = min(pixel[0, axis], pixels), max(pixel[1, axis], pixels)
            bound[0, axis] = min(bound[0, axis], polygon[k, axis])
            bound[1, axis] = max(bound[1, axis], polygon[k, axis])
    _diagonals(polygon, count, diagonals)
    if not (bound[1, 0] > bound[0, 0] and bound[1, 1] > bound[0, 1]):
        return 0
    return 2 if whole else 1
