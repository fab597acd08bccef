"""Compute vertex normals: smooth on smooth surfaces, split at creases."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.adjacency import connected_groups
from depthwalk.geometry.distinct import distinct_numbers
from depthwalk.geometry.spatial_order import stable_order
from depthwalk.geometry.triangles import corner_axes, crossed_edges, row_ids
from depthwalk.types import Array, Ints

CREASE_ANGLE = np.radians(60.0)


def split_at_creases(
    positions: Array, faces: Ints, crease: float = CREASE_ANGLE
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Compute vertex normals, and duplicate vertices at creases so that each side has its own normals.

    A normal is the mean of those of the surrounding faces, weighted by their angles there (Thürmer and Wüthrich 1998).
    The corners of faces at one position form a smooth group as long as each shares an edge, folded by less than
    `crease`, with the next. Vertices at the same position (texture seams) count as one.

    Parameters
    ----------
    positions
        (V, 3) float64, metres.
    faces
        (F, 3) int64, rows of `positions`, none of zero area.
    crease
        Angle between two faces, radians, from which their edge stays sharp.

    Returns
    -------
    source
        (N,) int64, the old vertex that each new one copies.
    faces
        (F, 3) int64, the faces with new vertices.
    normals
        (N, 3) float64, unit length.
    """
    axes = corner_axes(positions, faces)
    face_normals, weights = np.stack(crossed_edges(axes), -1), _corner_angles(axes).ravel()
    del axes  # the memory is needed
    lengths = np.linalg.norm(face_normals, axis=1, keepdims=True)
    # Far from the file's origin, faces may have lost their area to rounding; they are invisible.
    face_normals = np.where(lengths > 0, face_normals / np.maximum(lengths, np.finfo(float).tiny), [0.0, 1.0, 0.0])
    welded = row_ids(positions)[0][faces]
    group = _smooth_groups(welded, face_normals, np.cos(crease))

    sums = np.stack([np.bincount(group, weights=np.repeat(axis, 3) * weights) for axis in face_normals.T], axis=1)
    lengths = np.linalg.norm(sums, axis=1)

    key = faces.ravel().astype(np.int64) * len(sums) + group
    _, first, new = distinct_numbers(key)
    group = group[first]
    # Faces back to back cancel out: take the normal of any one of them.
    cancelled = (lengths[group] < 1e-6)[:, None]
    normals = np.where(cancelled, face_normals[first // 3], sums[group] / np.maximum(lengths[group], 1e-30)[:, None])
    return faces.ravel()[first], new.reshape(faces.shape), normals


def _smooth_groups(welded: Ints, face_normals: Array, least_cosine: float) -> Ints:
    """Return the group number (3F,) of every face corner: corners at one position, linked across smooth edges."""
    count = welded.size
    start = np.arange(count)
    end = start - start % 3 + (start + 1) % 3  # half-edge k runs from corner k to the next of its face
    a, b = welded.ravel(), welded.ravel()[end]
    edge = np.minimum(a, b) * (welded.max() + 1) + np.maximum(a, b)
    order = stable_order(edge)
    edge = edge[order]
    shared = np.flatnonzero(edge[1:] == edge[:-1])
    one, other = order[shared], order[shared + 1]
    face, beside = one // 3, other // 3
    folded = sum(axis.take(face) * axis.take(beside) for axis in np.ascontiguousarray(face_normals.T))
    smooth = folded >= least_cosine
    one, other = one[smooth], other[smooth]
    # Neighbours traverse a shared edge in opposite directions, unless one of them has the wrong winding.
    opposite = a[one] != a[other]
    linked = np.concatenate([one, end[one]])
    to = np.concatenate([np.where(opposite, end[other], other), np.where(opposite, other, end[other])])
    return connected_groups(count, linked, to)


def _corner_angles(axes: list[Array]) -> NDArray[np.float64]:
    """Return the angle (F, 3) at every corner of every face, radians; `axes` are the `corner_axes` of the faces."""
    edges = [axis[[1, 2, 0]] - axis for axis in axes]  # edge k leaves corner k
    (ax, ay, az), (bx, by, bz) = edges, [-edge[[2, 0, 1]] for edge in edges]
    sine = np.sqrt(np.square(ay * bz - az * by) + np.square(az * bx - ax * bz) + np.square(ax * by - ay * bx))
    return np.asarray(np.arctan2(sine, ax * bx + ay * by + az * bz).T)
