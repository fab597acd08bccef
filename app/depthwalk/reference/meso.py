"""Displace points by meso-structure, a tiling relief, as the twin of shaders/common/meso.glsl at full resolution.

A tile of relief modulates the depth of an object's depth images before they are warped (Liu, Liu and Wu 2007, §3.4).
The tile winds around the object's axis and moves all points toward that axis, whichever depth image they belong to, so
that the images stay joined. Surfaces that face along the axis would then only slide along themselves; so caps and box
faces also have the relief straight below them, by the share that `bake.meso.straight_share` gives.

The shader fades relief that covers few pixels; the twin always displaces by all of it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from depthwalk.bake.images import Face, face_outward
from depthwalk.bake.meso import Meso, straight_share
from depthwalk.types import Array


@dataclass(frozen=True, kw_only=True)
class TilePlacement:
    """Hold the positions of n points on the tile of relief, and the tile's orientation at each of them.

    Attributes
    ----------
    uv
        (n, 2) positions on the tile, in widths and heights of the tile; the tile repeats.
    outward
        (n, 3) unit vectors out of the surface that the tile lies on, object frame; depth is measured against them.
    right, up
        (n, 3) the tile's two axes, object frame. Their lengths are metres on the tile per metre on the object.
    """

    uv: Array
    outward: Array
    right: Array
    up: Array

    def relief(self, meso: Meso) -> tuple[Array, Array]:
        """Return the depth (n,) of the relief `meso` at each point, metres, and its gradient (n, 3), object frame.

        The gradient is in metres of depth per metre on the object.
        """
        depth, *slopes = relief_at(meso, self.uv).T
        return depth, slopes[0][:, None] * self.right + slopes[1][:, None] * self.up


def wind(points: Array, meso: Meso, radius: float) -> TilePlacement:
    """Place the tile at points, wound around the object's axis.

    Parameters
    ----------
    points
        (n, 3) points in the object's frame, metres.
    meso
        The tile of relief.
    radius
        The radius of the object's cylinder, metres, which determines how many tiles go round it.

    Returns
    -------
    TilePlacement
        The tile at each point.
    """
    x, y, z = points.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    distance = np.hypot(x, z)
    turns = meso.tiles_per_turn(radius)
    across = np.stack([z, zero, -x], -1) / distance[:, None]
    return TilePlacement(
        uv=np.stack([-np.arctan2(z, x) / (2 * np.pi) * turns, y / meso.tile[1]], -1),
        outward=np.stack([x, zero, z], -1) / distance[:, None],
        right=across * (_even_radius(meso, radius) / distance)[:, None],
        up=np.stack([zero, one, zero], -1),
    )


def lay(points: Array, face: Face, meso: Meso) -> TilePlacement:
    """Place the tile at points, flat on a planar face.

    Parameters
    ----------
    points
        (n, 3) points in the object's frame, metres.
    face
        The face, a cap or a box face.
    meso
        The tile of relief.

    Returns
    -------
    TilePlacement
        The tile at each point.
    """
    outward = face_outward(face)
    up = np.array([0, 0, -outward[1]]) if outward[1] else np.array([0.0, 1.0, 0.0])  # as seen from outside
    right = np.cross(up, outward)
    return TilePlacement(
        uv=np.stack([points @ right / meso.tile[0], points @ up / meso.tile[1]], -1),
        outward=np.broadcast_to(outward, points.shape),
        right=np.broadcast_to(right, points.shape),
        up=np.broadcast_to(up, points.shape),
    )


def relief_at(meso: Meso, uv: Array) -> Array:
    """Return the values (n, 3) of `meso.relief` at positions `uv` (n, 2), in tiles, interpolated bilinearly.

    The relief repeats without end: depth is in metres, its two slopes in metres per metre.
    """
    height, width = meso.relief.shape[:2]
    at = np.stack([uv[:, 1] * height - 0.5, uv[:, 0] * width - 0.5])
    channels = [map_coordinates(meso.relief[..., k], at, order=1, mode="grid-wrap") for k in range(3)]
    return np.stack(channels, -1)


def displaced(points: Array, normals: Array, face: Face, meso: Meso, radius: float) -> Array:
    """Displace points by the relief of a meso-structure.

    Points of a cap or a box face first move straight inward from that face, by the share of the relief that
    `bake.meso.straight_share` gives. Then all points move toward the axis. Near the axis they move less, so that no
    point crosses it.

    Parameters
    ----------
    points
        (n, 3) points in the object's frame, metres.
    normals
        (n, 3) their unit normals, object frame.
    face
        The face whose depth image they belong to.
    meso
        The tile of relief.
    radius
        The radius of the object's cylinder, metres.

    Returns
    -------
    Array
        (n, 3) points in the object's frame, metres.
    """
    if face is not Face.SIDE:
        straight = lay(points, face, meso)
        share = straight_share(normals, straight.outward, wind(points, meso, radius).outward)
        points = points - (share * straight.relief(meso)[0])[:, None] * straight.outward
    wound = wind(points, meso, radius)
    depth = wound.relief(meso)[0] * np.minimum(np.hypot(points[:, 0], points[:, 2]) / _shallow_radius(meso, radius), 1)
    return points - depth[:, None] * wound.outward


def tilted(normals: Array, points: Array, face: Face, meso: Meso, radius: float) -> Array:
    """Return the unit normals of the displaced surface.

    A displacement of p by −d(p)·o changes normals by the transposed inverse of 1 − o·∇dᵀ: to first order n becomes
    n + (n·o)·∇d.

    Parameters
    ----------
    normals
        (n, 3) unit normals of the surface before it was displaced, object frame.
    points
        (n, 3) displaced points in the object's frame, metres: what `displaced` returns.
    face, meso, radius
        The values that `displaced` was given.

    Returns
    -------
    Array
        (n, 3) unit normals, object frame.
    """
    wound, shallow = wind(points, meso, radius), _shallow_radius(meso, radius)
    depth, gradient = wound.relief(meso)
    out = depth * np.minimum(np.hypot(points[:, 0], points[:, 2]) / (shallow - depth), 1)
    before = points + out[:, None] * wound.outward
    if face is not Face.SIDE:
        straight = lay(before, face, meso)
        share = straight_share(normals, straight.outward, wound.outward)
        normals = normals + share[:, None] * straight.relief(meso)[1]
    fraction = np.minimum(np.hypot(before[:, 0], before[:, 2]) / shallow, 1)[:, None]  # of the depth, near the axis
    gradient = fraction * gradient + np.where(fraction < 1, (depth / shallow)[:, None] * wound.outward, 0)
    changed = normals + np.einsum("ni,ni->n", normals, wound.outward)[:, None] * gradient
    return np.asarray(changed / np.linalg.norm(changed, axis=1, keepdims=True))


def _even_radius(meso: Meso, radius: float) -> float:
    """Return the radius, metres, at which a whole number of tiles, each of its own width, goes around the axis."""
    return meso.tiles_per_turn(radius) * meso.tile[0] / (2 * np.pi)


def _shallow_radius(meso: Meso, radius: float) -> float:
    """Return the distance from the axis, metres, within which the relief is made shallower."""
    return max(_even_radius(meso, radius) / 3, 2 * meso.height)
