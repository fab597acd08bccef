"""Find what may cast a shadow on something in view, for shadow maps that are used for a single picture.

Seen along the sun's light, the frustum of a view is a convex polygon. Whatever casts a shadow into it is above that
polygon, and not behind all of the frustum.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import Self

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.types import Array

_FLAT = 1e-9  # of the frustum's extent: points closer to each other than this make no edge


@dataclass(frozen=True, kw_only=True)
class SeenPrism:
    """Hold the prism along the sun's light that encloses what a view sees, open towards the sun.

    Attributes
    ----------
    origin
        The position of the viewer, metres, world.
    axes
        (3, 3) rows right, up and towards the sun, unit vectors, world.
    normals
        (m, 2) unit normals of its sides, outward, along the first two axes.
    offsets
        (m,) metres from the origin to each side.
    bottom
        Metres along the third axis from the origin to its lower end.
    """

    origin: Array
    axes: Array
    normals: Array
    offsets: Array
    bottom: float

    @classmethod
    def of(cls, view: View, axes: Array, distance: float) -> Self:
        """Return the prism of a view.

        Parameters
        ----------
        view
            The view, with near and far plane fitted to what it sees.
        axes
            (3, 3) rows right, up and towards the sun, unit vectors, world.
        distance
            Distance from the viewer where shadows end, metres.

        Returns
        -------
        SeenPrism
            Its prism.
        """
        near, far = view.depth_range
        screen = np.array([(x, y, 1.0) for x in (-1, 1) for y in (-1, 1)])
        rays = screen @ view.ray_from_screen.T
        seen = np.concatenate([near * rays, min(far, max(distance, near)) * rays]) @ axes.T
        normals, offsets = _sides(seen[:, :2])
        return cls(origin=view.position, axes=axes, normals=normals, offsets=offsets, bottom=seen[:, 2].min())

    def meets(self, bounds: Bounds, margin: float) -> NDArray[np.bool_]:
        """Return which spheres meet the prism, and so may cast a shadow on something in view.

        Parameters
        ----------
        bounds
            The n spheres, world.
        margin
            Metres by which a shadow may be wider than its caster.

        Returns
        -------
        NDArray[np.bool_]
            (n,) whether each sphere meets it.
        """
        place, reach = (bounds.centre - self.origin) @ self.axes.T, bounds.bounding_radius + margin
        beside = place[:, :2] @ self.normals.T - self.offsets > reach[:, None]
        return np.asarray(~beside.any(1) & (place[:, 2] > self.bottom - reach))


def _sides(points: Array) -> tuple[Array, Array]:
    """Return unit normals (m, 2), outward, and offsets (m,) of the edges of the convex hull of `points` (n, 2)."""
    extent = np.ptp(points, axis=0).max()
    first, second = np.array(list(combinations(range(len(points)), 2))).T
    along = points[second] - points[first]
    length = np.linalg.norm(along, axis=1)
    first, along, length = (column[length > _FLAT * extent] for column in (first, along, length))
    normals = np.stack([along[:, 1], -along[:, 0]], -1) / length[:, None]
    normals = np.concatenate([normals, -normals])
    offsets = (normals * np.tile(points[first], (2, 1))).sum(1)
    outside = points @ normals.T - offsets  # (n, pairs) metres
    edge = (outside <= _FLAT * extent).all(0)
    return normals[edge], offsets[edge]
