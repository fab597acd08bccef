"""Find how far a circle may move between segments: it stops at them, or slides along.

A segment lies wholly behind the line through its nearest point, across the way from there to the circle's centre. So
whoever stays in front of all these lines by the radius touches no segment, however long the motion is. Standing still
always does: a circle that overlaps segments counts as small enough not to. So it may move along them, also between two,
and away, but no closer; and it is never pushed.
"""

from itertools import combinations

import numpy as np

from depthwalk.walk.collision.outlines import Outlines

_SLACK = 1e-9  # metres, by which lines may be crossed
_MOST_LINES = 8  # that bound one motion, before it is shortened instead
_TOUCHING = 1e-6  # metres: a nearer segment has no direction
_PARALLEL = 1e-9  # sine of the angle between lines that meet nowhere

Motion = tuple[float, float]
Line = tuple[float, float, float]  # its normal x, z, and the motion along it that is allowed at least, metres, ≤ 0


def slide(outlines: Outlines, position: Motion, wanted: Motion, radius: float) -> Motion:
    """Return the motion of a circle that is nearest to the wanted one and brings it into no segment.

    Parameters
    ----------
    outlines
        The segments.
    position
        The circle's centre, metres, world x and z.
    wanted
        The motion to make, metres.
    radius
        The circle's radius, metres.

    Returns
    -------
    Motion
        The motion that is possible, metres.
    """
    point, motion, lines = np.array(position), wanted, list[Line]()
    rows, away, distance = outlines.near(point, radius + float(np.hypot(*wanted)))
    clear = distance > _TOUCHING
    if not clear.any():
        return wanted
    rows, distance, normals = rows[clear], distance[clear], away[clear] / distance[clear, None]
    free = min(radius, float(distance.min()))
    least = free - distance
    while True:
        beyond = normals @ motion - least
        crossed = np.flatnonzero(beyond < -_SLACK)
        if len(crossed):  # lines, but perhaps far from the segments
            crossed = crossed[outlines.clearance(rows[crossed], point, np.array(motion)) < free - _SLACK]
        if not len(crossed):
            return motion
        if len(lines) == _MOST_LINES:
            share = float(np.min(least[crossed] / (beyond + least)[crossed]))
            return motion[0] * share, motion[1] * share
        worst = crossed[beyond[crossed].argmin()]
        lines.append((float(normals[worst, 0]), float(normals[worst, 1]), float(least[worst])))
        motion = nearest_motion(wanted, lines)


def nearest_motion(wanted: Motion, lines: list[Line]) -> Motion:
    """Return the motion nearest to a wanted one that stays in front of lines: on one of them, or where two meet.

    Parameters
    ----------
    wanted
        The motion to make, metres, which crosses some of the lines.
    lines
        The lines.

    Returns
    -------
    Motion
        The motion, metres.
    """
    best, least = (0.0, 0.0), np.inf
    for motion in _candidates(wanted, lines):
        if all(x * motion[0] + z * motion[1] >= shift - _SLACK / 2 for x, z, shift in lines):
            off = (motion[0] - wanted[0]) ** 2 + (motion[1] - wanted[1]) ** 2
            if off < least:
                best, least = motion, off
    return best


def _candidates(wanted: Motion, lines: list[Line]) -> list[Motion]:
    """Return the points of `lines` nearest to `wanted`, and those in which two of them meet."""
    found = []
    for x, z, shift in lines:
        short = shift - x * wanted[0] - z * wanted[1]
        found.append((wanted[0] + short * x, wanted[1] + short * z))
    for (x, z, shift), (u, w, other) in combinations(lines, 2):
        sine = x * w - z * u
        if abs(sine) > _PARALLEL:
            found.append(((shift * w - other * z) / sine, (x * other - u * shift) / sine))
    return found
