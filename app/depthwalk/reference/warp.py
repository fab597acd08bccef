"""Warp depth samples, as the twin of shaders/warp/warp.vert, and undo it as shaders/composite/composite.frag does.

A depth sample moves within a plane that touches its object, toward the epipole, the viewer's projection onto that plane
(Liu, Liu and Wu 2007, §2.2 and §3.2). A position X on the plane shows the point P for which X lies on the ray from the
viewer C through P; λ = 1 − Table(depth) tells how far along that ray the point is.
"""

import numpy as np

from depthwalk.render.impostors.warp_planes import Planes
from depthwalk.types import Array


def table(depth: Array, distance: float) -> Array:
    """Return Table(depth) = 1 / (1 + D_t / depth): the fraction of the way to the epipole that a sample moves (§2.2).

    Parameters
    ----------
    depth
        Depth of the samples behind the plane, metres, any shape.
    distance
        D_t, distance of the viewer to the plane, metres.

    Returns
    -------
    Array
        0 to 1, of the shape of `depth`; 0 for samples on the plane, which do not move.
    """
    return depth / (depth + distance)


def warp(points: Array, planes: Planes) -> tuple[Array, Array]:
    """Warp one point per plane: move its projection S onto the plane toward the epipole e, the viewer's projection.

    S moves to the point X of the plane for which X − e = λ (S − e).

    Parameters
    ----------
    points
        (n, 3) points in the frames of their objects, metres.
    planes
        The n planes that the points are warped in.

    Returns
    -------
    position : Array
        (n, 2) X − e, in the axes `right` and `up` of the planes, metres.
    lam : Array
        (n,) λ = D_t / (D_t + depth) = 1 − Table(depth), with D_t the distance of the viewer to the plane and `depth`
        that of the point behind it.
    """
    depth = planes.offset - np.einsum("ni,ni->n", points, planes.normal)
    lam = planes.distance / (planes.distance + depth)
    on_plane = np.stack([np.einsum("ni,ni->n", points, axis) for axis in (planes.right, planes.up)], -1)
    return lam[:, None] * (on_plane - planes.epipole), lam


def unwarp(position: Array, lam: Array, viewer: Array, planes: Planes) -> Array:
    """Return the points P that warped positions X show: P = C + (X − C) / λ, the inverse of `warp`.

    Parameters
    ----------
    position
        (n, 2) the positions X on the planes, in their axes `right` and `up`, relative to the epipoles, metres.
    lam
        (n,) λ of each point, as `warp` returns it.
    viewer
        (n, 3) or (3,) the viewer C in the frames of the objects, metres.
    planes
        The n planes that the points were warped in.

    Returns
    -------
    Array
        (n, 3) points in the frames of their objects, metres.
    """
    ray = position[:, :1] * planes.right + position[:, 1:] * planes.up - planes.distance[:, None] * planes.normal
    return viewer + ray / lam[:, None]
