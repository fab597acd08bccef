"""Where objects are, in the world: computed when they change, read by every frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import rotate
from depthwalk.geometry.soa import Takes
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Objects
from depthwalk.types import Array


@dataclass(frozen=True)
class Cylinders:
    """What holds n objects. centre: (n, 3), world; axis: (n, 3), unit, world; half_height, radius: (n,) metres."""

    centre: Array
    axis: Array
    half_height: Array
    radius: Array


def box_cylinders(low: Array, high: Array) -> Cylinders:
    """Upright, about n boxes from `low` to `high` (n, 3), world."""
    half = (high - low) / 2
    upright = np.broadcast_to(np.array([0, 1, 0], np.float32), half.shape)
    return Cylinders(low + half, upright, half[:, 1], np.hypot(half[:, 0], half[:, 2]))


def cylinders(objects: Objects, centre: Array, half_height: Array, radius: Array) -> Cylinders:
    """Of n objects whose bounds' centres are `centre` (n, 3), world; half_height, radius: (a,) of assets, metres."""
    x, y, z, w = objects.rotation.T
    axis = np.stack([2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)], -1)  # +Y turned
    half_height, radius = (each.astype(np.float32)[objects.asset] * objects.scale for each in (half_height, radius))
    return Cylinders(centre, axis, half_height, radius)


_DEPTH_RATIO = 2e4  # far over near at most, if nothing is nearer than 5 cm: 24 bits then resolve 1/800 of a distance
_NEAREST = 0.05  # metres


@dataclass(frozen=True)
class Bounds(Takes):
    """Bounding spheres of n objects: centre (n, 3), world, and reach (n,), metres; float32, as the objects' places."""

    centre: Array
    bounding_radius: Array

    def visible(self, view: View) -> tuple[NDArray[np.intp], Array]:
        """Indices (m,) of the spheres that meet the sides of the view frustum and are not behind it, nearest first; and
        the distances (m,) of their centres along the view axis."""
        right, up, forward = ((self.centre - view.position) @ view.axes.T).T
        seen = forward > -self.bounding_radius
        for tangent, sideways in zip(view.half_extent, (right, up), strict=True):
            seen &= np.abs(sideways) - tangent * forward < self.bounding_radius * np.hypot(1, tangent)
        indices = np.flatnonzero(seen)
        indices = indices[np.argsort(forward[indices], kind="stable")]
        return indices, forward[indices]

    def sphere(self) -> tuple[NDArray[np.float64], float]:
        """Centre (3,), world, and radius, metres, of a sphere that holds all; there must be one object at least."""
        bounding_radius = self.bounding_radius[:, None]
        middle = (((self.centre - bounding_radius).min(0) + (self.centre + bounding_radius).max(0)) / 2).astype(float)
        return middle, float((np.linalg.norm(self.centre - middle, axis=1) + self.bounding_radius).max())


def extents(view: View, bounds: Bounds) -> tuple[Array, Array]:
    """Corners (n, 2) of rectangles that hold the spheres in the picture, −1 to 1; all of it where one reaches behind
    the near plane."""
    to_centre = (bounds.centre - view.position) @ view.axes.T
    across, forward, bounding_radius = to_centre[:, :2], to_centre[:, 2:], bounds.bounding_radius[:, None]
    before = forward - bounding_radius > view.depth_range[0]
    depth = np.where(before, np.concatenate([forward - bounding_radius, forward + bounding_radius], 1), 1.0)[:, :, None]
    low = ((across - bounding_radius)[:, None] / depth).min(1) / view.half_extent
    high = ((across + bounding_radius)[:, None] / depth).max(1) / view.half_extent
    return np.clip(np.where(before, low, -1), -1, 1), np.clip(np.where(before, high, 1), -1, 1)


def object_bounds(objects: Objects, centre: Array, bounding_radius: Array) -> Bounds:
    """Of objects whose assets' spheres are `centre` (a, 3) and `bounding_radius` (a,), in the assets' frames."""
    asset = objects.asset
    offset = rotate(objects.rotation, centre.astype(np.float32)[asset] * objects.scale[:, None])
    return Bounds(objects.position + offset, bounding_radius.astype(np.float32)[asset] * objects.scale)


def depth_range(forward: Array, bounding_radius: Array, ground: tuple[float, float] | None) -> tuple[float, float]:
    """Near and far plane, metres along the view axis, that hold spheres at `forward` (n,) of `bounding_radius` (n,).

    ground: least and greatest distance at which the ground may be seen, or None.
    """
    nearest = float((forward - bounding_radius).min(initial=np.inf))
    farthest = float((forward + bounding_radius).max(initial=0.0))
    if ground is not None:
        nearest, farthest = min(nearest, ground[0]), max(farthest, ground[1])
    far = max(1.01 * farthest, 1e-4)
    near = 0.99 * nearest if np.isfinite(nearest) else far / 2
    return max(near, min(_NEAREST, far / _DEPTH_RATIO)), far


def ground_range(view: View, height: float, size: float) -> tuple[float, float]:
    """Bounds on the distances, metres along the view axis, at which a level square about the origin may be seen.

    height: its y; size: half its side, metres. Of all rays one metre along the axis, the steepest meets it first.
    """
    above = abs(float(view.position[1]) - height)
    steepest = abs(view.axes[2, 1]) + sum(np.abs(view.axes[:2, 1]) * view.half_extent)
    return above / max(steepest, 1e-6), float(np.linalg.norm(view.position)) + 2 * size + above


def outside(viewer: Array, centre: Array, half_height: Array, cylinder_radius: Array) -> Array:
    """How far (n,) viewers (n, 3) are from upright cylinders about `centre` (n, 3) of `half_height` and radius `cylinder_radius`
    (n,); 0 inside."""
    x, y, z = (viewer - centre).T
    return np.hypot(np.maximum(np.hypot(x, z) - cylinder_radius, 0), np.maximum(np.abs(y) - half_height, 0))
