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


def conjugate(quaternion: Array) -> Array:
    """Return the inverse rotations (…, 4) of the unit `quaternion` (…, 4), x y z w."""
    return quaternion * np.array([-1, -1, -1, 1], quaternion.dtype)


def multiply(outer: Array, inner: Array) -> Array:
    """Return the rotations (…, 4), x y z w, that apply first `inner` and then `outer`, (…, 4) each; both broadcast."""
    a, b = outer[..., :3], inner[..., :3]
    vector = outer[..., 3:] * b + inner[..., 3:] * a + cross(a, b)
    scalar = outer[..., 3:] * inner[..., 3:] - (a * b).sum(-1, keepdims=True)
    return np.concatenate([vector, scalar], -1)
