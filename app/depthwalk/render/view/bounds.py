"""Compute the bounding volumes of objects, which objects a view may see, and near and far planes that hold those.

Every object has a bounding sphere, computed when objects change and read by every frame. Cylinders fit more tightly;
occlusion is tested, and distances to a viewer are measured, by them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import rotate
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Objects
from depthwalk.types import Array

# Largest ratio of far to near plane, unless the near plane is 5 cm away already. So 24 bits resolve 1/8000 of a
# distance; with less, the sunlit wall of a room shows shadow acne.
_MAX_DEPTH_RATIO = 2e3
_MAX_NEAR = 0.05  # metres up to which the ratio may push the near plane out


@dataclass(frozen=True)
class Cylinders:
    """Hold bounding cylinders of n objects.

    Attributes
    ----------
    centre : (n, 3) middles, metres, world.
    axis : (n, 3) directions from end to end, unit vectors, world.
    half_height : (n,) half of the distance from end to end, metres.
    radius : (n,) metres.
    """

    centre: Array
    axis: Array
    half_height: Array
    radius: Array


def box_cylinders(low: Array, high: Array) -> Cylinders:
    """Return the upright cylinders that enclose n axis-aligned boxes.

    Parameters
    ----------
    low, high : (n, 3) least and greatest corners of the boxes, metres, world.

    Returns
    -------
    The n cylinders, world.
    """
    half = (high - low) / 2
    upright = np.broadcast_to(np.array([0, 1, 0], np.float32), half.shape)
    return Cylinders(low + half, upright, half[:, 1], np.hypot(half[:, 0], half[:, 2]))


def cylinders(objects: Objects, centre: Array, half_height: Array, radius: Array) -> Cylinders:
    """Return the cylinders of n objects, which use `a` assets.

    Parameters
    ----------
    objects : the n objects.
    centre : (n, 3) centres of the cylinders, metres, world.
    half_height : (a,) half the height of each asset's cylinder, metres.
    radius : (a,) radius of each asset's cylinder, metres.

    Returns
    -------
    The n cylinders, world.
    """
    x, y, z, w = objects.rotation.T
    axis = np.stack([2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)], -1)  # +Y turned
    scaled = [size.astype(np.float32)[objects.asset] * objects.scale for size in (half_height, radius)]
    return Cylinders(centre, axis, *scaled)


@dataclass(frozen=True)
class Bounds(StructOfArrays):
    """Hold bounding spheres of n objects, in single precision as the objects' positions.

    Attributes
    ----------
    centre : (n, 3) centres, metres, world.
    bounding_radius : (n,) radii, metres.
    """

    centre: Array
    bounding_radius: Array

    def visible(self, view: View) -> tuple[NDArray[np.intp], Array]:
        """Find the spheres that a view may see.

        That is, spheres that reach between the sides of its frustum and are not wholly behind the viewer. Near and far
        plane are ignored.

        Parameters
        ----------
        view : the view of the picture.

        Returns
        -------
        indices : (m,) indices of these spheres, those with the nearest centres first.
        forward : (m,) distances of their centres, metres along the view axis.
        """
        indices, forward = self.seen(view)
        nearest_first = np.argsort(forward, kind="stable")
        return indices[nearest_first], forward[nearest_first]

    def seen(self, view: View) -> tuple[NDArray[np.intp], Array]:
        """Find the spheres that a view may see, as `visible` does, but in their own order.

        Parameters
        ----------
        view : the view of the picture.

        Returns
        -------
        indices : (m,) indices of these spheres, rising.
        forward : (m,) distances of their centres, metres along the view axis.
        """
        right, up, forward = ((self.centre - view.position) @ view.axes.T).T
        seen = forward > -self.bounding_radius
        for tangent, shear, sideways in zip(view.half_extent, view.shear, (right, up), strict=True):
            seen &= sideways - tangent * forward < self.bounding_radius * np.hypot(1, tangent - shear)
            seen &= -sideways - tangent * forward < self.bounding_radius * np.hypot(1, tangent + shear)
        indices = np.flatnonzero(seen)
        return indices, forward[indices]

    def sphere(self) -> tuple[NDArray[np.float64], float]:
        """Return a sphere around all spheres, of which there must be at least one.

        Returns
        -------
        Its centre (3,), metres, world, and its radius, metres.
        """
        bounding_radius = self.bounding_radius[:, None]
        middle = (((self.centre - bounding_radius).min(0) + (self.centre + bounding_radius).max(0)) / 2).astype(float)
        return middle, float((np.linalg.norm(self.centre - middle, axis=1) + self.bounding_radius).max())


def extents(view: View, bounds: Bounds) -> tuple[Array, Array]:
    """Return rectangles in the picture that hold n spheres.

    For a sphere that reaches in front of the near plane, this is the whole picture.

    Parameters
    ----------
    view : the view of the picture, near and far plane fitted.
    bounds : the n spheres, world.

    Returns
    -------
    low, high : (n, 2) lower left and upper right corners in device coordinates, −1 to 1, y upward.
    """
    to_centre = (bounds.centre - view.position) @ view.axes.T
    across, forward, bounding_radius = to_centre[:, :2], to_centre[:, 2:], bounds.bounding_radius[:, None]
    before = forward - bounding_radius > view.depth_range[0]
    depth = np.where(before, np.concatenate([forward - bounding_radius, forward + bounding_radius], 1), 1.0)[:, :, None]
    reach = bounding_radius * np.hypot(1, view.shear)
    low = ((across - reach)[:, None] / depth).min(1) / view.half_extent
    high = ((across + reach)[:, None] / depth).max(1) / view.half_extent
    return np.clip(np.where(before, low, -1), -1, 1), np.clip(np.where(before, high, 1), -1, 1)


def object_bounds(objects: Objects, centre: Array, bounding_radius: Array) -> Bounds:
    """Return the bounding spheres of n objects, which use `a` assets.

    Parameters
    ----------
    objects : the n objects.
    centre : (a, 3) centres of the assets' spheres, metres, asset frames.
    bounding_radius : (a,) radii of the assets' spheres, metres.

    Returns
    -------
    The spheres, world.
    """
    asset = objects.asset
    offset = rotate(objects.rotation, centre.astype(np.float32)[asset] * objects.scale[:, None])
    return Bounds(objects.position + offset, bounding_radius.astype(np.float32)[asset] * objects.scale)


def depth_range(forward: Array, bounding_radius: Array, ground: tuple[float, float] | None) -> tuple[float, float]:
    """Return the distances of a near and a far plane that hold n spheres and the ground.

    Parameters
    ----------
    forward : (n,) distances of the spheres' centres, metres along the view axis.
    bounding_radius : (n,) radii of the spheres, metres.
    ground : least and greatest distance at which the ground may be seen, metres along the view axis; None: no ground.

    Returns
    -------
    Near and far, metres along the view axis.
    """
    nearest = float((forward - bounding_radius).min(initial=np.inf))
    farthest = float((forward + bounding_radius).max(initial=0.0))
    if ground is not None:
        nearest, farthest = min(nearest, ground[0]), max(farthest, ground[1])
    far = max(1.01 * farthest, 1e-4)
    near = 0.99 * nearest if np.isfinite(nearest) else far / 2
    return max(near, min(_MAX_NEAR, far / _MAX_DEPTH_RATIO)), far


def ground_range(view: View, height: float, size: float) -> tuple[float, float]:
    """Return the least and the greatest distance at which the ground may be seen.

    The ground is a level square about the world's origin. The steepest ray meets it first.

    Parameters
    ----------
    view : the view of the picture; near and far plane need not be fitted.
    height : height of the square, metres, world y.
    size : half of the square's side, metres.

    Returns
    -------
    Least and greatest distance, metres along the view axis.
    """
    above = abs(float(view.position[1]) - height)
    steepest = float(np.abs(view.ray_from_screen[1]).sum())  # metres down or up, per metre along the view axis
    return above / max(steepest, 1e-6), float(np.linalg.norm(view.position)) + 2 * size + above


def outside(viewer: Array, centre: Array, half_height: Array, cylinder_radius: Array) -> Array:
    """Return the distances of n viewers from n upright cylinders.

    Parameters
    ----------
    viewer : (n, 3) the viewers, metres, in any frame whose y axis points up.
    centre : (n, 3) the middles of the cylinders, metres, in the same frame.
    half_height : (n,) half the heights of the cylinders, metres.
    cylinder_radius : (n,) radii of the cylinders, metres.

    Returns
    -------
    (n,) metres; 0 inside.
    """
    x, y, z = (viewer - centre).T
    distance: Array = np.hypot(np.maximum(np.hypot(x, z) - cylinder_radius, 0), np.maximum(np.abs(y) - half_height, 0))
    return distance
