"""Find how far a circle may move between segments: it stops at them, or slides along.

A segment lies wholly behind the line through its nearest point, across the way from there to the circle's centre. So
whoever stays in front of all these lines by the radius touches no segment, however long the motion is. Standing still
always does: a circle that overlaps segments counts as small enough not to. So it may move along them, also between two,
and away, but no closer; and it is never pushed.
"""

from itertools import combinations

import numpy as np

from depthwalk.walk.collision.outlines import Outlines, cosine

_SLACK = 1e-9  # metres, by which lines may be crossed
_MOST_LINES = 8  # that bound one motion, before it is shortened instead
_TOUCHING = 1e-6  # metres: a nearer segment has no direction
_PARALLEL = 1e-9  # sine of the angle between lines that meet nowhere

Line = tuple[complex, float]  # its unit normal, and the motion along it that is allowed at least, metres, ≤ 0


def slide(outlines: Outlines, position: complex, wanted: complex, radius: float) -> complex:
    """Return the motion of a circle that is nearest to the wanted one and brings it into no segment.

    Parameters
    ----------
    outlines
        The segments.
    position
        The circle's centre, metres, world x + i z.
    wanted
        The motion to make, metres.
    radius
        The circle's radius, metres.

    Returns
    -------
    complex
        The motion that is possible, metres, x + i z.
    """
    rows, away, distance = outlines.near(position, radius + abs(wanted))
    clear = distance > _TOUCHING
    if not clear.any():
        return wanted
    rows, distance, normals = rows[clear], distance[clear], away[clear] / distance[clear]
    free = min(radius, float(distance.min()))
    least = free - distance
    motion, lines = wanted, list[Line]()
    while True:
        along = cosine(normals, motion)
        crossed = np.flatnonzero(along < least - _SLACK)
        if len(crossed):  # lines, but perhaps far from their segments
            crossed = crossed[outlines.clearance(rows[crossed], position, motion) < free - _SLACK]
        if not len(crossed):
            return motion
        if len(lines) == _MOST_LINES:
            return motion * float((least[crossed] / along[crossed]).min())
        worst = crossed[(along - least)[crossed].argmin()]
        lines.append((complex(normals[worst]), float(least[worst])))
        motion = nearest_motion(wanted, lines)


def nearest_motion(wanted: complex, lines: list[Line]) -> complex:
    """Return the motion nearest to a wanted one that stays in front of lines: on one of them, or where two meet.

    Parameters
    ----------
    wanted
        The motion to make, metres, which crosses some of the lines.
    lines
        The lines.

    Returns
    -------
    complex
        The motion, metres.
    """
    best = 0j
    for motion in _candidates(wanted, lines):
        if all((normal.conjugate() * motion).real >= least - _SLACK / 2 for normal, least in lines):
            best = min(best, motion, key=lambda found: abs(found - wanted))
    return best


def _candidates(wanted: complex, lines: list[Line]) -> list[complex]:
    """Return the points of `lines` nearest to `wanted`, and those in which two of them meet."""
    found = [wanted + (least - (normal.conjugate() * wanted).real) * normal for normal, least in lines]
    for (normal, least), (other, less) in combinations(lines, 2):
        turn = (normal.conjugate() * other).imag
        if abs(turn) > _PARALLEL:
            found.append(1j * (less * normal - least * other) / turn)
    return found
