"""Twin of shaders/common/meso.glsl at full resolution: where a tile of relief lies on an object, what it does there."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from depthwalk.bake.images import Face, face_outward
from depthwalk.bake.meso import Meso, straight_share
from depthwalk.types import Array


@dataclass(frozen=True)
class RenderWorld:
    """The tile at n points. uv: (n, 2) in tiles; outward: (n, 3), what its depth is below; right, up: (n, 3) metres of
    the tile per metre on the object, along the tile's axes."""

    uv: Array
    outward: Array
    right: Array
    up: Array

    def relief(self, meso: Meso) -> tuple[Array, Array]:
        """Depth (n,), metres, and its gradient (n, 3)."""
        depth, *slopes = relief_at(meso, self.uv).T
        return depth, slopes[0][:, None] * self.right + slopes[1][:, None] * self.up


def wind(points: Array, meso: Meso, radius: float) -> RenderWorld:
    """The tile at points (n, 3), object frame, as it winds round the axis. radius: the cylinder's."""
    x, y, z = points.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    distance = np.hypot(x, z)
    turns = meso.tiles_per_turn(radius)
    across = np.stack([z, zero, -x], -1) / distance[:, None]
    return RenderWorld(
        np.stack([-np.arctan2(z, x) / (2 * np.pi) * turns, y / meso.tile[1]], -1),
        np.stack([x, zero, z], -1) / distance[:, None],
        across * (_even_radius(meso, radius) / distance)[:, None],
        np.stack([zero, one, zero], -1),
    )


def lay(points: Array, face: Face, meso: Meso) -> RenderWorld:
    """The tile at points (n, 3), object frame, as a cap or a flank has it by itself."""
    outward = face_outward(face)
    up = np.array([0, 0, -outward[1]]) if outward[1] else np.array([0.0, 1.0, 0.0])  # seen from outside
    right = np.cross(up, outward)
    uv = np.stack([points @ right / meso.tile[0], points @ up / meso.tile[1]], -1)
    return RenderWorld(uv, *(np.broadcast_to(axis, points.shape) for axis in (outward, right, up)))


def relief_at(meso: Meso, uv: Array) -> Array:
    """Bilinear values (n, 3) of `meso.relief` at uv (n, 2), in tiles."""
    height, width = meso.relief.shape[:2]
    at = np.stack([uv[:, 1] * height - 0.5, uv[:, 0] * width - 0.5])
    channels = [map_coordinates(meso.relief[..., k], at, order=1, mode="grid-wrap") for k in range(3)]
    return np.stack(channels, -1)


def displaced(points: Array, normals: Array, face: Face, meso: Meso, radius: float) -> Array:
    """Points (n, 3), with unit normals (n, 3), moved straight below `face`, a cap or a flank, by their share of that,
    and then toward the axis, within the shallow radius by less."""
    if face is not Face.SIDE:
        straight = lay(points, face, meso)
        share = straight_share(normals, straight.outward, wind(points, meso, radius).outward)
        points = points - (share * straight.relief(meso)[0])[:, None] * straight.outward
    wound = wind(points, meso, radius)
    depth = wound.relief(meso)[0] * np.minimum(np.hypot(points[:, 0], points[:, 2]) / _shallow_radius(meso, radius), 1)
    return points - depth[:, None] * wound.outward


def tilted(normals: Array, points: Array, face: Face, meso: Meso, radius: float) -> Array:
    """Unit normals (n, 3) of the displaced surface at displaced points (n, 3), from those of the smooth one.

    A displacement of p by −d(p)·o changes normals by the transposed inverse of 1 − o·∇dᵀ: to first order, n + (n·o)·∇d.
    """
    wound, shallow = wind(points, meso, radius), _shallow_radius(meso, radius)
    depth, gradient = wound.relief(meso)
    out = depth * np.minimum(np.hypot(points[:, 0], points[:, 2]) / (shallow - depth), 1)
    before = points + out[:, None] * wound.outward
    if face is not Face.SIDE:
        straight = lay(before, face, meso)
        share = straight_share(normals, straight.outward, wound.outward)
        normals = normals + share[:, None] * straight.relief(meso)[1]
    deep = np.minimum(np.hypot(before[:, 0], before[:, 2]) / shallow, 1)[:, None]
    gradient = deep * gradient + np.where(deep < 1, (depth / shallow)[:, None] * wound.outward, 0)
    changed = normals + np.einsum("ni,ni->n", normals, wound.outward)[:, None] * gradient
    return changed / np.linalg.norm(changed, axis=1, keepdims=True)


def _even_radius(meso: Meso, radius: float) -> float:
    """Where a whole number of tiles goes round the axis, each as wide as it says."""
    return meso.tiles_per_turn(radius) * meso.tile[0] / (2 * np.pi)


def _shallow_radius(meso: Meso, radius: float) -> float:
    return max(_even_radius(meso, radius) / 3, 2 * meso.height)
