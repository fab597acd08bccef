"""Fit the normals of simplified triangles to those of the triangles that they replace.

A collapse gives the vertex that is left a normal between those of two vertices, though it stands for the surface around
both. Least squares, as for the levels of meshes (`bake.level_looks`), give normals that differ least from the surface's
wherever shaders interpolate them.
"""

import numpy as np
from scipy.sparse import csr_array

from depthwalk.geometry.triangles import row_ids
from depthwalk.types import Array, Ints, Mask, Rows

_STEPS = 8  # of conjugate gradients: each vertex depends on its neighbours, and little on those beyond
_STAYS = 0.05  # weight of a vertex's own normal, where a sample of mean weight has 1: for vertices with few samples
_SHORT = 0.1  # length below which a fitted normal is meaningless, as where both sides of a leaf are merged


def fitted_normals(normal: Array, place: Rows, fixed: Mask, corners: Ints, shares: Array, wanted: Array, weight: Array) -> Array:
    """Return normals of vertices with which those shown at samples differ least from the wanted ones.

    Parameters
    ----------
    normal
        (v, 3) unit normals of the vertices.
    place, fixed
        (v,) the place of each vertex, and whether its normal stays. Vertices at one place with one normal, as along
        seams of textures, keep a common one.
    corners, shares
        (n, 3) the vertices of the triangle on which each sample is, and its barycentric coordinates there.
    wanted, weight
        (n, 3) the normals at the samples, and the weight (n,) of each.

    Returns
    -------
    Array
        (v, 3) unit normals.
    """
    if not len(corners):
        return normal
    unknown, first = row_ids(np.column_stack([place, normal]))
    begin = normal[first]
    free = ~fixed[first, None]
    root = np.sqrt(weight / weight.mean())[:, None]
    rows = np.arange(0, 3 * len(corners) + 1, 3)
    shown = csr_array(((root * shares).ravel(), unknown[corners].ravel(), rows), shape=(len(corners), len(first)))
    back = shown.T.tocsr()
    scale = 1 / (_STAYS + np.bincount(unknown[corners].ravel(), np.square(root * shares).ravel(), len(first)))[:, None]
    found = np.zeros_like(begin)  # what is added to `begin`
    left = free * (back @ (root * wanted - shown @ begin))
    along, squared = scale * left, (scale * left * left).sum(0)
    for _ in range(_STEPS):
        image = free * (_STAYS * along + back @ (shown @ along))
        step = squared / np.maximum((along * image).sum(0), 1e-300)
        found += step * along
        left -= step * image
        before, squared = squared, (scale * left * left).sum(0)
        along = scale * left + squared / np.maximum(before, 1e-300) * along
    fitted = begin + found
    length = np.linalg.norm(fitted, axis=1, keepdims=True)
    fitted = np.where(free & (length > _SHORT), fitted / np.maximum(length, _SHORT), begin)
    return np.asarray(fitted[unknown])
