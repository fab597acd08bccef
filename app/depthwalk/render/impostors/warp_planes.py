"""Choose the plane on which pass 1 warps an object's depth images, the part of it that shows them, and its resolution.

Arrays have one row for each of n objects, are float64, and in the objects' frames unless said otherwise. Source: Liu et
al. 2007, §3.2 f.; docs/algorithms.md has the formulas, docs/conventions.md the axes of the planes.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import Face
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.types import Array, Mask

# If the viewer is nearer to every plane than this part of the radius, the object is warped straight to the screen: the
# tile of a plane at distance D needs about sqrt(2R/D) screens of texels, 4.5 screens here.
MIN_PLANE_DISTANCE = 0.1
_NEAREST_CORNER = 0.25  # of the plane's distance: how near in front of the viewer a hull may reach to be of use


@dataclass(frozen=True, kw_only=True)
class Planes(StructOfArrays):
    """Hold the warp planes of n objects, and on each an outline that holds the object's warped samples.

    The outline is an octagon: a rectangle whose corners are cut off. `right` × `up` = `normal`, which points to the
    viewer. `crop_to_frustum` shrinks the outlines to the view.

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
    diagonals : (n, 4) least and greatest s + v, least and greatest s − v of the outlines, with s along `right` and v
        along `up`, metres, relative to the epipole.
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
    diagonals: Array

    def widened(self, margin: Array) -> "Planes":
        """Return the planes with outlines that are wider by `margin` (n, 2), metres, on every side."""
        both = margin.sum(1, keepdims=True) * [-1, 1, -1, 1]
        return replace(self, low=self.low - margin, high=self.high + margin, diagonals=self.diagonals + both)


@dataclass(frozen=True, kw_only=True)
class Volumes(StructOfArrays):
    """Hold the cylinders of n objects, whose axes are the y axes of the objects' frames.

    Attributes
    ----------
    radius : (n,) metres.
    bottom : (n,) height of the lower end, metres.
    top : (n,) height of the upper end, metres.
    hull : (n, k, 3) corners of polytopes that enclose the samples, see `geometry.bounding_hull`.
    has_side : (n,) whether the object has a side image; false for planar images.
    """

    radius: Array
    bottom: Array
    top: Array
    hull: Array
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
    """Return the planes that `warp_faces` finds, with outlines that hold all warped samples.

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
    low, high = _rectangles(v, side, distance, epipole)
    along = np.stack([right, up, normal], 1) @ np.swapaxes(v.hull, 1, 2)  # (n, 3, k)
    toward_plane = np.column_stack([epipole, offset + distance])[..., None]
    low, high, diagonals = _outlines(along - toward_plane, distance, low, high)
    return Planes(
        face=face,
        right=right,
        up=up,
        normal=normal,
        distance=distance,
        epipole=epipole,
        offset=offset,
        low=low,
        high=high,
        diagonals=diagonals,
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
    along = np.einsum("nki,ni->nk", v.hull, planes.normal)
    toward, away = np.minimum(along.max(1), v.radius), np.minimum(-along.min(1), v.radius)
    nearest, farthest = np.where(side, v.radius - toward, 0), np.where(side, v.radius + away, v.top - v.bottom)
    return np.stack([nearest, farthest], -1)


def _rectangles(v: Volumes, side: Mask, distance: Array, epipole: Array) -> tuple[Array, Array]:
    """Return the corners (n, 2), from the epipole, of rectangles that hold all of the cylinders, warped.

    A point S moves to e + λ · (S − e), and λ is least at the far side of the cylinder, so the bounds lie at λ = 1 or at
    that λ (docs/algorithms.md, "Warp").
    """
    distance = np.maximum(distance, 1e-9)
    behind = np.where(side, 2 * v.radius, v.top - v.bottom)
    far = (distance / (distance + behind))[:, None]
    last = np.column_stack([v.radius, np.where(side, v.top, v.radius)])
    first = np.column_stack([-v.radius, np.where(side, v.bottom, -v.radius)])
    low, high = first - epipole, last - epipole
    low, high = np.minimum(low, far * low), np.maximum(high, far * high)
    silhouette = v.radius * np.sqrt(far[:, 0])  # |s| ≤ R·sqrt((ρ−R)/(ρ+R)): the tangents from the viewer to the circle
    low[:, 0] = np.where(side, np.maximum(low[:, 0], -silhouette - epipole[:, 0]), low[:, 0])
    high[:, 0] = np.where(side, np.minimum(high[:, 0], silhouette - epipole[:, 0]), high[:, 0])
    return low, high


def _outlines(corners: Array, distance: Array, low: Array, high: Array) -> tuple[Array, Array, Array]:
    """Return outlines that hold the hulls, seen in perspective, within rectangles: `low`, `high` and `diagonals`.

    corners: (n, 3, k) corners of the hulls along right, up and normal, relative to the viewer; low, high: (n, 2) the
    rectangles.
    """
    ahead = -corners[:, 2]
    usable = (ahead > _NEAREST_CORNER * distance[:, None]).all(1) & (distance > 0)
    scale = distance[:, None] / np.where(usable[:, None], ahead, 1)
    s, v = scale * corners[:, 0], scale * corners[:, 1]
    first, last = box_around(s, v)
    low = np.where(usable[:, None], np.maximum(low, first), low)
    high = np.where(usable[:, None], np.minimum(high, last), high)
    whole = np.stack([low.sum(1), high.sum(1), low[:, 0] - high[:, 1], high[:, 0] - low[:, 1]], -1)
    return low, high, np.where(usable[:, None], diagonals_around(s, v), whole)


def box_around(x: Array, y: Array, valid: Mask | None = None) -> tuple[Array, Array]:
    """Return the low and high corners (n, 2) of the least boxes that hold points.

    Parameters
    ----------
    x, y : (n, k) coordinates of k points for each of n boxes.
    valid : (n, k) which of them to hold; None for all.

    Returns
    -------
    The corners; +∞ and −∞ where no point is valid.
    """
    low, high = [], []
    for values in (x, y):
        low.append((values if valid is None else np.where(valid, values, np.inf)).min(1))
        high.append((values if valid is None else np.where(valid, values, -np.inf)).max(1))
    return np.stack(low, -1), np.stack(high, -1)


def diagonals_around(s: Array, v: Array, valid: Mask | None = None) -> Array:
    """Return `Planes.diagonals` (n, 4) of the least outlines that hold points s, v (n, k), see `box_around`."""
    return np.stack(box_around(s + v, s - v, valid), -1).reshape(-1, 4)


def tile_sizes(planes: Planes, focal_pixels: float, limit: int) -> NDArray[np.int64]:
    """Return how many texels give every part of a rectangle at least the resolution in the middle of the screen.

    A step along an axis, at (a, b) from the epipole along and across it, covers √t / (t + a²) of its length as an
    angle, t = D² + b², wherever the camera looks. That is greatest for the least |a|, and the t nearest to a².

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
    along = nearest**2
    low, high = (planes.distance[:, None] ** 2 + bound[:, ::-1] ** 2 for bound in (nearest, farthest))
    transverse = np.clip(along, low, high)
    density = np.sqrt(transverse) / (transverse + along)
    texels: Array = np.ceil(focal_pixels * density * (planes.high - planes.low))
    return np.clip(texels, 1, limit).astype(np.int64)
