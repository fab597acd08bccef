"""Compute quadric error metrics: sums of squared distances from the planes that a simplified vertex represents.

Garland and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics": merging two vertices adds their
quadrics, and the best position of the new vertex minimises the sum.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from depthwalk.cook.sharp_features import SharpFeatures
from depthwalk.geometry.indexed_triangles import normals_and_areas, open_edges
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array, Ints, Mask

# Weight of a boundary where a surface ends. Beyond such an end, as at the edge of a box, another image continues, and a
# displaced boundary opens a gap; other boundaries lie on surface that another image shows.
_END_WEIGHT = 4.0
_PAIRS = np.triu_indices(4)  # a quadric is the upper half of a symmetric matrix, 4 × 4


@dataclass(frozen=True, kw_only=True)
class ClusteredSurface:
    """Hold triangles that share vertices, and the surface that each vertex represents.

    Attributes
    ----------
    point
        (n, 3) vertices, metres.
    triangles
        (t, 3) rows of `point`.
    quadric
        (n, 10) upper halves of symmetric matrices (4, 4): the sum of squared distances from the planes that a vertex
        represents, weighted by their areas, metres⁴.
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


def clustered_surface(
    point: Array,
    triangles: Ints,
    features: SharpFeatures | None = None,
    opposite: Ints | None = None,
    at_end: Mask | None = None,
) -> ClusteredSurface:
    """Return a surface whose vertices represent only the planes of their own triangles, as before any simplification.

    Along the boundary, planes perpendicular to the surface keep it in place.

    Parameters
    ----------
    point
        (n, 3) vertices, metres.
    triangles
        (t, 3) rows of `point`.
    features
        One plane for each of the n vertices, to keep ridges sharp that the triangles' own planes cut off. The planes of
        a triangle's corners then count one half; its own plane and those along the boundary count the other. None for
        no such planes.
    opposite
        (3 t,) the result of `opposite_edges` for the triangles, if it is known.
    at_end
        (n,) which vertices lie where a surface ends: a boundary between two of them is held more firmly. None for
        none.

    Returns
    -------
    ClusteredSurface
        The surface.
    """
    normal, area = normals_and_areas(point, triangles)
    corners = np.ascontiguousarray(triangles.T)
    weight = np.zeros(len(point))
    for corner in corners:
        weight += np.bincount(corner, area, len(point))
    boundary = open_edges(point, triangles, normal, opposite)
    weights = np.ones(len(boundary[0])) if at_end is None else _boundary_weights(boundary[0], boundary[1], at_end)
    quadric = _quadrics(point, corners, normal, area, boundary, weights)
    if features is not None:
        quadric += _feature_quadric(corners, features, area)
        quadric /= 2
    return ClusteredSurface(point=point, triangles=triangles, quadric=np.ascontiguousarray(quadric.T), weight=weight)


def squared_distances(quadric: Array, point: Array) -> Array:
    """Return weighted squared distances of points from the planes that quadrics represent.

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
    """Return the points nearest to the planes of quadrics, held by springs where the planes do not decide.

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


def _boundary_weights(start: Ints, end: Ints, at_end: Mask) -> Array:
    """Return the weights of boundary edges between vertices (m,)."""
    return np.where(at_end.take(start) & at_end.take(end), _END_WEIGHT, 1.0)


def _quadrics(
    point: Array, corners: Ints, normal: Array, area: Array, boundary: tuple[Ints, Ints, Array], weights: Array
) -> Array:
    """Return the quadric (10, n) of each vertex, from its triangles and its boundary edges.

    corners: (3, t), of the triangles; normal (t, 3) and area (t,), theirs; boundary: the result of `open_edges`;
    weights: (m,), of the boundary edges.
    """
    quadric = np.zeros((len(_PAIRS[0]), len(point)))
    _add_planes(quadric, corners, normal, point.take(corners[0], 0), area)
    start, end, outward = boundary
    length = lengths(outward)
    upright = outward / np.maximum(length, 1e-30)[:, None]
    _add_planes(quadric, (start, end), upright, point.take(start, 0), weights * length**2)
    return quadric


def _feature_quadric(corners: Ints, features: SharpFeatures, area: Array) -> Array:
    """Return the quadrics (10, n) of vertices, from the planes of all corners of their triangles.

    corners: (3, t), of the triangles; features: n planes; area: (t,), metres².
    """
    count = len(features.point)
    own, quadric = np.zeros((2, len(_PAIRS[0]), count))
    _add_planes(own, (np.arange(count),), features.normal, features.point, np.ones(count))
    for column, values in zip(quadric, own, strict=True):
        a, b, c = (values.take(corner) for corner in corners)
        mean = (a + b + c) / 3 * area  # `mean` along so short an axis takes several times as long
        for corner in corners:
            column += np.bincount(corner, mean, count)
    return quadric


def _add_planes(quadric: Array, vertices: Iterable[Ints], normal: Array, point: Array, weight: Array) -> None:
    """Add m planes to the quadrics (10, n) of vertices.

    vertices: several lists (m,) of vertices; normal, point: (m, 3), of the planes; weight: (m,).
    """
    plane = *np.ascontiguousarray(normal.T), -np.einsum("ij,ij->i", normal, point)
    for column, one, other in zip(quadric, *_PAIRS, strict=True):
        values = plane[one] * plane[other] * weight
        for vertex in vertices:
            column += np.bincount(vertex, values, quadric.shape[1])
