"""Compute quadric error metrics: sums of squared distances from the planes that a simplified vertex stands for.

Garland and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics": merging two vertices adds their
quadrics, and the best place for the new vertex is the minimum of the sum.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from depthwalk.cook.sharp_features import SharpFeatures
from depthwalk.geometry.indexed_triangles import normals_and_areas, open_edges
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array, Ints

_PAIRS = np.triu_indices(4)  # a quadric is the upper half of a symmetric matrix, 4 × 4


@dataclass(frozen=True, kw_only=True)
class ClusteredSurface:
    """Hold triangles that share vertices, and the surface that each vertex stands for.

    Attributes
    ----------
    point
        (n, 3) vertices, metres.
    triangles
        (t, 3) rows of `point`.
    quadric
        (n, 10) upper halves of symmetric matrices (4, 4): the sum of squared distances from the planes that a vertex
        stands for, weighted by their areas, metres⁴.
    weight
        (n,) the sum of those areas, metres².
    """

    point: Array
    triangles: Ints
    quadric: Array
    weight: Array

    @property
    def area(self) -> float:
        """Return the area of all triangles together, metres²."""
        return float(normals_and_areas(self.point, self.triangles)[1].sum())


def clustered_surface(point: Array, triangles: Ints, features: SharpFeatures | None = None) -> ClusteredSurface:
    """Return a surface whose vertices stand for the planes of their own triangles only, as before any simplification.

    Along the boundary, planes perpendicular to the surface keep it in place.

    Parameters
    ----------
    point
        (n, 3) vertices, metres.
    triangles
        (t, 3) rows of `point`.
    features
        One plane for each of the n vertices, so that ridges stay sharp, which the triangles' own planes cut off. The
        planes of a triangle's corners then count one half; its own plane and those along the boundary count the other.
        None for no such planes.

    Returns
    -------
    ClusteredSurface
        The surface.
    """
    quadric, weight = _quadrics(point, triangles)
    if features is not None:
        quadric = (quadric + _feature_quadric(triangles, features, normals_and_areas(point, triangles)[1])) / 2
    return ClusteredSurface(point=point, triangles=triangles, quadric=quadric, weight=weight)


def squared_distances(quadric: Array, point: Array) -> Array:
    """Return weighted squared distances of points from the planes that quadrics stand for.

    Parameters
    ----------
    quadric
        (10, n), whose columns are quadrics as in `ClusteredSurface`.
    point
        (n, 3) metres.

    Returns
    -------
    Array
        (n,) metres⁴.
    """
    xx, xy, xz, xw, yy, yz, yw, zz, zw, ww = quadric
    x, y, z = point.T
    mixed = x * (xy * y + xz * z + xw) + y * (yz * z + yw) + z * zw
    return np.asarray(xx * x * x + yy * y * y + zz * z * z + 2 * mixed + ww)


def optimal_points(quadric: Array, stiffness: Array, middle: Array) -> Array:
    """Return the points that are nearest to the planes of quadrics, held by springs where the planes do not decide.

    Solves n systems of 3 equations by Cramer's rule.

    Parameters
    ----------
    quadric
        (10, n), whose columns are quadrics as in `ClusteredSurface`.
    stiffness
        (n,) stiffness of the springs, metres².
    middle
        (n, 3) points that the springs pull to, metres.

    Returns
    -------
    Array
        (n, 3) metres.
    """
    xx, xy, xz, xw, yy, yz, yw, zz, zw, _ = quadric
    xx, yy, zz = xx + stiffness, yy + stiffness, zz + stiffness
    x, y, z = stiffness * middle.T - (xw, yw, zw)
    first = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    second = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    determinant = xx * first[0] + xy * first[1] + xz * first[2]
    rows = first, (first[1], second[0], second[1]), (first[2], second[1], second[2])  # of the adjugate
    return np.stack([(a * x + b * y + c * z) / determinant for a, b, c in rows], -1)


def _quadrics(point: Array, triangles: Ints) -> tuple[Array, Array]:
    """Return quadric (n, 10) and weight (n,) of each vertex, from its triangles and its boundary edges."""
    normal, area = normals_and_areas(point, triangles)
    count = len(point)
    quadric, weight = np.zeros((count, len(_PAIRS[0]))), np.zeros(count)
    _add_planes(quadric, triangles.T, normal, point[triangles[:, 0]], area)
    for corner in triangles.T:
        weight += np.bincount(corner, area, count)
    start, end, outward = open_edges(point, triangles, normal)
    length = lengths(outward)
    upright = outward / np.maximum(length, 1e-30)[:, None]
    _add_planes(quadric, (start, end), upright, point[start], length**2)
    return quadric, weight


def _feature_quadric(triangles: Ints, features: SharpFeatures, area: Array) -> Array:
    """Return the quadrics (n, 10) of vertices, from the planes of all corners of their triangles.

    triangles: (t, 3); features: n planes; area: (t,), metres².
    """
    count = len(features.point)
    own, quadric = np.zeros((2, count, len(_PAIRS[0])))
    _add_planes(own, (np.arange(count),), features.normal, features.point, np.ones(count))
    for column, values in zip(quadric.T, own.T, strict=True):
        a, b, c = values[triangles.T]  # `mean` along so short an axis takes several times as long
        mean = (a + b + c) / 3 * area
        for corner in triangles.T:
            column += np.bincount(corner, mean, count)
    return quadric


def _add_planes(quadric: Array, vertices: Iterable[Ints], normal: Array, point: Array, weight: Array) -> None:
    """Add m planes to the quadrics (n, 10) of vertices.

    vertices: several lists (m,) of vertices; normal, point: (m, 3), of the planes; weight: (m,).
    """
    plane = *normal.T, -np.einsum("ij,ij->i", normal, point)
    for column, one, other in zip(quadric.T, *_PAIRS, strict=True):
        values = plane[one] * plane[other] * weight
        for vertex in vertices:
            column += np.bincount(vertex, values, len(quadric))
