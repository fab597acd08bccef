"""Find the silhouettes and creases of objects as lines on the screen.

The reference is `render.antialiasing.silhouette_lines`. NumPy projects all points of an object; here only the ends of
the chosen edges are projected.
"""

import math

import numpy as np

from depthwalk.kernels.compilation import (
    Float32Array1,
    Float32Array2,
    Float64Array2,
    Int32Array2,
    compiled,
    compiled_as_annotated,
)
from depthwalk.render.kernels.layout_loops import turned_axes
from depthwalk.types import Array, Mask

_FIELDS = 7  # of a LINE_RECORD
_FIRST_ROOM = 1024  # lines


@compiled
def _project(clip_from_object: Array, point: Array, clip: Array) -> None:
    """Write the clip coordinates (4,) of a point (3,) into `clip`; the matrix is (4, 4), for column vectors."""
    for row in range(4):
        clip[row] = clip_from_object[row, 3]
        for axis in range(3):
            clip[row] += clip_from_object[row, axis] * point[axis]


@compiled
def _clipped(start: Array, stop: Array) -> bool:
    """Clip the line from `start` to `stop`, (4,) clip coordinates, at the near plane; return whether any is left."""
    before, beyond = start[2] + start[3], stop[2] + stop[3]
    if before <= 0 and beyond <= 0:
        return False
    if before <= 0 or beyond <= 0:
        cut = min(max(before / (before - beyond), 0.0), 1.0)
        for axis in range(4):
            crossing = start[axis] + cut * (stop[axis] - start[axis])
            if before <= 0:
                start[axis] = crossing
            else:
                stop[axis] = crossing
    return True


@compiled
def _write(start: Array, stop: Array, width: float, height: float, line: Array) -> bool:
    """Write ends and depths of a line between clip coordinates to `line`; return whether it passes a pixel's centre."""
    x, y = (start[0] / start[3] + 1) * (width / 2), (start[1] / start[3] + 1) * (height / 2)
    to_x, to_y = (stop[0] / stop[3] + 1) * (width / 2), (stop[1] / stop[3] + 1) * (height / 2)
    if max(x, to_x) < 0 or max(y, to_y) < 0 or min(x, to_x) > width or min(y, to_y) > height:
        return False
    if abs(to_y - y) > abs(to_x - x):
        last, passed = math.floor(y - 0.5), math.floor(to_y - 0.5)
    else:
        last, passed = math.floor(x - 0.5), math.floor(to_x - 0.5)
    line[0], line[1], line[2], line[3] = x, y, to_x, to_y
    line[4], line[5] = start[2] / start[3] / 2 + 0.5, stop[2] / stop[3] / 2 + 0.5
    return bool(last != passed)


@compiled_as_annotated
def silhouettes(
    points: Float32Array2,
    ends: Int32Array2,
    faces: Int32Array2,
    planes: Float32Array2,
    folds: Float32Array1,
    origin: Float32Array2,
    rotation: Float32Array2,
    scale: Float32Array1,
    clip_from_eye: Float64Array2,
    width: float,
    height: float,
    most_fold: float,
    solid: bool,
    farthest: float,
) -> Array:
    """Return the lines of n objects of one asset.

    Parameters
    ----------
    points, ends, faces, planes, folds : of the `EdgeAdjacency`.
    origin, rotation, scale : (n, 3), (n, 4) and (n,), of the PLACED_RECORDs.
    clip_from_eye : (4, 4) of the view, for column vectors.
    width, height : of the picture, pixels.
    most_fold : edges whose fold has a lower cosine than this are creases; above 1, every edge is drawn.
    solid : whether the asset is closed, so that back faces are never visible.
    farthest : objects at a greater distance than this times their scale are left out, metres.

    Returns
    -------
    (k, 7) float32, the fields of a LINE_RECORD, object by object.
    """
    lines, count = np.empty((_FIRST_ROOM, _FIELDS), np.float32), 0
    front: Mask = np.empty(len(planes), np.bool_)
    axes, matrix = np.empty((3, 3)), np.empty((4, 4))
    viewer, start, stop = np.empty(3), np.empty(4), np.empty(4)
    for number in range(len(scale)):
        x, y, z = origin[number, 0], origin[number, 1], origin[number, 2]
        if math.sqrt(x * x + y * y + z * z) > farthest * scale[number]:
            continue
        turned_axes(rotation[number], axes)
        for axis in range(3):
            viewer[axis] = 0.0
            for k in range(3):
                viewer[axis] -= origin[number, k] * axes[k, axis] / scale[number]
        for face in range(len(planes)):
            across = planes[face, 0] * viewer[0] + planes[face, 1] * viewer[1] + planes[face, 2] * viewer[2]
            front[face] = across > planes[face, 3]
        for row in range(4):
            matrix[row, 3] = clip_from_eye[row, 3]
            for k in range(3):
                matrix[row, 3] += clip_from_eye[row, k] * origin[number, k]
            for axis in range(3):
                matrix[row, axis] = 0.0
                for k in range(3):
                    matrix[row, axis] += clip_from_eye[row, k] * axes[k, axis] * scale[number]
        for edge in range(len(ends)):
            first, second = front[faces[edge, 0]], front[faces[edge, 1]]
            silhouette = first != second or (not solid and faces[edge, 1] == len(planes) - 1)
            crease = folds[edge] < most_fold and (first or not solid)
            if not (silhouette or crease or most_fold > 1):
                continue
            _project(matrix, points[ends[edge, 0 if first else 1]], start)
            _project(matrix, points[ends[edge, 1 if first else 0]], stop)
            if not _clipped(start, stop):
                continue
            if count == len(lines):
                more = np.empty((2 * count, _FIELDS), np.float32)
                for row in range(count):
                    for field in range(_FIELDS):
                        more[row, field] = lines[row, field]
                lines = more
            if _write(start, stop, width, height, lines[count]):
                lines[count, 6] = 1.0 if silhouette else 0.0
                count += 1
    return lines[:count]
