"""Dilate simplified foliage; otherwise trees and their shadows would become bare with distance.

Simplification makes leaves shrink or vanish. The remaining ones are enlarged in place, as in Cook et al. 2007,
"Stochastic Simplification of Aggregate Detail"; counting voxels determines by how much.
"""

import numpy as np

from depthwalk.cook.quadrics import ClusteredSurface
from depthwalk.geometry.indexed_triangles import open_edges
from depthwalk.geometry.triangles import face_normals, sample_batches
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array

_SAMPLES = 4  # per face of a voxel: enough to find nearly all voxels that are touched
_OFFSETS = 4  # that are tried, including the first
_MAX_RATIO = 4.0  # of an offset to the one before


def count_voxels(corners: Array, voxel_size: float) -> int:
    """Return how many voxels a set of triangles touches.

    Triangles that overlap count once, unlike in a sum of areas.

    Parameters
    ----------
    corners
        (t, 3, 3) the triangles, metres.
    voxel_size
        Edge of a voxel, metres.

    Returns
    -------
    int
        The number of voxels.
    """
    areas = face_normals(corners)[1]
    # A bit map is several times as fast as sorting voxel numbers. It has a spare voxel for rounding.
    low = np.floor(corners.min((0, 1)) / voxel_size).astype(np.int64) - 1
    met = np.zeros(np.floor(corners.max((0, 1)) / voxel_size).astype(np.int64) - low + 2, bool)
    _, height, depth = met.shape
    for point, _ in sample_batches(corners, areas, int(_SAMPLES * areas.sum() / voxel_size**2) + 1):
        x, y, z = np.floor(point / voxel_size).astype(np.int64).T - low[:, None]
        met.ravel()[(x * height + y) * depth + z] = True
    return int(np.count_nonzero(met))


def dilate_foliage(surface: ClusteredSurface, target_voxels: int, voxel_size: float, max_offset: float) -> Array:
    """Dilate simplified foliage until it covers as much as the original.

    Moves every boundary vertex outward by one common distance, so that the surface touches about `target_voxels`
    voxels. Surfaces that already touch enough are returned unchanged.

    Parameters
    ----------
    surface
        The simplified foliage.
    target_voxels
        The result of `count_voxels` for the original.
    voxel_size
        Edge of a voxel, metres.
    max_offset
        Greatest distance by which vertices are moved, metres.

    Returns
    -------
    Array
        (n, 3) the surface's vertices, metres.
    """
    triangles = surface.triangles
    start, end, across = open_edges(surface.point, triangles, face_normals(surface.point[triangles])[0])
    outward = np.zeros(surface.point.shape)
    for vertex in start, end:
        for column, values in zip(outward.T, across.T, strict=True):
            column += np.bincount(vertex, values, len(outward))
    outward /= np.maximum(lengths(outward), 1e-30)[:, None]
    before = count_voxels(surface.point[triangles], voxel_size)
    missing, boundary_length = target_voxels - before, float(lengths(across).sum())
    if missing <= 0:
        return surface.point
    offset = min(missing * voxel_size**2 / max(boundary_length, 1e-30), max_offset)
    for _ in range(_OFFSETS - 1):
        gained = count_voxels((surface.point + offset * outward)[triangles], voxel_size) - before
        ratio = min(max(missing / max(gained, 1), 1 / _MAX_RATIO), _MAX_RATIO)
        following = min(offset * ratio, max_offset)
        if following == offset:
            break
        offset = following
    return surface.point + offset * outward
