"""Compute signed distance fields, the clay of the demo's sculptures; `meshing.polygonise` makes meshes of them.

A field is a function from points `p` (n, 3) float32 to distances (n,) float32, negative inside. All lengths are in one
unit, which the caller chooses. The shapes and the smooth union are Quilez's ("Distance functions", "Smooth minimum").
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Points = NDArray[np.float32]
Distance = NDArray[np.float32]
Field = Callable[[Points], Distance]
Vec3 = tuple[float, float, float]

MIRROR_WIDTH = 0.15  # rounds the crease that mirroring would leave in the plane x = 0


def length(v: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the Euclidean lengths (…,) of the vectors `v` (…, 3)."""
    squared: NDArray[np.float32] = np.einsum("...i,...i->...", v, v)
    return np.sqrt(squared)


def ellipsoid(p: Points, centre: ArrayLike, radii: ArrayLike) -> Distance:
    """Return the distances (n,) of `p` (n, 3) to an ellipsoid about `centre` (3,) with the half axes `radii` (3,).

    Its axes are x, y and z. The distances are of first order, and exact for a sphere.
    """
    r = np.asarray(radii, np.float32)
    q = (p - np.asarray(centre, np.float32)) / r
    k0 = length(q)
    k1 = length(q / r)
    scale = np.where(k1 > 1e-6, k0 / np.maximum(k1, 1e-6), r.min())  # undefined in the very centre
    return scale * (k0 - 1)


def rod(p: Points, a: ArrayLike, b: ArrayLike, ra: float, rb: float) -> Distance:
    """Return the distances (n,) of `p` (n, 3) to a capsule from `a` (3,) to `b` (3,), with radii from `ra` to `rb`."""
    a = np.asarray(a, np.float32)
    ab = np.asarray(b, np.float32) - a
    t = np.clip((p - a) @ ab / np.float32(ab @ ab), 0, 1)
    return length(p - a - t[:, None] * ab) - (ra + (rb - ra) * t)


def box(p: Points, centre: ArrayLike, half: ArrayLike, rounding: float = 0.0) -> Distance:
    """Return the distances (n,) of `p` (n, 3) to a box about `centre` (3,) with the half extents `half` (3,).

    It is aligned with the axes, and its edges are rounded with the radius `rounding`.
    """
    q = np.abs(p - np.asarray(centre, np.float32)) - (np.asarray(half, np.float32) - rounding)
    return length(np.maximum(q, 0)) + np.minimum(q.max(axis=1), 0) - np.float32(rounding)


def disc(p: Points, y: float, radius: float, half_height: float, rounding: float) -> Distance:
    """Return the distances (n,) of `p` (n, 3) to a cylinder about the y axis with its centre at height `y`.

    It is twice `half_height` high and has the radius `radius`; its rims are rounded with the radius `rounding`.
    """
    radial = np.hypot(p[:, 0], p[:, 2]) - (radius - rounding)
    axial = np.abs(p[:, 1] - y) - (half_height - rounding)
    outside = np.hypot(np.maximum(radial, 0), np.maximum(axial, 0))
    return outside + np.minimum(np.maximum(radial, axial), 0) - np.float32(rounding)


def union(a: Distance, b: Distance, blend: float) -> Distance:
    """Return the distances (n,) to the union of two shapes, by the polynomial smooth minimum.

    `a` and `b` (n,) are the distances to the shapes; the seam between them is filled over the width `blend`.
    """
    h = np.maximum(blend - np.abs(a - b), 0) / np.float32(blend)
    return np.minimum(a, b) - h * h * np.float32(0.25 * blend)


def intersection(a: Distance, b: Distance, blend: float) -> Distance:
    """Return the distances (n,) to the part that two shapes share, its edge rounded over the width `blend`.

    `a` and `b` (n,) are the distances to the shapes.
    """
    return -union(-a, -b, blend)


def difference(a: Distance, b: Distance, blend: float) -> Distance:
    """Return the distances (n,) to a shape from which another is cut, the edge rounded over the width `blend`.

    `a` and `b` (n,) are the distances to the shape and to the other.
    """
    return intersection(a, -b, blend)


def mirrored(p: Points) -> Points:
    """Return the points `p` (n, 3) folded onto x ≥ 0, so that a shape which is modelled there appears on both sides."""
    folded = p.copy()
    folded[:, 0] = np.sqrt(p[:, 0] ** 2 + np.float32(MIRROR_WIDTH**2))
    return folded


def turned(p: Points, about: Vec3, axis: int, degrees: float) -> Points:
    """Return the points `p` (n, 3) in a frame turned by `degrees` about an `axis` (0, 1, 2 = x, y, z) through `about`.

    A shape whose distance is computed at the result (n, 3) stands turned by that angle, counter-clockwise for a viewer
    at the axis' tip.
    """
    u, v = (axis + 1) % 3, (axis + 2) % 3
    c, s = np.float32(np.cos(np.radians(degrees))), np.float32(np.sin(np.radians(degrees)))
    q = p.copy()
    du, dv = p[:, u] - np.float32(about[u]), p[:, v] - np.float32(about[v])
    q[:, u] = np.float32(about[u]) + c * du + s * dv
    q[:, v] = np.float32(about[v]) - s * du + c * dv
    return q


@dataclass(frozen=True)
class Blob:
    """Describe a stroke of the sculptor that adds or cuts an ellipsoid.

    Attributes
    ----------
    centre, radii
        Centre and half axes of the ellipsoid.
    blend
        Width over which the seam is rounded.
    cut
        Whether the ellipsoid is cut out; otherwise it is added.
    turn
        Axis (0, 1, 2 = x, y, z) and degrees by which the ellipsoid is turned about its centre; None leaves it as it is.
    """

    centre: Vec3
    radii: Vec3
    blend: float
    cut: bool = False
    turn: tuple[int, float] | None = None  # (axis, degrees)

    def distance(self, p: Points) -> Distance:
        """Return the signed distances (n,) of the points `p` (n, 3) to the ellipsoid."""
        q = p if self.turn is None else turned(p, self.centre, *self.turn)
        return ellipsoid(q, self.centre, self.radii)


@dataclass(frozen=True)
class Rod:
    """Describe a stroke of the sculptor that adds or cuts a tapered capsule.

    Attributes
    ----------
    a, b
        The two ends of its axis.
    ra, rb
        The radii at the two ends.
    blend
        Width over which the seam is rounded.
    cut
        Whether the capsule is cut out; otherwise it is added.
    """

    a: Vec3
    b: Vec3
    ra: float
    rb: float
    blend: float
    cut: bool = False

    def distance(self, p: Points) -> Distance:
        """Return the signed distances (n,) of the points `p` (n, 3) to the capsule."""
        return rod(p, self.a, self.b, self.ra, self.rb)


Stroke = Blob | Rod


def sculpt(p: Points, d: Distance, strokes: Iterable[Stroke]) -> Distance:
    """Return the distances `d` (n,) at the points `p` (n, 3) after `strokes`, one after the other, were applied."""
    for stroke in strokes:
        d = (difference if stroke.cut else union)(d, stroke.distance(p), stroke.blend)
    return d
