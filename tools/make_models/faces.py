"""Model a classical head as a table of sculptor's strokes, in centimetres.

In the head frame the chin is near y = 0 and the crown near y = 22.5; the face looks to +Z. Most features are modelled
for x > 0 and mirrored: `p` is then what `sdf.mirrored` returns. The features that both heads share are here; what makes
a woman or a man of them is in `heads`.
"""

from dataclasses import dataclass

import numpy as np
from tools.make_models.sdf import (
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

EYE: Vec3 = (3.15, 11.4, 7.3)
EYE_RADIUS = 1.25


@dataclass(frozen=True)
class Face:
    """Hold the measures in which faces differ.

    Attributes
    ----------
    jaw, chin, nose, neck
        Half widths, centimetres: at the jaw's angle, of the chin, of the back of the nose, of the neck.
    brow
        How far the ridge over the eye socket stands out, 0 to 1.
    lips, cheek
        Fullness; 1 is medium.
    mouth
        Width; 1 is medium.
    opening
        Radius of the two arcs that bound the eye's opening, centimetres; larger is narrower.
    """

    jaw: float = 4.6
    chin: float = 1.5
    brow: float = 0.5
    lips: float = 1.0
    opening: float = 2.35
    nose: float = 0.72
    cheek: float = 1.0
    mouth: float = 1.0
    neck: float = 4.9


def skull(face: Face) -> list[Stroke]:
    """Return the strokes of the large masses of `face`: cranium, jaw and cheekbones."""
    return [
        Blob((0, 14.3, -0.9), (7.3, 8.3, 9.4), 1.0),
        Blob((0, 9.6, 2.6), (6.15, 9.0, 6.3), 2.5),
        Blob((0, 14.9, 3.0), (5.9, 5.0, 6.0), 2.0),
        Rod((face.jaw, 4.6, -0.2), (1.2, 1.7, 6.8), 1.7, 1.6, 2.2),
        Blob((0, 4.3, 4.2), (4.2, 4.0, 4.4), 2.0),
        Blob((0, 1.6, 7.6), (face.chin + 0.4, 1.45, 1.5), 1.6),
        Blob((0, 2.6, 2.2), (3.6, 2.4, 4.4), 2.0),
        Blob((4.3, 8.6, 5.2), (1.9, 1.7, 2.1), 2.4),
        Blob((3.0, 9.3, 6.6), (1.9, 1.3, 1.5), 1.8),
        Rod((4.6, 9.2, 5.6), (6.6, 10.1, 0.5), 0.8, 0.7, 2.0),
        Blob((3.4, 6.6, 6.3), (1.8 * face.cheek, 2.2, 1.6 * face.cheek), 2.4),
    ]


def brows_and_sockets(face: Face) -> list[Stroke]:
    """Return the strokes that carve the eye sockets of `face` and raise the brows."""
    return [
        Blob((3.25, 11.2, 9.3), (2.3, 1.35, 1.75), 1.3, cut=True, turn=(1, 24)),
        Blob((1.7, 11.5, 9.3), (0.7, 0.9, 0.8), 0.9, cut=True),
        Rod((1.1, 13.0, 8.75), (3.6, 13.45, 8.0), 0.42 + 0.3 * face.brow, 0.42 + 0.25 * face.brow, 1.0),
        Rod((3.6, 13.45, 8.0), (5.7, 12.5, 5.9), 0.42 + 0.25 * face.brow, 0.4, 1.1),
    ]


def nose(face: Face) -> list[Stroke]:
    """Return the strokes of the nose of `face`."""
    w = face.nose
    return [
        Rod((0, 13.2, 8.55), (0, 8.7, 10.75), w, w * 0.88, 1.4),
        Rod((0, 11.2, 8.7), (0, 8.0, 9.4), 1.15 * w, 1.5 * w, 1.5),
        Blob((0, 8.2, 10.85), (w * 1.12, 0.72, 0.85), 0.8),
        Blob((1.14 * w / 0.72, 7.65, 9.65), (0.55, 0.68, 1.0), 0.7, turn=(1, 20)),
        Rod((0, 7.55, 10.7), (0, 7.1, 9.6), 0.34, 0.36, 0.45),
        Blob((0.62 * w / 0.72, 7.08, 10.1), (0.33, 0.4, 0.6), 0.35, cut=True, turn=(1, 14)),
        Rod((1.8, 8.4, 9.3), (2.15, 7.2, 9.1), 0.12, 0.08, 0.6, cut=True),
    ]


def mouth(face: Face) -> list[Stroke]:
    """Return the strokes of lips and chin of `face`."""
    f, w = face.lips, face.mouth
    return [
        Blob((0, 5.2, 6.8), (3.0, 2.6, 2.6), 1.8),
        Rod((0.42, 5.32, 9.42), (2.2 * w, 4.86, 8.5), 0.42 * f, 0.14, 0.5),
        Blob((0, 5.15, 9.45), (0.55, 0.36 * f, 0.4), 0.35),
        Rod((0, 4.1, 9.25), (0.8 * w, 4.14, 9.15), 0.55 * f, 0.52 * f, 0.45),
        Rod((0.8 * w, 4.14, 9.15), (2.0 * w, 4.6, 8.55), 0.52 * f, 0.14, 0.5),
        Rod((0, 4.68, 10.0), (1.2 * w, 4.76, 9.68), 0.12, 0.1, 0.3, cut=True),
        Rod((1.2 * w, 4.76, 9.68), (2.35 * w, 4.74, 8.9), 0.1, 0.02, 0.3, cut=True),
        Blob((2.6 * w, 4.75, 9.0), (0.3, 0.35, 0.3), 0.9, cut=True),
        Rod((0, 6.6, 9.9), (0, 5.8, 9.9), 0.16, 0.22, 0.5, cut=True),
        Blob((0, 3.05, 9.7), (1.5, 0.4, 0.75), 1.0, cut=True),
    ]


def eyes(p: Points, d: Distance, face: Face) -> Distance:
    """Return the distances `d` (n,) at mirrored points `p` (n, 3), centimetres, with eyes added as `face` has them.

    The almond-shaped opening between the lids is the overlap of two circles.
    """
    q = turned(p, EYE, 2, -4.0)
    x, y = q[:, 0] - EYE[0], q[:, 1] - EYE[1]
    r = face.opening
    bounding_radius = length(p - np.asarray(EYE, np.float32)) - EYE_RADIUS
    front = EYE[2] - p[:, 2]
    upper = np.hypot(x, y + (r - 0.68)) - r
    lower = np.hypot(x, y - (1.2 * r - 0.44)) - 1.2 * r
    almond = np.maximum(np.maximum(upper, lower), front)
    d = union(d, bounding_radius - 0.28, 0.9)
    d = union(d, np.maximum(np.hypot(upper - 0.14, bounding_radius - 0.2) - 0.2, np.abs(x) - 1.7), 0.3)
    d = difference(d, np.maximum(np.hypot(upper - 0.52, bounding_radius - 0.42) - 0.08, np.abs(x) - 1.45), 0.4)
    d = difference(d, almond, 0.24)
    return union(d, bounding_radius, 0.05)


def pupils(p: Points, d: Distance) -> Distance:
    """Return the distances `d` (n,) at mirrored points `p` (n, 3), centimetres, with pupils drilled.

    The iris is a groove around the pupil, as Roman sculptors made it.
    """
    x, y = p[:, 0] - (EYE[0] - 0.06), p[:, 1] - (EYE[1] + 0.1)
    ring = np.maximum(np.abs(np.hypot(x, y) - 0.58) - 0.02, EYE[2] - p[:, 2])
    groove = np.maximum(ring, EYE_RADIUS - 0.06 - length(p - np.asarray(EYE, np.float32)))
    d = difference(d, groove, 0.16)
    drilled = ellipsoid(p, (EYE[0] - 0.06, EYE[1] + 0.16, EYE[2] + EYE_RADIUS), (0.25, 0.22, 0.26))
    return difference(d, drilled, 0.12)


def ear(p: Points, d: Distance) -> Distance:
    """Return the distances `d` (n,) at mirrored points `p` (n, 3), centimetres, with an ear added.

    The ear is a tilted dish with rim, inner fold, hollow and lobe.
    """
    q = turned(turned(turned(p, (6.9, 10.6, 0.6), 2, -15), (6.7, 9.6, 0.6), 1, -20), (6.7, 9.6, 0.6), 0, -12)
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
    """Return the distances (n,) at `p` (n, 3), head frame, centimetres, to the head of `face` without hair or neck."""
    m = mirrored(p)
    d = sculpt(m, np.full(len(p), np.float32(1e3)), skull(face))
    d = sculpt(m, d, brows_and_sockets(face))
    d = sculpt(m, d, nose(face))
    d = sculpt(m, d, mouth(face))
    return ear(m, eyes(m, d, face))


def neck(p: Points, face: Face) -> Distance:
    """Return the distances (n,) at `p` (n, 3), head frame, centimetres, to the neck and its two leading muscles.

    The neck reaches from within the head down to y = −12, and is as wide as `face` says.
    """
    m = mirrored(p)
    w = face.neck
    slim = ellipsoid(m, (0, -2, -2.6), (w, 24, w + 0.6))
    column = intersection(slim, np.abs(m[:, 1] + 2) - 11, 0.5)
    strap = rod(m, (5.0, 7.0, -2.6), (1.0, -7.5, 1.8), 1.0, 0.8)
    return union(column, strap, 1.6)
