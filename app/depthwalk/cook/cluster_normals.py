"""Fit the normals of simplified triangles to the mesh's, and measure how far off they still are.

A collapse leaves a vertex a normal between those of two vertices, although it stands for the surface around both.
Normals fitted by least squares differ least from that surface wherever shaders interpolate them, as in the levels of
meshes (`bake.level_looks`). What is left depends on the size of the triangles: as a surface is averaged over a pixel,
normals of triangles smaller than that may differ a lot. So a difference counts as a distance in proportion to the edges
of the triangle that shows it, as much as in levels (`LOOKS_WRONG`).
"""

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from depthwalk.bake.level_looks import LOOKS_WRONG, SHORT, STAYS, barycentric, unit
from depthwalk.geometry.triangles import face_normals, row_ids
from depthwalk.types import Array, Ints, Mask

_STEPS = 3  # of conjugate gradients: a vertex depends little on those that are not beside it


def fit_normals(
    normal: Array, place: Ints, fixed: Mask, corners: Array, triangles: Ints, fine: Array, shown: Array
) -> Array:
    """Return normals with which simplified triangles differ least from those that they replace.

    Each of the finer triangles is a sample at its centre, weighted by its area. Where the simplified triangle with the
    nearest centre faces the other way, as on the other side of a leaf, the sample does not count.

    Parameters
    ----------
    normal
        (v, 3) unit normals of the vertices.
    place, fixed
        (v,) the place of each vertex, and whether its normal stays as it is. Vertices at one place with the same
        normal, as along the seam of a texture, have the same one afterwards.
    corners, triangles
        (t, 3, 3) positions of the corners of the simplified triangles, and their vertices (t, 3).
    fine, shown
        (n, 3, 3) positions of the corners of the finer triangles, and the unit normals (n, 3, 3) there.

    Returns
    -------
    Array
        (v, 3) unit normals.
    """
    if not len(triangles):
        return normal
    facing, area = face_normals(fine)
    centre = _centres(fine)
    near = cKDTree(_centres(corners), leafsize=16, balanced_tree=False, compact_nodes=False).query(centre)[1]
    used = np.flatnonzero((np.einsum("ij,ij->i", facing, face_normals(corners)[0][near]) > 0) & (area > 0))
    if not len(used):
        return normal
    shares = _shares(centre[used], corners[near[used]])
    wanted, weight = _centres(shown[used]), np.sqrt(area[used] / area[used].mean())
    unknown, first = row_ids(np.column_stack([place, normal]))
    solved = _least_squares(normal[first], fixed[first], unknown[triangles[near[used]]], shares, wanted, weight)
    return np.asarray(solved[unknown])


def normal_errors(point: Array, normal: Array, of: Ints, corners: Array, normals: Array, groups: int) -> Array:
    """Return how far groups of simplified triangles are off in their normals, as a distance.

    It is the root mean square over points of the mesh: normals of a scanned surface vary so much that the greatest
    difference says little about how a group looks. Points on the other side of a leaf do not count.

    Parameters
    ----------
    point, normal, of
        (n, 3) the points, the mesh's unit normals there (n, 3), and the group (n,) of each.
    corners, normals
        (n, 3, 3) the corners of the simplified triangle that each point is near, and the unit normals there.
    groups
        Number of groups.

    Returns
    -------
    Array
        (groups,) distances, in the unit of the points.
    """
    shown = unit(np.einsum("nk,nkd->nd", _shares(point, corners), normals))
    counts = np.einsum("nd,nd->n", shown, normal) > 0
    squared = counts * 2 * face_normals(corners)[1] * np.square(shown - normal).sum(1)
    total, count = np.bincount(of, squared, groups), np.bincount(of, counts, groups)
    return np.asarray(LOOKS_WRONG * np.sqrt(total / np.maximum(count, 1)))


def _least_squares(normal: Array, fixed: Mask, vertices: Ints, shares: Array, wanted: Array, weight: Array) -> Array:
    """Return normals (v, 3) of vertices, of which some are `fixed` (v,), that fit samples.

    vertices, shares: (n, 3) the vertices that each sample lies between, and its barycentric coordinates; wanted: (n, 3)
    normals of the samples; weight: (n,) of their differences.
    """
    begin, weight = normal.astype(np.float32), weight.astype(np.float32)[:, None]
    values = weight * shares.astype(np.float32)
    ends = np.arange(0, 3 * len(vertices) + 1, 3)
    shown = csr_array((values.ravel(), vertices.ravel(), ends), shape=(len(vertices), len(normal)))
    back, free = shown.T.tocsr(), ~fixed[:, None]
    scale = free / (STAYS + np.bincount(vertices.ravel(), np.square(values).ravel(), len(normal)))[:, None]
    scale = scale.astype(np.float32)
    # Conjugate gradients, from the normals that the vertices have; scaled by the diagonal of the matrix (Jacobi).
    found, left = np.zeros_like(begin), back @ (weight * wanted.astype(np.float32) - shown @ begin)
    along, squared = scale * left, (scale * left * left).sum(0)
    for _ in range(_STEPS):
        image = STAYS * along + back @ (shown @ along)
        step = squared / np.maximum((along * image).sum(0), 1e-30)
        found += step * along
        left -= step * image
        before, squared = squared, (scale * left * left).sum(0)
        along = scale * left + squared / np.maximum(before, 1e-30) * along
    fitted = normal + found
    length = np.linalg.norm(fitted, axis=1, keepdims=True)
    return np.where(free & (length > SHORT), fitted / np.maximum(length, SHORT), normal)


def _centres(values: Array) -> Array:
    """Return the means (n, 3) of values at the corners of triangles (n, 3, 3)."""
    return np.asarray((values[:, 0] + values[:, 1] + values[:, 2]) / 3)  # `mean` along so short an axis is slow


def _shares(point: Array, corners: Array) -> Array:
    """Return barycentric coordinates (n, 3) of points in triangles (n, 3, 3), or at their edge for points beside them.

    Unlike `cluster_error.nearest_shares`, it need not be the nearest point there.
    """
    shares = np.maximum(barycentric(point, corners), 0)
    return np.asarray(shares / shares.sum(1, keepdims=True))
