"""Crop the outlines of impostors on their planes to what the camera sees.

Arrays have one row for each of n planes, and are float64.
"""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from depthwalk.geometry.quaternions import matrices
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.render.impostors.warp_planes import Planes, box_around, diagonals_around
from depthwalk.render.view.view import View
from depthwalk.types import Array, Mask

GUARD = 1.03  # the frustum is widened by this, so that a cropped tile has neighbours for filtering at its border
_SLACK = 1e-6  # of an outline's size: how far outside a corner may lie by rounding


@dataclass(frozen=True, kw_only=True)
class PlaneVisibility(StructOfArrays):
    """Hold what the camera sees of n outlines on planes.

    Attributes
    ----------
    camera : (n, 3, 3) matrices from plane coordinates (s, v, −D), D the viewer's distance to the plane, to camera
        coordinates (right, up, forward).
    visible : (n,) whether any part of the outline is seen.
    whole : (n,) whether nothing of the outline was cut away.
    pixel_low : (n, 2) lower left bound on the screen, pixels.
    pixel_high : (n, 2) upper right bound on the screen, pixels.
    """

    camera: Array
    visible: Mask
    whole: Mask
    pixel_low: Array
    pixel_high: Array


def crop_to_frustum(
    planes: Planes, view: View, rotation: Array, guard: float = GUARD
) -> tuple[Planes, PlaneVisibility]:
    """Crop the outlines to what the camera sees, in pictures `guard` times as wide and high as the view's.

    The visible part is a convex polygon, whose corners are crossings of two of twelve lines: the outline's edges and
    the sides of the frustum. The least octagon around it becomes the outline.

    Parameters
    ----------
    planes : the planes of n objects, with the outlines to crop.
    view : the view of the picture.
    rotation : (n, 4) unit quaternions (x, y, z, w) of the objects.
    guard : the factor by which the pictures are wider and higher than the view's.

    Returns
    -------
    The planes with smaller outlines, and what the camera sees of them.
    """
    axes = view.axes @ matrices(rotation)  # (n, 3, 3) right, up, forward in the object frame
    camera = axes @ np.stack([planes.right, planes.up, planes.normal], -1)
    tan_x, tan_y = (guard * t for t in view.half_extent)
    edges, sides = _edge_lines(planes), _side_lines(camera, planes.distance, tan_x, tan_y)
    s, v = _crossings(np.concatenate([edges, sides], 1))
    within = _is_inside(edges, s, v, _SLACK)
    ahead = _is_inside(sides, s, v, _SLACK * (1 + np.abs(s) + np.abs(v)))
    inside = within & ahead
    low, high = box_around(s, v, inside)
    visible = np.asarray((high > low).all(-1))
    low, high = (np.where(visible[:, None], bound, planes.low) for bound in (low, high))
    pixel_low, pixel_high = _pixel_bounds(view, guard, _in_camera(camera, planes.distance, s, v), inside)
    return replace(planes, low=low, high=high, diagonals=diagonals_around(s, v, inside)), PlaneVisibility(
        camera=camera,
        visible=visible,
        whole=np.asarray((ahead | ~within).all(1)),
        pixel_low=pixel_low,
        pixel_high=pixel_high,
    )


def _edge_lines(planes: Planes) -> Array:
    """Return the lines (n, 8, 3) of the outlines' edges; line · (s, v, 1) is positive inside, in units of the size."""
    size = np.maximum(planes.high - planes.low, 1e-12)
    unit = np.broadcast_to(np.eye(3), (len(size), 3, 3)) / size.max(1)[:, None, None]
    s, v, one = np.moveaxis(unit, 1, 0)
    ends = np.concatenate([np.stack([planes.low, planes.high], -1).reshape(-1, 4), planes.diagonals], -1)
    lines = []
    for number, value in enumerate((s, v, s + v, s - v)):
        least, greatest = ends[:, 2 * number, None], ends[:, 2 * number + 1, None]
        lines += [value - least * one, greatest * one - value]
    return np.stack(lines, 1)


def _side_lines(camera: Array, distance: Array, tan_x: float, tan_y: float) -> Array:
    """Return the lines (n, 4, 3) where the frustum's sides cut the planes; line · (s, v, 1) is positive inside.

    Their largest numbers are 1.
    """
    right, up, forward = camera[:, 0], camera[:, 1], camera[:, 2]
    lines = np.stack([tan_x * forward - right, tan_x * forward + right, tan_y * forward - up, tan_y * forward + up], 1)
    lines[..., 2] *= -distance[:, None]
    return np.asarray(lines / (np.abs(lines).max(-1, keepdims=True) + 1e-12))


def _crossings(lines: Array) -> tuple[Array, Array]:
    """Return where each two of m lines (n, m, 3) meet, s and v (n, m (m − 1) / 2); far away if they are parallel."""
    one, other = np.array(list(combinations(range(lines.shape[1]), 2))).T
    (a, b, c), (d, e, f) = (np.moveaxis(lines[:, rows], -1, 0) for rows in (one, other))
    with np.errstate(all="ignore"):
        scale = 1 / (a * e - b * d)
        return _finite((b * f - c * e) * scale), _finite((c * d - a * f) * scale)


def _finite(values: Array) -> Array:
    """Replace numbers that are none, or too large to compute with."""
    return np.asarray(np.nan_to_num(values, nan=1e30).clip(-1e30, 1e30))


def _is_inside(lines: Array, s: Array, v: Array, slack: Array | float) -> Mask:
    """Return which points s, v (n, k) are on the positive sides of all lines (n, m, 3), or off by `slack` at most."""
    inside = np.ones(s.shape, bool)
    for a, b, c in np.moveaxis(lines, 0, -1)[..., None]:
        inside &= a * s + b * v + c >= -slack
    return inside


def _in_camera(camera: Array, distance: Array, s: Array, v: Array) -> Array:
    """Return the camera coordinates (3, n, k), right, up and forward, of points s, v (n, k) of the planes."""
    rows = camera.transpose(1, 2, 0)[..., None]
    return np.stack([along * s + across * v - toward * distance[:, None] for along, across, toward in rows])


def _pixel_bounds(view: View, guard: float, points: Array, valid: Mask) -> tuple[Array, Array]:
    """Return bounds (n, 2) on the screen, pixels, of points, clipped to the picture widened by the guard.

    points: (3, n, k) camera coordinates; valid: (n, k), which of them to include.
    """
    depth = np.maximum(points[2], 1e-9)
    x, y = (
        (np.clip(position / (tangent * depth), -guard, guard) + 1) / 2 * size
        for position, tangent, size in zip(points[:2], view.half_extent, view.size, strict=True)
    )
    return box_around(x, y, valid)
