"""Rotate many vectors at once by unit quaternions (x, y, z, w).

For a single rotation PyGLM is more readable; here all objects of a scene are rotated together.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array

_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])  # of each axis, the one after it and the one before


def rotate(quaternion: Array, vector: Array) -> Array:
    """Return `vector` (…, 3) rotated by the unit `quaternion` (…, 4), x y z w; both broadcast."""
    axis, w = quaternion[..., :3], quaternion[..., 3:]
    return vector + 2 * cross(axis, cross(axis, vector) + w * vector)


def cross(a: Array, b: Array) -> Array:
    """Return the cross products (…, 3) of the vectors `a` and `b`, (…, 3) each; both broadcast.

    The values are those of `numpy.cross`, which takes several times as long for the few vectors of a frame.
    """
    return a.take(_NEXT, -1) * b.take(_LAST, -1) - a.take(_LAST, -1) * b.take(_NEXT, -1)


def matrices(quaternion: Array) -> NDArray[np.float64]:
    """Return the rotation matrices (n, 3, 3) of the unit `quaternion` (n, 4), x y z w, in its precision.

    They multiply column vectors. If each rotation applies to several row vectors, `vectors @ matrices` is twice as fast
    as `rotate` by the inverse.
    """
    vector, scalar = quaternion.T[:3], quaternion.T[3]
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = 2.0 * vector[:, None] * vector
    wx, wy, wz = 2.0 * scalar * vector
    matrix = np.empty((len(quaternion), 3, 3), xx.dtype)
    matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 0, 2] = 1 - yy - zz, xy - wz, xz + wy
    matrix[:, 1, 0], matrix[:, 1, 1], matrix[:, 1, 2] = xy + wz, 1 - xx - zz, yz - wx
    matrix[:, 2, 0], matrix[:, 2, 1], matrix[:, 2, 2] = xz - wy, yz + wx, 1 - xx - yy
    return matrix


def from_matrices(rotation: Array) -> NDArray[np.float64]:
    """Return the unit quaternions (n, 4), x y z w, of rotation matrices (n, 3, 3).

    Of the four that follow from the matrix, the longest is taken (Shepperd, *Quaternion from Rotation Matrix*, 1978).
    """
    m = np.nan_to_num(rotation)
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    outer = np.empty((len(m), 4, 4))  # four times the products of its components
    for i in range(3):
        for j in range(3):
            outer[:, i, j] = m[:, i, j] + m[:, j, i]
        outer[:, i, i] += 1 - trace
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        outer[:, i, 3] = outer[:, 3, i] = m[:, k, j] - m[:, j, k]
    outer[:, 3, 3] = 1 + trace
    longest = outer[np.arange(len(m)), np.argmax(np.einsum("nii->ni", outer), axis=1)]
    return np.asarray(longest / np.maximum(np.linalg.norm(longest, axis=1, keepdims=True), 1e-30))


def conjugate(quaternion: Array) -> Array:
    """Return the inverse rotations (…, 4) of the unit `quaternion` (…, 4), x y z w."""
    return quaternion * np.array([-1, -1, -1, 1], quaternion.dtype)


def multiply(outer: Array, inner: Array) -> Array:
    """Return the rotations (…, 4), x y z w, that apply first `inner` and then `outer`, (…, 4) each; both broadcast."""
    a, b = outer[..., :3], inner[..., :3]
    vector = outer[..., 3:] * b + inner[..., 3:] * a + cross(a, b)
    scalar = outer[..., 3:] * inner[..., 3:] - (a * b).sum(-1, keepdims=True)
    return np.concatenate([vector, scalar], -1)
