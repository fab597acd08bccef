"""Cut triangles to the height of a body: seen from above, what it can touch of them is bounded by segments."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array, Mask, Rows

_LEVEL = 1e-9  # metres: edges with smaller differences of height are level
_PLAN = [0, 2]  # the axes that are seen from above: x and z


@dataclass(frozen=True, kw_only=True)
class Outlines:
    """Hold m segments in the plane (x, z).

    Attributes
    ----------
    start : (m, 2) float64
        One end of each, metres, world.
    along : (m, 2) float64
        From there to the other end, metres.
    low, high : (m, 2) float64
        Least and greatest corner of the rectangle around each, metres, world.
    """

    start: NDArray[np.float64]
    along: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self.start)

    def near(self, point: Array, reach: float) -> tuple[Rows, Array, Array]:
        """Find the segments within reach of a point.

        Parameters
        ----------
        point
            (2,) metres, world x and z.
        reach
            Largest distance, metres.

        Returns
        -------
        tuple
            Rows (k,) of the segments, vectors (k, 2) from their nearest points to `point`, and the lengths (k,) of
            these, metres.
        """
        rows = np.flatnonzero(((self.low <= point + reach) & (self.high >= point - reach)).all(1))
        away = from_segments(point, self.start[rows], self.along[rows])
        distance = np.hypot(*away.T)
        near = distance <= reach
        return rows[near], away[near], distance[near]

    def clearance(self, rows: Rows, point: Array, motion: Array) -> Array:
        """Return how close a point comes to segments while it moves straight ahead.

        Parameters
        ----------
        rows
            (k,) rows of the segments.
        point
            (2,) where it begins, metres, world x and z.
        motion
            (2,) how far it moves, metres.

        Returns
        -------
        numpy.ndarray
            (k,) metres; 0 for segments that are crossed.
        """
        start, along = self.start[rows], self.along[rows]
        ends = point, point + motion
        way = [from_segments(end, start, along) for end in ends]
        way += [from_segments(corner, point, motion) for corner in (start, start + along)]
        sides = [_cross(along, end - start) for end in ends] + [
            _cross(motion, end - point) for end in (start, start + along)
        ]
        crossed = (sides[0] * sides[1] < 0) & (sides[2] * sides[3] < 0)
        return np.where(crossed, 0.0, np.min([np.hypot(*away.T) for away in way], axis=0))


def from_segments(point: Array, start: Array, along: Array) -> Array:
    """Return the vectors (…, 2) from the nearest points of segments to points; all arguments (…, 2) broadcast."""
    away = point - start
    length = np.maximum((along * along).sum(-1), 1e-30)
    part = np.minimum(np.maximum((away * along).sum(-1) / length, 0.0), 1.0)
    return np.asarray(away - part[..., None] * along)


def _cross(a: Array, b: Array) -> Array:
    """Return on which side of the vectors `a` (…, 2) the vectors `b` (…, 2) lie, as a sign."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def outlines(corners: Array, low: float, high: float) -> Outlines:
    """Return the outlines, seen from above, of what lies between two heights.

    Parameters
    ----------
    corners
        (t, 3, 3) triangles, metres, world.
    low, high
        The heights, metres, world y; what only touches them from outside is left out.

    Returns
    -------
    Outlines
        The sides of the polygons to which the triangles are cut. What lies within such a polygon is not covered, but
        cannot be reached without crossing them.
    """
    height = corners[..., 1]
    between = (height.max(1, initial=-np.inf) > low) & (height.min(1, initial=np.inf) < high)
    corners = corners[between].astype(np.float64)
    pieces = [_edges(corners, low, high), _section(corners, low), _section(corners, high)]
    start, end = (np.concatenate(ends) for ends in zip(*pieces, strict=True))
    return Outlines(start=start, along=end - start, low=np.minimum(start, end), high=np.maximum(start, end))


def _edges(corners: Array, low: float, high: float) -> tuple[Array, Array]:
    """Return the ends (k, 2), seen from above, of the triangles' edges, cut to heights from `low` to `high`."""
    start, end = corners.reshape(-1, 3), np.roll(corners, -1, 1).reshape(-1, 3)
    rise = end[:, 1] - start[:, 1]
    level = np.abs(rise) < _LEVEL
    slope = np.where(level, 1.0, rise)
    ends = np.sort([(low - start[:, 1]) / slope, (high - start[:, 1]) / slope], axis=0)
    first, last = np.clip(ends[0], 0, None), np.clip(ends[1], None, 1)
    first[level], last[level] = 0, 1
    kept = np.where(level, (start[:, 1] > low) & (start[:, 1] < high), first < last)
    start, along = start[kept][:, _PLAN], (end - start)[kept][:, _PLAN]
    return start + first[kept, None] * along, start + last[kept, None] * along


def _section(corners: Array, height: float) -> tuple[Array, Array]:
    """Return the ends (k, 2), seen from above, of the lines in which triangles meet a level plane."""
    above = corners[..., 1] > height
    crosses = above.any(1) & ~above.all(1)
    corners, alone = corners[crosses], _odd_one_out(above[crosses])
    rows = np.arange(len(corners))
    tip = corners[rows, alone]
    ends = []
    for turn in (1, 2):
        other = corners[rows, (alone + turn) % 3]
        part = (height - tip[:, 1]) / (other[:, 1] - tip[:, 1])
        ends.append((tip + part[:, None] * (other - tip))[:, _PLAN])
    return ends[0], ends[1]


def _odd_one_out(marks: Mask) -> NDArray[np.intp]:
    """Return which of three marks (k, 3) differs from the other two."""
    return np.asarray(np.where(marks.sum(1, keepdims=True) == 1, marks, ~marks).argmax(1))
