"""Signed distance fields: the clay of the demo's sculptures.

A field is a function from points (N, 3) float32 to distances (N,) float32, negative inside. Units are the caller's.
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
    """Euclidean length over the last axis."""
    squared: NDArray[np.float32] = np.einsum("...i,...i->...", v, v)
    return np.sqrt(squared)


def ellipsoid(p: Points, centre: ArrayLike, radii: ArrayLike) -> Distance:
    """First-order distance to an axis-aligned ellipsoid (exact for a sphere)."""
    r = np.asarray(radii, np.float32)
    q = (p - np.asarray(centre, np.float32)) / r
    k0 = length(q)
    k1 = length(q / r)
    scale = np.where(k1 > 1e-6, k0 / np.maximum(k1, 1e-6), r.min())  # undefined in the very centre
    return scale * (k0 - 1)


def rod(p: Points, a: ArrayLike, b: ArrayLike, ra: float, rb: float) -> Distance:
    """Return a capsule from `a` to `b` whose radius goes linearly from `ra` to `rb`."""
    a = np.asarray(a, np.float32)
    ab = np.asarray(b, np.float32) - a
    t = np.clip((p - a) @ ab / np.float32(ab @ ab), 0, 1)
    return length(p - a - t[:, None] * ab) - (ra + (rb - ra) * t)


def box(p: Points, centre: ArrayLike, half: ArrayLike, rounding: float = 0.0) -> Distance:
    """Return an axis-aligned box of half extents `half`, its edges rounded."""
    q = np.abs(p - np.asarray(centre, np.float32)) - (np.asarray(half, np.float32) - rounding)
    return length(np.maximum(q, 0)) + np.minimum(q.max(axis=1), 0) - np.float32(rounding)


def disc(p: Points, y: float, radius: float, half_height: float, rounding: float) -> Distance:
    """Return a cylinder about +Y with centre height `y`, its rims rounded."""
    radial = np.hypot(p[:, 0], p[:, 2]) - (radius - rounding)
    axial = np.abs(p[:, 1] - y) - (half_height - rounding)
    outside = np.hypot(np.maximum(radial, 0), np.maximum(axial, 0))
    return outside + np.minimum(np.maximum(radial, axial), 0) - np.float32(rounding)


def union(a: Distance, b: Distance, blend: float) -> Distance:
    """Union whose seam is filled over the width `blend` (polynomial smooth minimum)."""
    h = np.maximum(blend - np.abs(a - b), 0) / np.float32(blend)
    return np.minimum(a, b) - h * h * np.float32(0.25 * blend)


def intersection(a: Distance, b: Distance, blend: float) -> Distance:
    """Return what `a` and `b` share, with the edge between them rounded by `blend`."""
    return -union(-a, -b, blend)


def difference(a: Distance, b: Distance, blend: float) -> Distance:
    """Return `a` without `b`."""
    return intersection(a, -b, blend)


def mirrored(p: Points) -> Points:
    """Return the points folded onto x ≥ 0."""
    folded = p.copy()
    folded[:, 0] = np.sqrt(p[:, 0] ** 2 + np.float32(MIRROR_WIDTH**2))
    return folded


def turned(p: Points, about: Vec3, axis: int, degrees: float) -> Points:
    """Return the points seen from a frame turned by `degrees` about an axis (0, 1, 2 = x, y, z) through `about`.

    A shape evaluated at the result stands turned by that angle, counter-clockwise seen from the axis' tip.
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
    """One stroke of the sculptor: an ellipsoid added (or cut), turned about its own centre."""

    centre: Vec3
    radii: Vec3
    blend: float
    cut: bool = False
    turn: tuple[int, float] | None = None  # (axis, degrees)

    def distance(self, p: Points) -> Distance:
        """Return the signed distance of the points (n, 3) to the ellipsoid, (n,)."""
        q = p if self.turn is None else turned(p, self.centre, *self.turn)
        return ellipsoid(q, self.centre, self.radii)


@dataclass(frozen=True)
class Rod:
    """One stroke of the sculptor: a tapered capsule added (or cut)."""

    a: Vec3
    b: Vec3
    ra: float
    rb: float
    blend: float
    cut: bool = False

    def distance(self, p: Points) -> Distance:
        """Return the signed distance of the points (n, 3) to the capsule, (n,)."""
        return rod(p, self.a, self.b, self.ra, self.rb)


Stroke = Blob | Rod


def sculpt(p: Points, d: Distance, strokes: Iterable[Stroke]) -> Distance:
    """Apply the strokes to the field `d` at `p`, in order."""
    for stroke in strokes:
        d = (difference if stroke.cut else union)(d, stroke.distance(p), stroke.blend)
    return d
