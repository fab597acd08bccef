"""Simplified foliage made as large as it was, or trees and their shadows would become bare with distance.

What is left makes up for leaves that have vanished or shrunk, as those do that Cook et al. 2007, "Stochastic
Simplification of Aggregate Detail", do not leave out.
"""

import numpy as np

from depthwalk.cook.edge_collapse import ClusteredSurface, open_edges
from depthwalk.geometry.triangles import face_normals, sample_batches
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array

_SAMPLES = 4  # per face of a cube: of the cubes that are met, nearly all are found
_GUESSES = 4  # of how far rims are to be moved
_STRIDE = 4.0  # times as far as the guess before, at most


def voxels(corners: Array, side: float) -> int:
    """How many cubes of a lattice of so many metres triangles (t, 3, 3) meet. What lies twice in one place counts once,
    where areas would be added."""
    areas = face_normals(corners)[1]
    # A bit map is several times as quick as sorting the cells' numbers. It has a cell to spare, for rounding.
    low = np.floor(corners.min((0, 1)) / side).astype(np.int64) - 1
    met = np.zeros(np.floor(corners.max((0, 1)) / side).astype(np.int64) - low + 2, bool)
    _, height, depth = met.shape
    for point, _ in sample_batches(corners, areas, int(_SAMPLES * areas.sum() / side**2) + 1):
        x, y, z = np.floor(point / side).astype(np.int64).T - low[:, None]
        met.ravel()[(x * height + y) * depth + z] = True
    return int(np.count_nonzero(met))


def spread(surface: ClusteredSurface, wanted: int, side: float, most: float) -> Array:
    """Its points (n, 3), those on its rims moved outward, all by as much, `most` at most, so that it meets `wanted`
    `voxels` of that side, both metres. What meets more already stays as it is."""
    triangles = surface.triangles
    start, end, across = open_edges(surface.point, triangles, face_normals(surface.point[triangles])[0])
    outward = np.zeros(surface.point.shape)
    for vertex in start, end:
        for column, values in zip(outward.T, across.T, strict=True):
            column += np.bincount(vertex, values, len(outward))
    outward /= np.maximum(lengths(outward), 1e-30)[:, None]
    before = voxels(surface.point[triangles], side)
    missing, rim = wanted - before, float(lengths(across).sum())
    away = min(missing * side**2 / max(rim, 1e-30), most)
    if missing <= 0:
        return surface.point
    for _ in range(_GUESSES - 1):
        gained = voxels((surface.point + away * outward)[triangles], side) - before
        guess = min(away * min(max(missing / max(gained, 1), 1 / _STRIDE), _STRIDE), most)
        if guess == away:
            break
        away = guess
    return surface.point + away * outward
