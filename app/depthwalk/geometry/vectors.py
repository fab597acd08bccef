"""Compute with large arrays of 3-D vectors, and extract the components of single ones."""

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.types import Array


def components(vector: glm.dvec3) -> tuple[float, float, float]:
    """Return x, y and z of a single `vector`, exactly.

    PyGLM's own `to_tuple` (2.8.3) never frees the numbers that it returns: 72 bytes for each call, some 400 a frame.
    """
    return vector.x, vector.y, vector.z


def normal_matrices(linear: Array) -> NDArray[np.float64]:
    """Return the matrices (n, 3, 3) that turn normals as `linear` (n, 3, 3) turns surfaces, up to their length."""
    x, y, z = (linear[..., column] for column in range(3))
    cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=-1)
    return np.asarray(cofactors * np.sign(np.einsum("ni,ni->n", x, np.cross(y, z)))[:, None, None])


def lengths(vectors: Array) -> Array:
    """Return the lengths (…) of `vectors` (…, 3), in their unit: as `numpy.linalg.norm` does, but ten times faster."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.asarray(np.sqrt(x * x + y * y + z * z))
