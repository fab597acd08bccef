"""Twin of shaders/warp/warp.vert and of the reconstruction in composite.frag."""

import numpy as np

from depthwalk.render.impostors.warp_planes import Planes
from depthwalk.types import Array


def table(depth: Array, distance: float) -> Array:
    """Table(depth) = 1 / (1 + D_t / depth): the part of the way to the epipole that a sample moves (Liu et al. 2007,
    §2.2). depth (…) behind the plane and distance D_t of the viewer to it, metres; 0 at depth 0."""
    return depth / (depth + distance)


def warp(points: Array, planes: Planes) -> tuple[Array, Array]:
    """Positions (n, 2) on the plane relative to the epipole, and λ = 1 − Table (n,), of one point (n, 3) per plane."""
    depth = planes.offset - np.einsum("ni,ni->n", points, planes.normal)
    lam = planes.distance / (planes.distance + depth)
    on_plane = np.stack([np.einsum("ni,ni->n", points, axis) for axis in (planes.right, planes.up)], -1)
    return lam[:, None] * (on_plane - planes.epipole), lam


def unwarp(position: Array, lam: Array, viewer: Array, planes: Planes) -> Array:
    """The point (n, 3) behind `position` (n, 2) on the plane: P = C + (X − C) / λ."""
    ray = position[:, :1] * planes.right + position[:, 1:] * planes.up - planes.distance[:, None] * planes.normal
    return viewer + ray / lam[:, None]
