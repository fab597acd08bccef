"""Dilate simplified foliage; otherwise trees and their shadows would become bare with distance.

Simplification makes leaves shrink or vanish. The remaining ones are enlarged in place, as in Cook et al. 2007,
"Stochastic Simplification of Aggregate Detail"; counting voxels determines by how much.
"""

import math
from collections.abc import Iterable
from functools import cached_property

import numpy as np

from depthwalk.cook.quadrics import ClusteredSurface
from depthwalk.geometry.distinct import sorted_distinct
from depthwalk.geometry.indexed_triangles import open_edges
from depthwalk.geometry.triangles import face_normals, sample_batches
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array, Ints

_SAMPLES = 4  # per face of a voxel: enough to find nearly all voxels that are touched
_MAX_MAP = 1 << 29  # voxels of a box, a byte each, that are always marked in a map: more than a tree at 512² has
_MAP_SHARE = 8  # bytes of a map for each sample: less than sorting takes where most samples meet another voxel
_MIN_MERGED = 1 << 20  # voxel numbers that are sorted together
_VIEWS = 6  # from which silhouettes are seen; opposite ones show the same
_OFFSETS = 4  # that are tried, including the first
_MAX_RATIO = 4.0  # of an offset to the one before
_PIXEL = 4.0  # edge of the pixels of silhouettes, in voxels
_LEAST_COVER = 0.95  # of what the original covers: what is as large as it


def count_voxels(corners: Array, voxel_size: float) -> int:
    """Return how many voxels a set of triangles touches.

    Triangles that overlap count once, unlike in a sum of areas. Memory: 512 MiB at most, or, where that is
    more, some 32 bytes for each voxel that is touched, however large the box around them is.

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
    low = np.floor(corners.min((0, 1)) / voxel_size).astype(np.int64) - 1
    shape = np.floor(corners.max((0, 1)) / voxel_size).astype(np.int64) - low + 2  # a spare voxel for rounding
    _, height, depth = shape.tolist()
    count = int(_SAMPLES * areas.sum() / voxel_size**2) + 1
    samples = sample_batches(corners, areas, count)

    def numbers(point: Array) -> Ints:
        x, y, z = np.floor(point / voxel_size).astype(np.int64).T - low[:, None]
        return np.asarray((x * height + y) * depth + z)

    # A map is quicker than sorting voxel numbers, but most of a large box may be empty.
    if (size := math.prod(shape.tolist())) > max(_MAX_MAP, _MAP_SHARE * count):
        return _count_distinct(numbers(point) for point, _ in samples)
    met = np.zeros(size, bool)
    for point, _ in samples:
        met[numbers(point)] = True
    return int(np.count_nonzero(met))


def _count_distinct(batches: Iterable[Ints]) -> int:
    """Return how many different numbers there are in several arrays, in memory for little more than these."""
    known, found, count = np.zeros(0, np.int64), [np.zeros(0, np.int64)], 0
    for batch in batches:
        found.append(sorted_distinct(batch))
        count += len(found[-1])
        if count > max(len(known), _MIN_MERGED):  # rarely, since all are sorted again
            known, found, count = sorted_distinct(np.concatenate([known, *found])), [], 0
    return len(sorted_distinct(np.concatenate([known, *found])))


def count_silhouette(corners: Array, pixel: float) -> int:
    """Return how many pixels a set of triangles covers, seen from far away, in all of several views from around.

    Parameters
    ----------
    corners
        (t, 3, 3) the triangles, metres, object frame.
    pixel
        Edge of a pixel, metres.

    Returns
    -------
    int
        The number of pixels.
    """
    areas = face_normals(corners)[1]
    count = int(_SAMPLES * areas.sum() / pixel**2) + 1
    met = [set[int]() for _ in range(_VIEWS)]
    for point, _ in sample_batches(corners, areas, count):
        row = np.floor(point[:, 1] / pixel).astype(np.int64) << 32
        for pixels, angle in zip(met, np.pi * np.arange(_VIEWS) / _VIEWS, strict=True):
            across = np.floor((point[:, 0] * np.cos(angle) - point[:, 2] * np.sin(angle)) / pixel).astype(np.int64)
            pixels.update(np.unique(row + across).tolist())
    return sum(map(len, met))


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


class FoliageCover:
    """Tell how much foliage covers, by voxels that it touches and by its silhouettes, and keep its levels as large."""

    def __init__(self, point: Array, triangles: Ints, voxel: float) -> None:
        """Take the original, points (n, 3) and triangles (t, 3), and the edge of a voxel, metres; count nothing yet."""
        self._point, self._triangles, self._voxel = point, triangles, voxel

    @cached_property
    def _target(self) -> int:
        return count_voxels(self._point[self._triangles], self._voxel)

    @cached_property
    def _silhouette(self) -> int:
        return count_silhouette(self._point[self._triangles], _PIXEL * self._voxel)

    def restored(self, surface: ClusteredSurface, tolerance: float) -> Array:
        """Return the triangles (t, 3, 3) of a level, metres, dilated by at most its tolerance, metres.

        They stay within the box of the original, beyond which vertices cannot be stored.
        """
        point = dilate_foliage(surface, self._target, self._voxel, tolerance)
        return np.clip(point, self._point.min(0), self._point.max(0))[surface.triangles]

    def is_restored(self, corners: Array) -> bool:
        """Return whether triangles (t, 3, 3), metres, touch as many voxels as the original."""
        return count_voxels(corners, self._voxel) >= _LEAST_COVER * self._target

    def looks_restored(self, corners: Array) -> bool:
        """Return whether triangles (t, 3, 3), metres, hide as much of what is behind them as the original does."""
        return count_silhouette(corners, _PIXEL * self._voxel) >= _LEAST_COVER * self._silhouette
