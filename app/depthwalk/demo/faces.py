"""A classical head as a table of sculptor's strokes, in centimetres.

Head frame: chin near y = 0, crown near y = 22.5, the face looks to +Z, x > 0 is mirrored. The features common to both
heads are here; what makes a woman or a man of it is in `heads`.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.demo.sdf import (
    Blob,
    Distance,
    Points,
    Rod,
    Stroke,
    Vec3,
    difference,
    ellipsoid,
    intersection,
    length,
    mirrored,
    rod,
    sculpt,
    turned,
    union,
)

EYE: Vec3 = (3.15, 11.35, 7.35)
EYE_RADIUS = 1.28


@dataclass(frozen=True)
class Face:
    """The measures in which faces differ, centimetres.

    jaw: half width at the jaw's angle. brow: height of the brow ridge over the socket. lips: fullness, 1 is medium.
    opening: radius of the two arcs that bound the eye's opening; larger is narrower. nose: half width of its back.
    """

    jaw: float = 4.6
    chin: float = 1.5
    brow: float = 0.5
    lips: float = 1.0
    opening: float = 2.35
    nose: float = 0.72
    cheek: float = 1.0
    neck: float = 4.9


def skull(face: Face) -> list[Stroke]:
    """The large masses: cranium, face, jaw, cheekbones."""
    return [
        Blob((0, 14.3, -0.9), (7.3, 8.3, 9.4), 1.0),
        Blob((0, 9.6, 2.6), (6.15, 9.0, 6.3), 2.5),
        Blob((0, 14.9, 3.0), (5.9, 5.0, 6.0), 2.0),
        Rod((face.jaw, 4.6, -0.2), (1.2, 1.7, 6.8), 1.7, 1.6, 2.2),
        Blob((0, 4.3, 4.2), (4.2, 4.0, 4.4), 2.0),
        Blob((0, 1.6, 7.6), (face.chin + 0.4, 1.45, 1.5), 1.6),
        Blob((4.3, 8.6, 5.2), (1.9, 1.7, 2.1), 2.4),
        Rod((4.6, 9.2, 5.6), (6.6, 10.1, 0.5), 0.8, 0.7, 2.0),
        Blob((3.4, 6.6, 6.3), (1.8 * face.cheek, 2.2, 1.6 * face.cheek), 2.4),
    ]


def brows_and_sockets(face: Face) -> list[Stroke]:
    return [
        Blob((3.25, 11.2, 9.3), (2.3, 1.35, 1.75), 1.3, cut=True, turn=(1, 24)),
        Blob((1.7, 11.5, 9.3), (0.7, 0.9, 0.8), 0.9, cut=True),
        Rod((1.1, 13.0, 8.75), (3.6, 13.45, 8.0), 0.42 + 0.3 * face.brow, 0.42 + 0.25 * face.brow, 1.0),
        Rod((3.6, 13.45, 8.0), (5.7, 12.5, 5.9), 0.42 + 0.25 * face.brow, 0.4, 1.1),
    ]


def nose(face: Face) -> list[Stroke]:
    w = face.nose
    return [
        Rod((0, 13.6, 8.5), (0, 8.4, 10.75), w * 1.0, w * 0.9, 1.2),
        Rod((0, 11.0, 8.7), (0, 7.9, 9.5), 1.1 * w, 1.45 * w, 1.3),
        Blob((0, 7.8, 10.95), (w * 1.05, 0.72, 0.85), 0.7),
        Blob((1.22 * w / 0.72, 7.5, 9.75), (0.55, 0.66, 0.92), 0.45, turn=(1, 18)),
        Blob((0, 7.15, 10.3), (0.34, 0.3, 0.9), 0.35),
        Blob((0.66 * w / 0.72, 6.95, 10.15), (0.36, 0.42, 0.55), 0.3, cut=True, turn=(1, 14)),
        Rod((1.75, 8.3, 9.2), (2.05, 7.3, 9.0), 0.16, 0.1, 0.5, cut=True),
    ]


def mouth(face: Face) -> list[Stroke]:
    f = face.lips
    return [
        Blob((0, 5.3, 6.8), (3.0, 2.6, 2.55), 1.8),
        Rod((0.28, 5.28, 9.55), (2.25, 4.82, 8.45), 0.42 * f, 0.16, 0.4),
        Rod((0.0, 4.15, 9.4), (0.7, 4.15, 9.3), 0.52 * f, 0.5 * f, 0.4),
        Rod((0.7, 4.15, 9.3), (2.05, 4.62, 8.45), 0.5 * f, 0.16, 0.4),
        Rod((0.0, 4.72, 10.15), (1.2, 4.78, 9.75), 0.13, 0.13, 0.22, cut=True),
        Rod((1.2, 4.78, 9.75), (2.4, 4.7, 8.85), 0.13, 0.05, 0.25, cut=True),
        Blob((2.6, 4.7, 8.75), (0.35, 0.4, 0.35), 0.9, cut=True),
        Rod((0, 6.6, 9.95), (0, 5.75, 9.95), 0.2, 0.26, 0.45, cut=True),
        Blob((0, 3.05, 9.75), (1.5, 0.42, 0.75), 0.9, cut=True),
    ]


def eyes(p: Points, d: Distance, face: Face) -> Distance:
    """Adds eyeballs in lids whose almond-shaped opening is the overlap of two circles. p is mirrored."""
    q = turned(p, EYE, 2, -4.0)
    x, y = q[:, 0] - EYE[0], q[:, 1] - EYE[1]
    ball = length(p - np.asarray(EYE, np.float32)) - EYE_RADIUS
    r = face.opening
    front = EYE[2] - p[:, 2]
    upper = np.hypot(x, y + (r - 0.62)) - r
    lower = np.hypot(x, y - (r * 1.15 - 0.42)) - r * 1.15
    almond = np.maximum(np.maximum(upper, lower), front)
    lids = length(p - np.asarray(EYE, np.float32)) - (EYE_RADIUS + 0.22)
    fold = np.hypot(upper - 0.36, length(p - np.asarray(EYE, np.float32)) - (EYE_RADIUS + 0.45)) - 0.2
    fold = np.maximum(np.maximum(fold, front), np.maximum(np.abs(x) - 1.5, 0.2 - y))
    d = union(d, lids, 0.7)
    d = difference(d, fold, 0.3)
    d = difference(d, almond, 0.1)
    return union(d, ball, 0.04)


def pupils(p: Points, d: Distance) -> Distance:
    """Drills the pupil and grooves the iris, as Roman sculptors did. p is mirrored."""
    x, y = p[:, 0] - (EYE[0] - 0.06), p[:, 1] - (EYE[1] + 0.1)
    r = np.hypot(x, y)
    front = EYE[2] - p[:, 2]
    d = difference(d, np.maximum(np.abs(r - 0.6) - 0.05, front), 0.08)
    drilled = ellipsoid(p, (EYE[0] - 0.06, EYE[1] + 0.16, EYE[2] + EYE_RADIUS), (0.26, 0.24, 0.3))
    return difference(d, drilled, 0.08)


def ear(p: Points, d: Distance) -> Distance:
    """Adds the ear: a tilted dish with rim, inner fold, hollow and lobe. p is mirrored."""
    q = turned(turned(p, (6.7, 9.6, 0.6), 1, -24), (6.7, 9.6, 0.6), 0, -12)
    v, w = q[:, 1] - 9.6, q[:, 2] + 0.6
    outline = np.hypot(v / 3.1, (w + 0.1 * v * 0.3) / 1.75)
    rim = np.hypot((outline - 0.86) * 1.9, q[:, 0] - 7.45) - 0.34
    fold = np.hypot((np.hypot(v - 0.1, (w + 0.1) * 1.5) - 1.45) * 0.9, q[:, 0] - 7.25) - 0.26
    dish = ellipsoid(q, (7.0, 9.6, -0.6), (0.5, 3.0, 1.7))
    lobe = ellipsoid(q, (7.2, 6.9, -0.1), (0.45, 0.85, 0.75))
    hollow = ellipsoid(q, (7.75, 9.2, -0.1), (0.75, 1.3, 0.85))
    tragus = ellipsoid(q, (7.15, 9.0, 0.95), (0.4, 0.6, 0.35))
    shape = union(union(dish, np.maximum(rim, 6.7 - q[:, 0]), 0.35), np.maximum(fold, 6.7 - q[:, 0]), 0.3)
    shape = union(difference(union(shape, lobe, 0.5), hollow, 0.3), tragus, 0.3)
    return union(d, shape, 0.5)


def bare_head(p: Points, face: Face) -> Distance:
    """The head without hair, ears on, neck not."""
    m = mirrored(p)
    d = sculpt(m, np.full(len(p), np.float32(1e3)), skull(face))
    d = sculpt(m, d, brows_and_sockets(face))
    d = sculpt(m, d, nose(face))
    d = sculpt(m, d, mouth(face))
    return ear(m, eyes(m, d, face))


def neck(p: Points, face: Face) -> Distance:
    """The neck and its two leading muscles, from within the head down to y = −12."""
    m = mirrored(p)
    w = face.neck
    slim = ellipsoid(m, (0, -2, -2.6), (w, 24, w + 0.6))
    column = intersection(slim, np.abs(m[:, 1] + 4) - 9, 0.5)
    strap = rod(m, (5.3, 4.6, -2.4), (1.0, -7.5, 2.0), 1.0, 0.8)
    return union(column, strap, 1.6)
