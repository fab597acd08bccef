"""Choose the plane on which pass 1 warps an object's depth images, the visible part of it, and its resolution.

Arrays have one row for each of n objects, are float64, and in the objects' frames unless said otherwise. Source: Liu et
al. 2007, §3.2 f., and docs/conventions.md.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import Face
from depthwalk.geometry.quaternions import matrices
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.geometry.support_function import support
from depthwalk.render.view.view import View
from depthwalk.types import Array, Mask

# If the viewer is nearer to every plane than this part of the radius, the object is warped straight to the screen: the
# tile of a plane at distance D needs about sqrt(2R/D) screens of texels, 4.5 screens here.
MIN_PLANE_DISTANCE = 0.1
GUARD = 1.03  # the frustum is widened by this, so that a cropped tile has neighbours for filtering at its border


@dataclass(frozen=True, kw_only=True)
class Planes(StructOfArrays):
    """Hold the warp planes of n objects, and on each the rectangle that holds the object's warped samples.

    `right` × `up` = `normal`, which points to the viewer. `crop_to_frustum` shrinks the rectangles to the view.

    Attributes
    ----------
    face : (n,) Face of the cylinder that each plane touches.
    right : (n, 3) unit vectors on the plane to the viewer's right, object frames.
    up : (n, 3) unit vectors on the plane at right angles to `right`, object frames.
    normal : (n, 3) unit vectors towards the viewer, object frames.
    distance : (n,) distance from the viewer to the plane, metres; not positive where the viewer is behind it.
    epipole : (n, 2) point of the plane nearest to the viewer, in (right, up) coordinates, metres.
    offset : (n,) distance of the plane from the object's origin along the normal, metres.
    low : (n, 2) lower left corner of each rectangle, metres, relative to the epipole.
    high : (n, 2) upper right corner of each rectangle, metres, relative to the epipole.
    """

    face: NDArray[np.intp]
    right: Array
    up: Array
    normal: Array
    distance: Array
    epipole: Array
    offset: Array
    low: Array
    high: Array

    def widened(self, margin: Array) -> "Planes":
        """Return the planes with rectangles widened by `margin` (n, 2), metres, on every side."""
        return replace(self, low=self.low - margin, high=self.high + margin)


@dataclass(frozen=True, kw_only=True)
class Volumes(StructOfArrays):
    """Hold the cylinders of n objects, whose axes are the y axes of the objects' frames.

    Attributes
    ----------
    radius : (n,) metres.
    bottom : (n,) height of the lower end, metres.
    top : (n,) height of the upper end, metres.
    footprint : (n, DIRECTIONS) how far the samples reach from the axis, metres, see `geometry.support_function`.
    has_side : (n,) whether the object has a side image; false for planar images.
    """

    radius: Array
    bottom: Array
    top: Array
    footprint: Array
    has_side: Mask


def warp_faces(viewer: Array, volumes: Volumes) -> tuple[NDArray[np.intp], Array]:
    """Choose the face in whose plane each of n objects is warped: the one that the viewer is farthest in front of.

    Where the distance is not positive, the viewer is inside the cylinder, or behind a planar image.

    Parameters
    ----------
    viewer : (n, 3) the viewer in the objects' frames, metres.
    volumes : the cylinders of n objects.

    Returns
    -------
    The Face (n,), and the viewer's distance (n,) to its plane, metres.
    """
    above = viewer[:, 1] - volumes.top
    beside = np.hypot(viewer[:, 0], viewer[:, 2]) - volumes.radius
    below = volumes.bottom - viewer[:, 1]
    beside, below = (np.where(volumes.has_side, gap, -np.inf) for gap in (beside, below))
    distances = np.stack([above, beside, below])
    face = distances.argmax(axis=0)
    return face, distances.max(axis=0)


def choose_planes(viewer: Array, volumes: Volumes) -> Planes:
    """Return the planes that `warp_faces` finds, with rectangles that hold all warped samples.

    Parameters
    ----------
    viewer : (n, 3) the viewer in the objects' frames, metres.
    volumes : the cylinders of n objects.

    Returns
    -------
    The n planes.
    """
    v = volumes
    face, distance = warp_faces(viewer, volumes)
    rho = np.hypot(viewer[:, 0], viewer[:, 2])
    side, above = face == Face.SIDE, face == Face.TOP

    outward = viewer[:, [0, 2]] / np.maximum(rho, 1e-12)[:, None]
    zero, one = np.zeros_like(rho), np.ones_like(rho)
    right = np.where(side[:, None], np.stack([outward[:, 1], zero, -outward[:, 0]], -1), [1.0, 0.0, 0.0])
    toward = np.where(above, -one, one)
    up = np.where(side[:, None], [0.0, 1.0, 0.0], np.stack([zero, zero, toward], -1))
    vertical = np.stack([zero, -toward, zero], -1)
    normal = np.where(side[:, None], np.stack([outward[:, 0], zero, outward[:, 1]], -1), vertical)
    epipole = np.stack([np.einsum("ni,ni->n", viewer, right), np.einsum("ni,ni->n", viewer, up)], -1)
    offset = np.einsum("ni,ni->n", viewer, normal) - distance
    low, high = _rectangles(v, side, right, up, distance, epipole)
    return Planes(
        face=face,
        right=right,
        up=up,
        normal=normal,
        distance=distance,
        epipole=epipole,
        offset=offset,
        low=low - epipole,
        high=high - epipole,
    )


def depths_behind(planes: Planes, volumes: Volumes) -> Array:
    """Return bounds on the depths of the samples of n objects behind their warp planes.

    Parameters
    ----------
    planes : the planes of the n objects.
    volumes : the cylinders of the n objects.

    Returns
    -------
    (n, 2) least and greatest depth, metres.
    """
    v, side = volumes, planes.face == Face.SIDE
    toward, away = (np.minimum(support(v.footprint, way * planes.normal[:, [0, 2]]), v.radius) for way in (1, -1))
    nearest, farthest = np.where(side, v.radius - toward, 0), np.where(side, v.radius + away, v.top - v.bottom)
    return np.stack([nearest, farthest], -1)


def _rectangles(
    v: Volumes, side: Mask, right: Array, up: Array, distance: Array, epipole: Array
) -> tuple[Array, Array]:
    """Return the corners (n, 2) of rectangles that hold all samples within the footprint, warped onto their planes.

    A point moves toward the epipole by 1 − λ, and λ is least at the far side of the cylinder, so the bounds lie at
    λ = 1 or at that λ (docs/conventions.md).
    """
    distance = np.maximum(distance, 1e-9)
    behind = np.where(side, 2 * v.radius, v.top - v.bottom)
    far = (distance / (distance + behind))[:, None]
    first, last = (
        way * np.stack([support(v.footprint, way * axis[:, [0, 2]]) for axis in (right, up)], -1) for way in (-1, 1)
    )
    first[:, 1], last[:, 1] = np.where(side, v.bottom, first[:, 1]), np.where(side, v.top, last[:, 1])
    low = np.minimum(first, epipole + far * (first - epipole))
    high = np.maximum(last, epipole + far * (last - epipole))
    silhouette = v.radius * np.sqrt(far[:, 0])  # |s| ≤ R·sqrt((ρ−R)/(ρ+R)): the tangents from the viewer to the circle
    low[:, 0] = np.where(side, np.maximum(low[:, 0], -silhouette), low[:, 0])
    high[:, 0] = np.where(side, np.minimum(high[:, 0], silhouette), high[:, 0])
    return low, high


@dataclass(frozen=True, kw_only=True)
class PlaneVisibility(StructOfArrays):
    """Hold what the camera sees of n rectangles on planes.

    Attributes
    ----------
    camera : (n, 3, 3) matrices from plane coordinates (s, v, −D), D the viewer's distance to the plane, to camera
        coordinates (right, up, forward).
    visible : (n,) whether any part of the rectangle is seen.
    whole : (n,) whether nothing of the rectangle was cut away.
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
    """Crop the rectangles to what the camera sees, in pictures `guard` times as wide and high as the view's.

    The visible part is a convex polygon. Its corners are corners of the rectangle, crossings of an edge with a side of
    the frustum, or the frustum's own corner rays. Its bounding box becomes the rectangle.

    Parameters
    ----------
    planes : the planes of n objects, with the rectangles to crop.
    view : the view of the picture.
    rotation : (n, 4) unit quaternions (x, y, z, w) of the objects.
    guard : the factor by which the pictures are wider and higher than the view's.

    Returns
    -------
    The planes with smaller rectangles, and what the camera sees of them.
    """
    axes = view.axes @ matrices(rotation)  # (n, 3, 3) right, up, forward in the object frame
    camera = axes @ np.stack([planes.right, planes.up, planes.normal], -1)
    tan_x, tan_y = (guard * t for t in view.half_extent)
    low, high = planes.low, planes.high
    corners = np.stack([np.stack([s[:, 0], v[:, 1]], -1) for s in (low, high) for v in (low, high)], 1)  # (n, 4, 2)
    seen_at = _in_camera(camera, planes.distance, corners)
    x, y, forward = seen_at
    whole = ((np.abs(x) <= tan_x * forward) & (np.abs(y) <= tan_y * forward)).all(1)
    visible = whole.copy()
    pixel_low, pixel_high = _pixel_bounds(view, guard, seen_at, whole[:, None])
    cut = np.flatnonzero(~whole)
    if len(cut):
        lines = _side_lines(camera[cut], planes.distance[cut], tan_x, tan_y)
        crossings = _edge_crossings(lines, low[cut], high[cut])
        rays = _corner_rays(camera[cut], planes.distance[cut], tan_x, tan_y)
        candidates = np.concatenate([corners[cut], crossings, rays], 1)
        slack = 1e-6 * (high - low)[cut][:, None] + 1e-12
        inside = ((candidates >= low[cut][:, None] - slack) & (candidates <= high[cut][:, None] + slack)).all(-1)
        scale = np.abs(lines).max(-1)[:, None] + 1e-12
        inside &= (_evaluate(lines, candidates) >= -1e-6 * scale * (1 + np.abs(candidates).sum(-1))[..., None]).all(-1)
        low, high = low.copy(), high.copy()
        low[cut] = np.where(inside[..., None], candidates, np.inf).min(1)
        high[cut] = np.where(inside[..., None], candidates, -np.inf).max(1)
        visible[cut] = (high[cut] > low[cut]).all(-1)
        seen_at = _in_camera(camera[cut], planes.distance[cut], candidates)
        pixel_low[cut], pixel_high[cut] = _pixel_bounds(view, guard, seen_at, inside)
    return replace(planes, low=low, high=high), PlaneVisibility(
        camera=camera, visible=visible, whole=whole, pixel_low=pixel_low, pixel_high=pixel_high
    )


def _in_camera(camera: Array, distance: Array, points: Array) -> Array:
    """Return the camera coordinates (3, n, k), right, up and forward, of plane points (n, k, 2)."""
    s, v = points[..., 0], points[..., 1]
    rows = camera.transpose(1, 2, 0)[..., None]
    return np.stack([along * s + across * v - toward * distance[:, None] for along, across, toward in rows])


def _pixel_bounds(view: View, guard: float, points: Array, valid: Mask) -> tuple[Array, Array]:
    """Return bounds (n, 2) on the screen, pixels, of points, clipped to the picture widened by the guard.

    points: (3, n, k) camera coordinates; valid: (n, k) or (n, 1), which of them to include.
    """
    x, y, z = points
    z = np.maximum(z, 1e-9)
    low, high = [], []
    for position, tangent, size in zip((x, y), view.half_extent, view.size, strict=True):
        pixels = (np.clip(position / (tangent * z), -guard, guard) + 1) / 2 * size
        low.append(np.where(valid, pixels, np.inf).min(1))
        high.append(np.where(valid, pixels, -np.inf).max(1))
    return np.stack(low, -1), np.stack(high, -1)


def _side_lines(camera: Array, distance: Array, tan_x: float, tan_y: float) -> Array:
    """Return the lines (n, 4, 3) where the frustum's sides cut the planes; line · (s, v, 1) is positive inside."""
    right, up, forward = camera[:, 0], camera[:, 1], camera[:, 2]
    lines = np.stack([tan_x * forward - right, tan_x * forward + right, tan_y * forward - up, tan_y * forward + up], 1)
    lines[..., 2] *= -distance[:, None]
    return lines


def _evaluate(lines: Array, points: Array) -> Array:
    """Evaluate lines (n, 4, 3) at points (n, k, 2): (n, k, 4), positive inside the frustum."""
    return np.asarray(points @ np.swapaxes(lines[..., :2], 1, 2) + lines[:, None, :, 2])


def _edge_crossings(lines: Array, low: Array, high: Array) -> Array:
    """Return where the lines meet the rectangles' edge lines: (n, 16, 2), far away where they are parallel."""
    a, b, c = lines[..., 0], lines[..., 1], lines[..., 2]  # (n, 4)
    points = []
    with np.errstate(all="ignore"):
        for bound in (low, high):
            s = np.broadcast_to(bound[:, :1], a.shape)
            v = np.broadcast_to(bound[:, 1:], a.shape)
            points += [np.stack([s, -(a * s + c) / b], -1), np.stack([-(b * v + c) / a, v], -1)]
    crossings = np.nan_to_num(np.concatenate(points, 1), nan=np.inf, posinf=1e30, neginf=-1e30)
    return np.asarray(crossings.clip(-1e30, 1e30))


def _corner_rays(camera: Array, distance: Array, tan_x: float, tan_y: float) -> Array:
    """Return where the frustum's corner rays meet the planes: (n, 4, 2), far away where they do not."""
    rays = np.array([[x * tan_x, y * tan_y, 1.0] for x in (-1, 1) for y in (-1, 1)])
    directions = rays @ np.swapaxes(np.linalg.inv(camera), 1, 2)  # (n, 4, 3) in plane coordinates
    toward = directions[..., 2] < -1e-9
    along = distance[:, None] / np.where(toward, -directions[..., 2], 1)
    return np.where(toward[..., None], directions[..., :2] * along[..., None], 1e30)


def tile_sizes(planes: Planes, focal_pixels: float, limit: int) -> NDArray[np.int64]:
    """Return how many texels give every part of a rectangle at least the resolution of the screen.

    The angle that a step on the plane covers is largest at the rectangle's point nearest to the epipole, wherever the
    camera looks.

    Parameters
    ----------
    planes : the planes of n objects, with their rectangles.
    focal_pixels : texels per unit of x/z in the middle of the picture: `View.focal_pixels` times texels per pixel.
    limit : the largest width and height of a tile, texels.

    Returns
    -------
    (n, 2) width and height, texels.
    """
    nearest = np.maximum(np.maximum(planes.low, -planes.high), 0)
    farthest = np.maximum(np.abs(planes.low), np.abs(planes.high))
    squared = planes.distance[:, None] ** 2
    density = np.zeros_like(nearest)
    for axis in (0, 1):
        along, across = nearest[:, axis] ** 2, 1 - axis
        for aside in (nearest[:, across] ** 2, farthest[:, across] ** 2):
            transverse = squared[:, 0] + aside
            density[:, axis] = np.maximum(density[:, axis], np.sqrt(transverse) / (transverse + along))
    texels = np.ceil(focal_pixels * density * (planes.high - planes.low))
    return np.clip(texels, 1, limit).astype(np.int64)
