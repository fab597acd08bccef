"""Compute with large arrays of 3-D vectors, and extract the components of single ones."""

import numpy as np
from pyglm import glm

from depthwalk.types import Array


def components(vector: glm.dvec3) -> tuple[float, float, float]:
    """Return x, y and z of a single `vector`, exactly.

    PyGLM's own `to_tuple` (2.8.3) never frees the numbers that it returns: 72 bytes for each call, some 400 a frame.
    """
    return vector.x, vector.y, vector.z


def lengths(vectors: Array) -> Array:
    """Return the lengths (…) of `vectors` (…, 3), in their unit: as `numpy.linalg.norm` does, but ten times faster."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.asarray(np.sqrt(x * x + y * y + z * z))
