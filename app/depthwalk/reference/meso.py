"""Twin of shaders/common/meso.glsl at full resolution: where a tile of relief lies on an object, what it does there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from depthwalk.bake.images import Face, face_outward
from depthwalk.bake.meso import Meso

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Placed:
    """The tile at n points. uv: (n, 2) in tiles; outward: (n, 3), from the surface to the image's face; right, up:
    (n, 3) metres of the tile per metre on the object, along the tile's axes."""

    uv: Array
    outward: Array
    right: Array
    up: Array


def place(points: Array, face: Face, meso: Meso, radius: float) -> Placed:
    """The tile at points (n, 3), object frame, of an image of `face`; none past the axis. radius: the cylinder's."""
    x, y, z = points.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    width, height = meso.tile
    if face is Face.SIDE:
        turns = meso.tiles_per_turn(radius)
        distance = np.hypot(x, z)
        across = np.stack([z, zero, -x], -1) / distance[:, None]
        return Placed(
            np.stack([-np.arctan2(z, x) / (2 * np.pi) * turns, y / height], -1),
            np.stack([x, zero, z], -1) / distance[:, None],
            across * (turns * width / (2 * np.pi * distance))[:, None],
            np.stack([zero, one, zero], -1),
        )
    outward = face_outward(face)
    up = np.array([0, 0, -outward[1]]) if outward[1] else np.array([0.0, 1.0, 0.0])  # seen from outside
    right = np.cross(up, outward)
    uv = np.stack([points @ right / width, points @ up / height], -1)
    return Placed(uv, *(np.broadcast_to(axis, points.shape) for axis in (outward, right, up)))


def relief_at(meso: Meso, uv: Array) -> Array:
    """Bilinear values (n, 3) of `meso.relief` at uv (n, 2), in tiles."""
    height, width = meso.relief.shape[:2]
    at = np.stack([uv[:, 1] * height - 0.5, uv[:, 0] * width - 0.5])
    channels = [map_coordinates(meso.relief[..., k], at, order=1, mode="grid-wrap") for k in range(3)]
    return np.stack(channels, -1)


def displaced(points: Array, face: Face, meso: Meso, radius: float) -> Array:
    """Points (n, 3) moved inward along the direction that `face` measures depth in; not past half of the way to the
    axis."""
    placed = place(points, face, meso, radius)
    depth = relief_at(meso, placed.uv)[:, 0]
    if face is Face.SIDE:
        depth = np.minimum(depth, np.hypot(points[:, 0], points[:, 2]) / 2)
    return points - depth[:, None] * placed.outward


def tilted(normals: Array, points: Array, face: Face, meso: Meso, radius: float) -> Array:
    """Unit normals (n, 3) of the displaced surface at displaced points (n, 3), from those of the smooth one.

    The surface is a graph over its face: its normal, scaled to be 1 outward, changes by the gradient of the depth.
    """
    placed = place(points, face, meso, radius)
    slope = relief_at(meso, placed.uv)[:, 1:]
    gradient = slope[:, :1] * placed.right + slope[:, 1:] * placed.up
    facing = np.maximum(np.einsum("ni,ni->n", normals, placed.outward), 0)
    changed = normals + facing[:, None] * gradient
    return changed / np.linalg.norm(changed, axis=1, keepdims=True)
