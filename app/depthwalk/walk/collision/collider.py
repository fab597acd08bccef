"""Hold the surface of an asset so that the triangles in a box are found quickly."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.spatial_order import cell_members, kd_tree_order
from depthwalk.geometry.triangles import doubled_areas
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array, Ints, Mask, Rows

_BLOCK = 32  # triangles
_FAR = 3.0  # radii of a block from which on it counts as a single triangle, for winding numbers


@dataclass(frozen=True, kw_only=True)
class Collider:
    """Hold t triangles of an asset, sorted into b blocks of neighbours.

    Attributes
    ----------
    points
        (n, 3) float32 vertices, metres, asset frame.
    triangles
        (t, 3) int32, rows of `points`, counter-clockwise seen from the front, block by block.
    first
        (b + 1,) int64, where each block begins in `triangles`.
    low, high
        (b, 3) float32, least and greatest corner of the box around each block, metres.
    area
        (b, 3) float64, sum of the area vectors of a block's triangles, metres².
    """

    points: NDArray[np.float32]
    triangles: NDArray[np.int32]
    first: Ints
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    area: NDArray[np.float64]

    @property
    def nbytes(self) -> int:
        """Return how many bytes its arrays take."""
        return sum(array.nbytes for array in (self.points, self.triangles, self.first, self.low, self.high, self.area))

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Return the least and the greatest corner, (3,) each, metres, of the box around all triangles."""
        return self.low.min(0, initial=np.inf), self.high.max(0, initial=-np.inf)

    def touches(self, low: Array, high: Array) -> bool:
        """Return whether the box around all triangles touches the one from `low` (3,) to `high` (3,), metres."""
        least, greatest = self.box
        return bool((least <= high).all() and (greatest >= low).all())

    def near(self, low: Array, high: Array) -> NDArray[np.float32]:
        """Return the triangles whose boxes touch a box.

        Parameters
        ----------
        low, high
            (3,) least and greatest corner of the box, metres, asset frame.

        Returns
        -------
        numpy.ndarray
            (m, 3, 3) float32: their corners, metres, asset frame.
        """
        if not self.touches(low, high):
            return np.zeros((0, 3, 3), np.float32)
        blocks = np.flatnonzero(((self.low <= high) & (self.high >= low)).all(1))
        corners = self.points[self.triangles[cell_members(self.first, blocks)]]
        touches = (corners.min(1) <= high) & (corners.max(1) >= low)
        return np.asarray(corners[touches.all(1)])

    def winding_number(self, point: Array) -> float:
        """Return how many times the surface encloses a point: 1 inside a solid, 0 outside, in between where it is open.

        Distant blocks count as one triangle each (Barill et al. 2018).

        Parameters
        ----------
        point
            (3,) metres, asset frame.

        Returns
        -------
        float
            The generalised winding number; negative in front of a surface that encloses the point.
        """
        middle = (self.low + self.high) / np.float32(2)
        apart, radius = middle - point, lengths(self.high - middle)
        distance = lengths(apart)
        far = distance > _FAR * radius
        solid_angle = float((self.area[far] * apart[far] / distance[far, None] ** 3).sum())
        near = self.points[self.triangles[cell_members(self.first, np.flatnonzero(~far))]]
        return (solid_angle + float(solid_angles(near - point).sum())) / (4 * np.pi)


def solid_angles(corners: Array) -> Array:
    """Return the solid angles of triangles seen from the origin (Van Oosterom and Strackee 1983).

    Parameters
    ----------
    corners
        (t, 3, 3) corners, in any unit.

    Returns
    -------
    numpy.ndarray
        (t,) steradians, positive for triangles seen from behind.
    """
    a, b, c = corners.astype(np.float64).transpose(1, 0, 2)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    la, lb, lc = lengths(a), lengths(b), lengths(c)
    ab, bc, ca = (np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a)))
    return np.asarray(2 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb))


def collider(points: Array, triangles: Rows) -> Collider:
    """Sort the triangles of a surface into blocks.

    Parameters
    ----------
    points
        (n, 3) vertices, metres, asset frame.
    triangles
        (t, 3) rows of `points`; those without area are dropped.

    Returns
    -------
    Collider
        The surface.
    """
    single = np.ascontiguousarray(points, np.float32)
    triangles = triangles[_has_area(single, triangles)]
    order = kd_tree_order(single[triangles].mean(1), _BLOCK) if len(triangles) else np.zeros(0, np.int64)
    rows = np.ascontiguousarray(triangles[order], np.int32)
    first = np.append(np.arange(0, len(rows), _BLOCK), len(rows))
    low = high = np.zeros((0, 3), np.float32)
    area = np.zeros((0, 3))
    if len(rows):
        corners = single[rows]
        low = np.minimum.reduceat(corners.min(1), first[:-1])
        high = np.maximum.reduceat(corners.max(1), first[:-1])
        area = np.add.reduceat(doubled_areas(single.astype(np.float64), rows) / 2, first[:-1])
    return Collider(points=single, triangles=rows, first=first, low=low, high=high, area=area)


def _has_area(points: Array, triangles: Rows) -> Mask:
    """Return which `triangles` (t, 3), rows of `points` (n, 3), are not degenerate."""
    return np.asarray(lengths(doubled_areas(points.astype(np.float64), triangles)) > 0)
