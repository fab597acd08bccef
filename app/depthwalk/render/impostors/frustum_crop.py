"""Crop the outlines of impostors on their planes to what the camera sees.

Arrays have one row for each of n planes, and are float64.
"""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from depthwalk.geometry.quaternions import matrices
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.render.impostors.warp_planes import Planes, diagonals_of
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
    corners = _crossings(np.concatenate([edges, sides], 1))
    within = (_evaluate(edges, corners) >= -_SLACK).all(-1)
    scale = np.abs(sides).max(-1)[:, None] + 1e-12
    reach = 1 + np.abs(corners).sum(-1)
    ahead = (_evaluate(sides, corners) >= -_SLACK * scale * reach[..., None]).all(-1)
    inside = within & ahead
    low = np.where(inside[..., None], corners, np.inf).min(1)
    high = np.where(inside[..., None], corners, -np.inf).max(1)
    visible = (high > low).all(-1)
    low, high = (np.where(visible[:, None], bound, planes.low) for bound in (low, high))
    pixel_low, pixel_high = _pixel_bounds(view, guard, _in_camera(camera, planes.distance, corners), inside)
    return replace(planes, low=low, high=high, diagonals=diagonals_of(corners, inside, low, high)), PlaneVisibility(
        camera=camera,
        visible=visible,
        whole=~(within & ~ahead).any(1),
        pixel_low=pixel_low,
        pixel_high=pixel_high,
    )


def _edge_lines(planes: Planes) -> Array:
    """Return the lines (n, 8, 3) of the outlines' edges; line · (s, v, 1) is positive inside."""
    width, height = np.maximum(planes.high - planes.low, 1e-12).T
    zero, one = np.zeros_like(width), np.ones_like(width)
    x = np.stack([1 / width, zero, -planes.low[:, 0] / width], -1)
    y = np.stack([zero, 1 / height, -planes.low[:, 1] / height], -1)
    lines = []
    for value, least, greatest in (
        (x, zero, one),
        (y, zero, one),
        (x + y, *planes.diagonals[:, :2].T),
        (x - y, *planes.diagonals[:, 2:].T),
    ):
        lines.append(value - np.stack([zero, zero, least], -1))
        lines.append(np.stack([zero, zero, greatest], -1) - value)
    return np.stack(lines, 1)


def _side_lines(camera: Array, distance: Array, tan_x: float, tan_y: float) -> Array:
    """Return the lines (n, 4, 3) where the frustum's sides cut the planes; line · (s, v, 1) is positive inside."""
    right, up, forward = camera[:, 0], camera[:, 1], camera[:, 2]
    lines = np.stack([tan_x * forward - right, tan_x * forward + right, tan_y * forward - up, tan_y * forward + up], 1)
    lines[..., 2] *= -distance[:, None]
    return lines


def _crossings(lines: Array) -> Array:
    """Return where each two of m lines (n, m, 3) meet: (n, m (m − 1) / 2, 2), far away where they are parallel."""
    one, other = np.array(list(combinations(range(lines.shape[1]), 2))).T
    meeting = np.cross(lines[:, one], lines[:, other])
    with np.errstate(all="ignore"):
        points = np.nan_to_num(meeting[..., :2] / meeting[..., 2:], nan=np.inf, posinf=1e30, neginf=-1e30)
    return np.asarray(points.clip(-1e30, 1e30))


def _evaluate(lines: Array, points: Array) -> Array:
    """Evaluate m lines (n, m, 3) at points (n, k, 2): (n, k, m)."""
    return np.asarray(points @ np.swapaxes(lines[..., :2], 1, 2) + lines[:, None, :, 2])


def _in_camera(camera: Array, distance: Array, points: Array) -> Array:
    """Return the camera coordinates (3, n, k), right, up and forward, of plane points (n, k, 2)."""
    s, v = points[..., 0], points[..., 1]
    rows = camera.transpose(1, 2, 0)[..., None]
    return np.stack([along * s + across * v - toward * distance[:, None] for along, across, toward in rows])


def _pixel_bounds(view: View, guard: float, points: Array, valid: Mask) -> tuple[Array, Array]:
    """Return bounds (n, 2) on the screen, pixels, of points, clipped to the picture widened by the guard.

    points: (3, n, k) camera coordinates; valid: (n, k), which of them to include.
    """
    x, y, z = points
    z = np.maximum(z, 1e-9)
    low, high = [], []
    for position, tangent, size in zip((x, y), view.half_extent, view.size, strict=True):
        pixels = (np.clip(position / (tangent * z), -guard, guard) + 1) / 2 * size
        low.append(np.where(valid, pixels, np.inf).min(1))
        high.append(np.where(valid, pixels, -np.inf).max(1))
    return np.stack(low, -1), np.stack(high, -1)
