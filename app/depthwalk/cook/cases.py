"""Find the triangles of an object that a viewer may see: the paper's three cases, refined to 26 pieces.

Liu et al. 2007, §3.3 and figure 11, draw an object in one of three cases: a viewer within the cylinder's height needs
only the image of its side, one above also that of the top cap, one below also that of the bottom cap. In the paper the
viewer's height determines the case, and that loses surfaces: from the side one sees steps below eye height, which only
the top cap samples. Here the contents of the caps determine it: a cap is skipped if all of its triangles are
back-facing. Pass 1 culls back faces, so skipping such triangles changes no picture, only its cost.

Testing every triangle would cost as much as drawing it. The triangles of a level are therefore sorted by their normals
into *pieces* that are tested as a whole. The normals of a piece lie in a cone with four edges. Planes perpendicular to
these edges are placed so that they hold all of the piece; a viewer behind all of them sees only back faces.

There are 26 pieces, because a cone is useful only if it is narrow, and normals point everywhere:

- The top and the bottom piece hold everything level to within half a degree: floors, steps, tabletops. These are the
  paper's two cap images, which distinguish its cases: a viewer below the highest step sees no floor.
- Everything else belongs to the side, whichever image samples it. The normals of a single piece would point all around,
  so it would always be visible. The side is therefore divided into 8 directions around the axis and 3 slopes (facing
  up, upright, facing down), every 45°.

So there are 8 · 3 + 2 = 26 cones, like the 26 neighbours of a cube. Narrower cones skip more, but pieces are runs of an
index list, and each run costs a draw call. Measured on the finest levels of five models (statue, urn, head_venus,
fountain, rock_boulder), for 400 viewers each, 3 to 12 radii away and up to twice as high as the object:

    directions around the axis        2      4      8     16
    pieces                            8     14     26     50
    share of triangles drawn       99 %   90 %   81 %   76 %
    runs that are drawn             1.0    1.7    3.6    7.8
"""

from enum import IntEnum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array, Ints, Rows

_LEVEL = np.radians(0.5)  # slope up to which triangles count as level
_STEEP = np.radians(45.0)  # slope above which a piece of the side counts as steep
_DIRECTIONS = 8  # of the side's pieces, around the axis
_SLOPES = 3  # of the side's pieces in each direction: facing up, steep, facing down

TOP_PIECE = 0
BOTTOM_PIECE = 1 + _DIRECTIONS * _SLOPES
PIECES = BOTTOM_PIECE + 1  # together they are the whole object
# Index ranges after the pieces: triangles on the side image that other faces sample better. The paper's cases draw
# these where they skip the other face. For these cases, the own triangles of box faces and side are two of the side's
# pieces.
SIDE_OF_TOP, SIDE_OF_BOX_FACES, SIDE_OF_BOTTOM = range(PIECES, PIECES + 3)
RANGES = PIECES + 3
PAPER_BOX_FACES, PAPER_SIDE = 1, 2

ALL_PIECES = (1 << PIECES) - 1
SIDE_PIECES = ALL_PIECES & ~(1 << TOP_PIECE | 1 << BOTTOM_PIECE)
CAPS = np.array([TOP_PIECE, BOTTOM_PIECE])
_PIECE_NUMBERS = np.arange(PIECES)
# How far in front of a plane, relative to the distance, a viewer may be and still count as behind it: tiles round
# vertex positions, so that triangles seen edge-on may turn.
HORIZON_SLACK = 1e-3


class Case(IntEnum):
    """Name the depth images that a view needs: the paper's figure 11, cases 1 to 3, or all of them."""

    SIDE = 0
    SIDE_AND_TOP = 1
    SIDE_AND_BOTTOM = 2
    ALL = 3


def _bits(*ranges: int) -> int:
    """Return the bit mask of some index ranges."""
    return sum(1 << number for number in ranges)


# The index ranges that the paper draws in each case, as bit masks.
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

    A cone's sides are planes through the origin and so great circles, which bulge toward the pole between two edges;
    parallels of latitude do not. Where that would cut off normals, at ends nearer to the equator, the edges are moved
    closer to the equator by as much.
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
    """Return the piece of each triangle, which is determined by its normal.

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
        (PIECES, 4) metres: the smallest `edge · point` over the triangles of a piece; +inf if it has none.
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
    """Return the pieces of an object that viewers may see.

    A normal n of a piece is a sum of its cone's edges e with non-negative weights. If e·(C − p) ≤ 0 for all four edges
    and every point p of the piece, it follows that n·(C − p) ≤ 0: its triangles are back-facing for a viewer at C.

    Parameters
    ----------
    horizon
        (n, p, 4) metres, of p pieces for each of n viewers, see `piece_horizons`; −inf: always visible.
    viewer
        (n, 3) positions C of the viewers, object frame, metres.
    among
        (p,) numbers of the pieces to test.

    Returns
    -------
    Ints
        (n,) bit masks: bit k is set if piece k may be visible.
    """
    ahead = (viewer @ CONE_EDGES[among].reshape(-1, 3).T).reshape(-1, len(among), 4)
    ahead += HORIZON_SLACK * np.linalg.norm(viewer, axis=1)[:, None, None]
    return np.asarray((ahead > horizon).any(-1) @ (1 << among))


def drawn_cases(pieces: Rows) -> Rows:
    """Return the `Case` (n,) that the bit masks `pieces` (n,) draw: the side, and the caps whose bits are set."""
    return (pieces >> TOP_PIECE & 1) * Case.SIDE_AND_TOP + (pieces >> BOTTOM_PIECE & 1) * Case.SIDE_AND_BOTTOM


def piece_runs(first: Rows, count: Rows, pieces: int = ALL_PIECES) -> tuple[tuple[int, int], ...]:
    """Return the runs of an index array that draw the selected pieces of a level.

    Parameters
    ----------
    first
        (RANGES,) first index of each of the level's ranges: one per piece, then those of the paper's cases.
    count
        (RANGES,) number of indices in each range.
    pieces
        Bit mask of ranges: bit k selects range k.

    Returns
    -------
    tuple
        First index and number of indices of each run. Adjacent ranges are merged into one run.
    """
    wanted = np.flatnonzero((pieces >> np.arange(RANGES) & 1 > 0) & (count > 0))
    if not len(wanted):
        return ()
    start, stop = first[wanted], first[wanted] + count[wanted]
    breaks = np.flatnonzero(start[1:] != stop[:-1])
    starts, stops = start[np.append(0, breaks + 1)], stop[np.append(breaks, -1)]
    return tuple(zip(starts.tolist(), (stops - starts).tolist(), strict=True))
