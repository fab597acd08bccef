"""Which triangles of an object a viewer may see: pieces that share a direction, and the three cases that they make.

Liu et al. 2007, §3.3, figure 11: a viewer beside an object needs the image of its side alone, one above also that of
the top, one below also that of the bottom. As a rule about where the viewer is that loses what is seen: from beside
one sees steps below eye height, and only the top cap samples these. Here it is a rule about what the caps hold.

The triangles of a level are sorted into pieces by their normals: what lies level and faces up is the top's, what lies
level and faces down the bottom's; all else, also of caps, can be seen from beside and is the side's, in a piece for
each compass direction and slope. A piece's normals lie in a cone with four edges. If the viewer is behind the planes
square to each edge of the cone, drawn where they hold all of the piece, it sees the back of all its triangles, which
pass 1 culls: leaving the piece out changes no picture.
"""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

_LEVEL = np.radians(0.5)  # slope up to which triangles count as level
_STEEP = np.radians(45.0)  # slope from which on a piece of the side is steep
_DIRECTIONS = 8  # of the side's pieces, around the axis
_SLOPES = 3  # of the side's pieces in each direction: facing up, steep, facing down

TOP_PIECE = 0
BOTTOM_PIECE = 1 + _DIRECTIONS * _SLOPES
PIECES = BOTTOM_PIECE + 1  # that make up the whole object
# Index ranges that follow the pieces: what the side image samples, but other faces better. The paper's cases draw these
# where they leave the other face out. There the flanks' own triangles and the side's own are pieces of the side.
SIDE_OF_TOP, SIDE_OF_FLANKS, SIDE_OF_BOTTOM = range(PIECES, PIECES + 3)
RANGES = PIECES + 3
PAPER_FLANKS, PAPER_SIDE = 1, 2

ALL_PIECES = (1 << PIECES) - 1
SIDE_PIECES = ALL_PIECES & ~(1 << TOP_PIECE | 1 << BOTTOM_PIECE)
CAPS = np.array([TOP_PIECE, BOTTOM_PIECE])
_EVERY = np.arange(PIECES)
# How far a viewer may be in front of a plane, by its distance, and still be taken to be behind it: tiles round
# positions of vertices, so that triangles seen from the edge may turn.
_SLACK = 1e-3


class Case(IntEnum):
    """Which depth images a view needs: the paper's figure 11, cases 1 to 3, or all of them."""

    SIDE = 0
    SIDE_AND_TOP = 1
    SIDE_AND_BOTTOM = 2
    ALL = 3


def _bits(*ranges: int) -> int:
    return sum(1 << number for number in ranges)


# What the paper draws in each case, as bit masks of index ranges.
PAPER_PIECES = np.array(
    [
        _bits(PAPER_SIDE, SIDE_OF_TOP, SIDE_OF_FLANKS, SIDE_OF_BOTTOM),
        _bits(PAPER_SIDE, TOP_PIECE, SIDE_OF_FLANKS, SIDE_OF_BOTTOM),
        _bits(PAPER_SIDE, SIDE_OF_TOP, SIDE_OF_FLANKS, BOTTOM_PIECE),
        ALL_PIECES,
    ]
)


def _unit(azimuth: float, slope: float) -> tuple[float, float, float]:
    return (np.sin(slope) * np.cos(azimuth), np.cos(slope), np.sin(slope) * np.sin(azimuth))


def _cone_edges() -> Array:
    """Unit edges (PIECES, 4, 3) of cones that hold the normals of each piece.

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


_EDGES = _cone_edges()


def piece_numbers(corners: Array) -> NDArray[np.int64]:
    """Return the piece (t,) of triangles (t, 3, 3), whose fronts are counter-clockwise; object frame, metres."""
    x, y, z = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).T
    direction = np.round(np.arctan2(z, x) * (_DIRECTIONS / (2 * np.pi))).astype(np.int64) % _DIRECTIONS
    slope = np.arctan2(np.hypot(x, z), y)
    band = (slope > _STEEP).astype(np.int64) + (slope > np.pi - _STEEP)
    level = np.maximum(np.abs(x), np.abs(z)) <= np.tan(_LEVEL) * np.abs(y)
    caps = np.where(y > 0, TOP_PIECE, BOTTOM_PIECE)
    return np.where(level, caps, 1 + direction * _SLOPES + band)


def piece_horizons(corners: Array, piece: NDArray[np.integer]) -> Array:
    """Return how far the triangles (t, 3, 3) of each `piece` (t,) reach back along the edges of its cone.

    Returns
    -------
    (PIECES, 4) metres, object frame: the least of `edge · point`; +inf for a piece without triangles.
    """
    horizon = np.full((PIECES, 4), np.inf)
    for number in np.unique(piece).tolist():
        horizon[number] = (corners[piece == number].reshape(-1, 3) @ _EDGES[number].T).min(0)
    return horizon


def seen_pieces(horizon: Array, viewer: Array, among: NDArray[np.intp] = _EVERY) -> NDArray[np.int64]:
    """Return which pieces `among` these viewers may see, as bit masks (n,).

    A normal n of a piece is a sum of its cone's edges e with weights that are not negative. Where e·(C − p) ≤ 0 for
    all four edges and every point p of the piece, n·(C − p) ≤ 0 follows: its triangles turn their backs to C.

    Parameters
    ----------
    horizon : (n, k, 4) metres, see `piece_horizons`; −inf: always seen.
    viewer : (n, 3) C, object frame, metres.
    among : (k,) numbers of pieces.
    """
    ahead = (viewer @ _EDGES[among].reshape(-1, 3).T).reshape(-1, len(among), 4)
    ahead += _SLACK * np.linalg.norm(viewer, axis=1)[:, None, None]
    return np.asarray((ahead > horizon).any(-1) @ (1 << among))


def drawn_cases(pieces: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return the Case (n,) of bit masks of pieces (n,): which caps they hold."""
    return (pieces >> TOP_PIECE & 1) * Case.SIDE_AND_TOP + (pieces >> BOTTOM_PIECE & 1) * Case.SIDE_AND_BOTTOM


def piece_runs(
    first: NDArray[np.integer], count: NDArray[np.integer], pieces: int = ALL_PIECES
) -> tuple[tuple[int, int], ...]:
    """Return the runs of indices, first and number of each, that hold `pieces`, a bit mask.

    Parameters
    ----------
    first, count : (RANGES,) index ranges of one level; those that adjoin become one run.
    """
    wanted = np.flatnonzero((pieces >> np.arange(RANGES) & 1 > 0) & (count > 0))
    if not len(wanted):
        return ()
    start, stop = first[wanted], first[wanted] + count[wanted]
    breaks = np.flatnonzero(start[1:] != stop[:-1])
    starts, stops = start[np.append(0, breaks + 1)], stop[np.append(breaks, -1)]
    return tuple(zip(starts.tolist(), (stops - starts).tolist(), strict=True))
