"""Where objects are, in the world: computed when they change, read by every frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.rotation import rotate
from depthwalk.render.view import View
from depthwalk.scene.arrays import Objects, Takes
from depthwalk.types import Array

_DEPTH_RATIO = 2e4  # far over near at most, if nothing is nearer than 5 cm: 24 bits then resolve 1/800 of a distance
_NEAREST = 0.05  # metres


@dataclass(frozen=True)
class Bounds(Takes):
    """Bounding spheres of n objects: centre (n, 3), world, and reach (n,), metres; float32, as the objects' places."""

    centre: Array
    reach: Array

    def visible(self, view: View) -> tuple[NDArray[np.intp], Array]:
        """Indices (m,) of the spheres that meet the sides of the view frustum and are not behind it, nearest first; and
        the distances (m,) of their centres along the view axis."""
        right, up, forward = ((self.centre - view.position) @ view.axes.T).T
        seen = forward > -self.reach
        for tangent, sideways in zip(view.half_extent, (right, up), strict=True):
            seen &= np.abs(sideways) - tangent * forward < self.reach * np.hypot(1, tangent)
        indices = np.flatnonzero(seen)
        indices = indices[np.argsort(forward[indices], kind="stable")]
        return indices, forward[indices]

    def sphere(self) -> tuple[NDArray[np.float64], float]:
        """Centre (3,), world, and radius, metres, of a sphere that holds all; there must be one object at least."""
        reach = self.reach[:, None]
        middle = (((self.centre - reach).min(0) + (self.centre + reach).max(0)) / 2).astype(float)
        return middle, float((np.linalg.norm(self.centre - middle, axis=1) + self.reach).max())


def object_bounds(objects: Objects, centre: Array, reach: Array) -> Bounds:
    """Of objects whose assets' spheres are `centre` (a, 3) and `reach` (a,), in the assets' frames."""
    asset = objects.asset
    offset = rotate(objects.rotation, centre.astype(np.float32)[asset] * objects.scale[:, None])
    return Bounds(objects.position + offset, reach.astype(np.float32)[asset] * objects.scale)


def depth_range(forward: Array, reach: Array, ground: tuple[float, float] | None) -> tuple[float, float]:
    """Near and far plane, metres along the view axis, that hold spheres at `forward` (n,) of `reach` (n,).

    ground: least and greatest distance at which the ground may be seen, or None.
    """
    nearest = float((forward - reach).min(initial=np.inf))
    farthest = float((forward + reach).max(initial=0.0))
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


def outside(viewer: Array, centre: Array, half_height: Array, girth: Array) -> Array:
    """How far (n,) viewers (n, 3) are from upright cylinders about `centre` (n, 3) of `half_height` and radius `girth`
    (n,); 0 inside."""
    x, y, z = (viewer - centre).T
    return np.hypot(np.maximum(np.hypot(x, z) - girth, 0), np.maximum(np.abs(y) - half_height, 0))
