"""Find out which triangles of an object a viewer may see: the paper's three cases, made of 26 pieces.

Liu et al. 2007, §3.3 and figure 11, draw an object in one of three cases: a viewer within the cylinder's height needs
the image of its side alone, one above also that of the top cap, one below also that of the bottom cap. There the case
follows from the viewer's height, and that loses surfaces: from beside one sees steps below eye height, and only the top
cap samples these. Here the case follows from what the caps hold: a cap is left out where all of its triangles turn
their backs to the viewer. Pass 1 culls back faces, so leaving such triangles out changes no picture, only its cost.

Testing every triangle would cost as much as drawing it. The triangles of a level are therefore sorted into *pieces* by
their normals, so that one test serves a piece: its normals lie in a cone with four edges, and a viewer behind the
planes perpendicular to those edges, placed where they hold all of the piece, sees the backs of all its triangles.

There are 26 pieces, because a cone serves only if it is narrow, and normals point everywhere:

- The top's and the bottom's piece hold what is level, within half a degree: floors, steps, tabletops. These are the
  paper's two cap images, and what makes a view one of its cases: a viewer below the highest step sees no floor.
- All else is the side's, on whatever image it is sampled. As one piece its normals would point all around, and it
  would always be seen. It is divided by 8 directions around the axis and 3 slopes (facing up, upright, facing down),
  every 45°.

So there are 8 · 3 + 2 = 26 cones, like the 26 neighbours of a cube. Narrower cones leave out more, but pieces are runs
of an index list, and each run costs a draw call. Measured on the finest levels of five models (statue, urn, head_venus,
fountain, rock_boulder), for 400 viewers each, 3 to 12 radii away and up to twice as high as the object:

    directions around the axis        2      4      8     16
    pieces                            8     14     26     50
    share of triangles drawn       99 %   90 %   81 %   76 %
    runs that they are drawn in     1.0    1.7    3.6    7.8
"""

from enum import IntEnum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array, Ints, Rows

_LEVEL = np.radians(0.5)  # slope up to which triangles count as level
_STEEP = np.radians(45.0)  # slope from which on a piece of the side is steep
_DIRECTIONS = 8  # of the side's pieces, around the axis
_SLOPES = 3  # of the side's pieces in each direction: facing up, steep, facing down

TOP_PIECE = 0
BOTTOM_PIECE = 1 + _DIRECTIONS * _SLOPES
PIECES = BOTTOM_PIECE + 1  # that make up the whole object
# Index ranges that follow the pieces: what the side image samples, but other faces better. The paper's cases draw these
# where they leave the other face out. There the box faces' own triangles and the side's own are pieces of the side.
SIDE_OF_TOP, SIDE_OF_BOX_FACES, SIDE_OF_BOTTOM = range(PIECES, PIECES + 3)
RANGES = PIECES + 3
PAPER_BOX_FACES, PAPER_SIDE = 1, 2

ALL_PIECES = (1 << PIECES) - 1
SIDE_PIECES = ALL_PIECES & ~(1 << TOP_PIECE | 1 << BOTTOM_PIECE)
CAPS = np.array([TOP_PIECE, BOTTOM_PIECE])
_PIECE_NUMBERS = np.arange(PIECES)
# How far a viewer may be in front of a plane, by its distance, and still be taken to be behind it: tiles round
# positions of vertices, so that triangles seen from the edge may turn.
HORIZON_SLACK = 1e-3


class Case(IntEnum):
    """Name the depth images that a view needs: the paper's figure 11, cases 1 to 3, or all of them."""

    SIDE = 0
    SIDE_AND_TOP = 1
    SIDE_AND_BOTTOM = 2
    ALL = 3


def _bits(*ranges: int) -> int:
    """Return a bit mask of index ranges."""
    return sum(1 << number for number in ranges)


# What the paper draws in each case, as bit masks of index ranges.
PAPER_PIECES = np.array(
    [
        _bits(PAPER_SIDE, SIDE_OF_TOP, SIDE_OF_BOX_FACES, SIDE_OF_BOTTOM),
        _bits(PAPER_SIDE, TOP_PIECE, SIDE_OF_BOX_FACES, SIDE_OF_BOTTOM),
        _bits(PAPER_SIDE, SIDE_OF_TOP, SIDE_OF_BOX_FACES, BOTTOM_PIECE),
        ALL_PIECES,
    ]
)


def _unit(azimuth: float, slope: float) -> tuple[float, float, float]:
    """Return the unit vector at an angle around the axis from +x, and at an angle from +y, radians."""
    return (np.sin(slope) * np.cos(azimuth), np.cos(slope), np.sin(slope) * np.sin(azimuth))


def _cone_edges() -> Array:
    """Return unit edges (PIECES, 4, 3) of cones that hold the normals of each piece.

    A cone's sides are planes through the origin, parallels of latitude are not: between its edges a side bulges toward
    the pole. Where that would cut off normals, at ends nearer to the equator, edges lie as much closer to it.
    """
    half = np.pi / _DIRECTIONS
    lower = np.pi / 2 - np.arctan(np.tan(np.pi / 2 - _STEEP) * np.cos(half))
    slopes = (_LEVEL, lower), (_STEEP, np.pi - _STEEP), (np.pi - lower, np.pi - _LEVEL)
    flat = np.tan(_LEVEL)
    cones = [[(x * flat, 1.0, z * flat) for x in (-1, 1) for z in (-1, 1)]]
    for direction in range(_DIRECTIONS):
        middle = 2 * half * direction
        for ends in slopes:
            cones.append([_unit(azimuth, slope) for azimuth in (middle - half, middle + half) for slope in ends])
    cones.append([(x * flat, -1.0, z * flat) for x in (-1, 1) for z in (-1, 1)])
    edges = np.array(cones)
    return np.asarray(edges / np.linalg.norm(edges, axis=-1, keepdims=True))


CONE_EDGES = _cone_edges()
"""(PIECES, 4, 3) edges of the cones that hold the normals of the pieces, unit vectors, object frame."""


def piece_numbers(corners: Array) -> Ints:
    """Return in which piece each triangle lies, which its normal alone decides.

    Parameters
    ----------
    corners
        (t, 3, 3) triangles, counter-clockwise seen from the front, metres, object frame.

    Returns
    -------
    Ints
        (t,) numbers of pieces, 0 to PIECES − 1.
    """
    x, y, z = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).T
    direction = np.round(np.arctan2(z, x) * (_DIRECTIONS / (2 * np.pi))).astype(np.int64) % _DIRECTIONS
    slope = np.arctan2(np.hypot(x, z), y)
    band = (slope > _STEEP).astype(np.int64) + (slope > np.pi - _STEEP)
    level = np.maximum(np.abs(x), np.abs(z)) <= np.tan(_LEVEL) * np.abs(y)
    caps = np.where(y > 0, TOP_PIECE, BOTTOM_PIECE)
    return np.where(level, caps, 1 + direction * _SLOPES + band)


def piece_horizons(corners: Array, piece: Rows) -> Array:
    """Return how far the triangles of each piece extend backward along the edges of the cone of their normals.

    Parameters
    ----------
    corners
        (t, 3, 3) triangles, object frame, metres.
    piece
        (t,) number of the piece of each triangle, see `piece_numbers`.

    Returns
    -------
    Array
        (PIECES, 4) metres: the least `edge · point` over the triangles of a piece; +inf where it has none.
    """
    horizon = np.full((PIECES, 4), np.inf)
    if (piece[1:] < piece[:-1]).any():
        order = np.argsort(piece, kind="stable")
        corners, piece = corners.take(order, 0), piece.take(order)
    ends = np.searchsorted(piece, _PIECE_NUMBERS, "right").tolist()
    for number, (first, end) in enumerate(pairwise([0, *ends])):
        if first < end:
            horizon[number] = (corners[first:end].reshape(-1, 3) @ CONE_EDGES[number].T).min(0)
    return horizon


def seen_pieces(horizon: Array, viewer: Array, among: NDArray[np.intp] = _PIECE_NUMBERS) -> Ints:
    """Return which pieces of an object viewers may see.

    A normal n of a piece is a sum of its cone's edges e with weights that are not negative. Where e·(C − p) ≤ 0 for all
    four edges and every point p of the piece, n·(C − p) ≤ 0 follows: its triangles turn their backs to C.

    Parameters
    ----------
    horizon
        (n, p, 4) metres, of p pieces for each of n viewers, see `piece_horizons`; −inf: always seen.
    viewer
        (n, 3) positions C of the viewers, object frame, metres.
    among
        (p,) numbers of the pieces that are asked for.

    Returns
    -------
    Ints
        (n,) bit masks: bit k is set where piece k may be seen.
    """
    ahead = (viewer @ CONE_EDGES[among].reshape(-1, 3).T).reshape(-1, len(among), 4)
    ahead += HORIZON_SLACK * np.linalg.norm(viewer, axis=1)[:, None, None]
    return np.asarray((ahead > horizon).any(-1) @ (1 << among))


def drawn_cases(pieces: Rows) -> Rows:
    """Return the `Case` (n,) that the bit masks `pieces` (n,) draw: the side, with the caps whose bits are set."""
    return (pieces >> TOP_PIECE & 1) * Case.SIDE_AND_TOP + (pieces >> BOTTOM_PIECE & 1) * Case.SIDE_AND_BOTTOM


def piece_runs(first: Rows, count: Rows, pieces: int = ALL_PIECES) -> tuple[tuple[int, int], ...]:
    """Return which runs of an index array draw the chosen pieces of a level.

    Parameters
    ----------
    first
        (RANGES,) first index of each of the level's ranges: one per piece, then those of the paper's cases.
    count
        (RANGES,) number of indices of each range.
    pieces
        Bit mask of ranges: bit k chooses range k.

    Returns
    -------
    tuple
        A pair for each run, its first index and its number of indices. Ranges that follow one another become one run.
    """
    wanted = np.flatnonzero((pieces >> np.arange(RANGES) & 1 > 0) & (count > 0))
    if not len(wanted):
        return ()
    start, stop = first[wanted], first[wanted] + count[wanted]
    breaks = np.flatnonzero(start[1:] != stop[:-1])
    starts, stops = start[np.append(0, breaks + 1)], stop[np.append(breaks, -1)]
    return tuple(zip(starts.tolist(), (stops - starts).tolist(), strict=True))
