"""Cut triangles to the height of a body: seen from above, what it can touch of them is bounded by segments."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array, Mask, Rows

_LEVEL = 1e-9  # metres: edges with smaller differences of height are level

Plan = NDArray[np.complex128]
"""Points or vectors seen from above: x + i z."""


@dataclass(frozen=True, kw_only=True)
class Outlines:
    """Hold m segments in the plane of x and z, as complex numbers x + i z, metres, world.

    Attributes
    ----------
    start : (m,) complex
        One end of each.
    along : (m,) complex
        From there to the other end.
    box : (4, m) float64
        Least x, greatest x, least z and greatest z of each.
    """

    start: Plan
    along: Plan
    box: NDArray[np.float64]

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self.start)

    def near(self, point: complex, reach: float) -> tuple[Rows, Plan, Array]:
        """Find the segments within reach of a point.

        Parameters
        ----------
        point
            The point, metres, world x + i z.
        reach
            Largest distance, metres.

        Returns
        -------
        tuple
            Rows (k,) of the segments, vectors (k,) complex from their nearest points to `point`, and the lengths (k,)
            of these, metres.
        """
        west, east, north, south = self.box
        x, z = point.real, point.imag
        rows = np.flatnonzero((west <= x + reach) & (east >= x - reach) & (north <= z + reach) & (south >= z - reach))
        away = from_segments(point, self.start[rows], self.along[rows])
        distance = np.abs(away)
        near = distance <= reach
        return rows[near], away[near], distance[near]

    def clearance(self, rows: Rows, point: complex, motion: complex) -> Array:
        """Return how close a point comes to segments while it moves straight ahead.

        Parameters
        ----------
        rows
            (k,) rows of the segments.
        point
            Where it begins, metres, world x + i z.
        motion
            How far it moves, metres.

        Returns
        -------
        numpy.ndarray
            (k,) metres; 0 for segments that are crossed.
        """
        start, along, goal = self.start[rows], self.along[rows], point + motion
        end = start + along
        of_way = (from_segments(corner, np.array(point), np.array(motion)) for corner in (start, end))
        of_segments = (from_segments(place, start, along) for place in (point, goal))
        least = np.min([np.abs(away) for away in (*of_way, *of_segments)], axis=0)
        parted = sine(along, point - start) * sine(along, goal - start) < 0
        least[parted & (sine(motion, start - point) * sine(motion, end - point) < 0)] = 0
        return np.asarray(least)


def in_plan(points: Array) -> Plan:
    """Return points or vectors (…, 3), world, as they are seen from above, (…) complex."""
    return np.asarray(points[..., 0] + 1j * points[..., 2])


def from_segments(point: Plan | complex, start: Plan, along: Plan) -> Plan:
    """Return the vectors (k,) from the nearest points of segments to points; all arguments (k,) complex broadcast."""
    away = point - start
    part = cosine(along, away) / np.maximum(cosine(along, along), 1e-30)
    return np.asarray(away - np.minimum(np.maximum(part, 0.0), 1.0) * along)


def cosine(a: Plan | complex, b: Plan | complex) -> Array:
    """Return the dot products (k,) of vectors (k,) complex."""
    return np.asarray((np.conj(a) * b).real)


def sine(a: Plan | complex, b: Plan | complex) -> Array:
    """Return the cross products (k,) of vectors (k,) complex: positive where b points to the left of a."""
    return np.asarray((np.conj(a) * b).imag)


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
    box = [choose(axis(start), axis(end)) for axis in (np.real, np.imag) for choose in (np.minimum, np.maximum)]
    return Outlines(start=start, along=end - start, box=np.array(box))


def _edges(corners: Array, low: float, high: float) -> tuple[Plan, Plan]:
    """Return the ends (k,), seen from above, of the triangles' edges, cut to heights from `low` to `high`."""
    start, end = corners.reshape(-1, 3), np.roll(corners, -1, 1).reshape(-1, 3)
    rise = end[:, 1] - start[:, 1]
    level = np.abs(rise) < _LEVEL
    slope = np.where(level, 1.0, rise)
    ends = np.sort([(low - start[:, 1]) / slope, (high - start[:, 1]) / slope], axis=0)
    first, last = np.clip(ends[0], 0, None), np.clip(ends[1], None, 1)
    first[level], last[level] = 0, 1
    kept = np.where(level, (start[:, 1] > low) & (start[:, 1] < high), first < last)
    begin, along = in_plan(start[kept]), in_plan((end - start)[kept])
    return begin + first[kept] * along, begin + last[kept] * along


def _section(corners: Array, height: float) -> tuple[Plan, Plan]:
    """Return the ends (k,), seen from above, of the lines in which triangles meet a level plane."""
    above = corners[..., 1] > height
    crosses = above.any(1) & ~above.all(1)
    corners, alone = corners[crosses], _odd_one_out(above[crosses])
    rows = np.arange(len(corners))
    tip = corners[rows, alone]
    ends = []
    for turn in (1, 2):
        other = corners[rows, (alone + turn) % 3]
        part = (height - tip[:, 1]) / (other[:, 1] - tip[:, 1])
        ends.append(in_plan(tip) + part * in_plan(other - tip))
    return ends[0], ends[1]


def _odd_one_out(marks: Mask) -> NDArray[np.intp]:
    """Return which of three marks (k, 3) differs from the other two."""
    return np.asarray(np.where(marks.sum(1, keepdims=True) == 1, marks, ~marks).argmax(1))
