"""Place the collider of an asset in the world."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array
from depthwalk.walk.collision.collider import Collider

_INSIDE = 0.5  # winding number of points that count as inside


@dataclass(frozen=True, kw_only=True)
class PlacedCollider:
    """Hold an object near the viewer: world point = position + scale · rotation · asset point.

    Attributes
    ----------
    row : int
        Number of the object.
    collider : Collider
        The surface of its asset.
    position : (3,) float64
        Metres, world.
    rotation : (3, 3) float64
        Matrix that turns column vectors of the asset's frame into the world's.
    scale : float
        Size relative to the asset.
    """

    row: int
    collider: Collider
    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    scale: float

    def is_same(self, other: "PlacedCollider | None") -> bool:
        """Return whether `other` is the same object at the same place."""
        return (
            other is not None
            and self.collider is other.collider
            and self.scale == other.scale
            and np.array_equal(self.position, other.position)
            and np.array_equal(self.rotation, other.rotation)
        )

    def near(self, low: Array, high: Array) -> NDArray[np.float64]:
        """Return the triangles that touch a box, as the box around their blocks and themselves tell.

        Parameters
        ----------
        low, high
            (3,) least and greatest corner of the box, metres, world.

        Returns
        -------
        numpy.ndarray
            (m, 3, 3) float64 corners, metres, world.
        """
        half = np.abs(self.rotation.T) @ (high - low) / (2 * self.scale)
        middle = self._local((low + high) / 2)
        corners = self.collider.near(middle - half, middle + half).astype(np.float64)
        return self.position + self.scale * (corners @ self.rotation.T)

    def holds(self, position: Array, heights: Array) -> bool:
        """Return whether an upright line is inside the object, or pierces its surface.

        Parameters
        ----------
        position
            (3,) a point of the line, metres, world.
        heights
            (h,) heights along it, metres, world y: between the first and the last, no surface may lie; and these
            points may not be inside.
        """
        points = np.tile(position, (len(heights), 1))
        points[:, 1] = heights
        local = np.array([self._local(point) for point in points])
        if not self.collider.touches(local.min(0), local.max(0)):
            return False
        if any(self.collider.winding_number(point) > _INSIDE for point in local):
            return True
        return bool(_pierced(self.near(points.min(0), points.max(0)), points[0], heights))

    def _local(self, point: Array) -> Array:
        """Return a point (3,), metres, world, in the asset's frame."""
        return np.asarray((point - self.position) @ self.rotation / self.scale)


def _pierced(corners: Array, point: Array, heights: Array) -> bool:
    """Return whether triangles (t, 3, 3) meet the upright line through `point` (3,) within the range of `heights`."""
    plan = corners[..., [0, 2]] - point[[0, 2]]
    ahead = np.roll(plan, -1, 1)
    area = plan[..., 0] * ahead[..., 1] - plan[..., 1] * ahead[..., 0]  # (t, 3), opposite to the corner before last
    total = area.sum(1)
    around = np.flatnonzero(((area >= 0).all(1) | (area <= 0).all(1)) & (total != 0))
    weight = np.roll(area[around], -1, 1) / total[around, None]
    height = (weight * corners[around][..., 1]).sum(1)
    return bool(((height > heights.min()) & (height < heights.max())).any())


class Placed(Protocol):
    """Describe what knows the objects near a viewer."""

    @property
    def version(self) -> tuple[int, ...]:
        """Return numbers that change when `near` may return something else for the same place."""
        ...

    @property
    def is_waiting(self) -> bool:
        """Return whether surfaces near the viewer may still be unknown."""
        ...

    def near(self, low: Array, high: Array) -> list[PlacedCollider] | None:
        """Return the objects that may touch a box; None while that is not known.

        Parameters
        ----------
        low, high
            (3,) least and greatest corner of the box, metres, world.
        """
        ...
