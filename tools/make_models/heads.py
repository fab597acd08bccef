"""Make the two busts of the paper's Table 1, a Venus (67,170 triangles there) and a bearded man (78,157).

Here each has about a million; `venus_of_the_paper` and `man_of_the_paper` have those counts. The busts are sculpted in
centimetres, in the head frame of `faces`, and returned in metres. Functions of points `p` (n, 3) return signed
distances (n,), negative inside.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from tools.make_models.decimate import with_exact_count
from tools.make_models.faces import Face, bare_head, neck, pupils
from tools.make_models.hair import curls, spread, strands
from tools.make_models.meshing import interpolated_occlusion, polygonise
from tools.make_models.model import Model
from tools.make_models.noise import fractal
from tools.make_models.paint import mix, smoothstep, veined
from tools.make_models.relief import chisel_marks, cracks, displaced, grain, pores
from tools.make_models.sdf import (
    Distance,
    Points,
    box,
    difference,
    disc,
    ellipsoid,
    intersection,
    mirrored,
    rod,
    turned,
    union,
)

VENUS_TRIANGLES = 67_170
MAN_TRIANGLES = 78_157
CELL = 0.093  # centimetres: about a million triangles

VENUS = Face(jaw=4.0, chin=1.1, brow=0.05, lips=1.15, mouth=0.84, opening=2.05, nose=0.6, cheek=1.15, neck=4.3)
MAN = Face(jaw=4.9, chin=1.9, brow=1.0, lips=0.95, opening=2.3, nose=0.82, cheek=0.9, neck=5.6)
FLOOR = -22.5  # the socle stands here
CHEST_UP = 3.5  # the chest's own frame lies this far above the head's


def chest(p: Points, face: Face, broad: float) -> Distance:
    """Return the distances (n,) to neck, shoulders and upper chest, cut round as busts are, on a turned socle.

    Parameters
    ----------
    p
        (n, 3) points, centimetres, head frame.
    face
        The measures, of which the neck's count.
    broad
        Scale of the shoulders; 1 is medium.
    """
    q = p - np.array([0, CHEST_UP, 0], np.float32)
    m = mirrored(q)
    body = ellipsoid(m, (0, -17.0, -2.6), (11.5 * broad, 8.0, 6.6 * broad))
    body = union(body, rod(m, (3.5, -9.8, -3.0), (13.0 * broad, -12.8, -3.2), 2.6, 3.4 * broad), 5.0)
    for side in (-4.2, 4.2):
        body = union(body, ellipsoid(q, (side, -16.8, 1.2), (4.6, 4.4, 3.6)), 4.0)
    d = union(neck(p, face), body, 4.5)
    d = difference(d, ellipsoid(q, (0, -10.6, 4.1), (0.8, 0.8, 0.7)), 1.8)
    d = union(d, rod(m, (1.2, -11.2, 2.7), (10.0 * broad, -10.6, -0.6), 0.42, 0.3), 1.5)
    cut = ellipsoid(m, (0, -3.5, -1.5), (12.2 * broad, 16.8, 14.0))
    return socle(q, intersection(d, cut, 0.35))


def socle(q: Points, d: Distance) -> Distance:
    """Return the distances `d` (n,), centimetres, with a round foot on a stem added under the bust, down to the floor.

    `q` (n, 3) are points in the chest's frame, centimetres.
    """
    q = q - np.array([0, 0, -1.6], np.float32)
    floor = FLOOR - CHEST_UP
    d = union(d, rod(q, (0, -22.8, 0), (0, -17.5, 0), 2.6, 3.6), 1.6)
    d = union(d, disc(q, -21.4, 4.0, 0.45, 0.4), 0.25)
    foot = union(disc(q, floor + 0.9, 6.4, 0.9, 0.3), disc(q, floor + 2.2, 5.4, 0.6, 0.55), 0.4)
    return union(d, foot, 0.8)


def posed(p: Points, turn: float, tilt: float) -> Points:
    """Return the points `p` (n, 3) in the frame of a head that is turned about the neck, and then tilted to its side.

    `turn` and `tilt` are in degrees.
    """
    return turned(turned(p, (0, 0, -2), 1, turn), (0, 0, -2), 2, tilt)


def venus_hair(p: Points) -> Distance:
    """Return the distances (n,) at `p` (n, 3), centimetres, head frame, to the woman's hair.

    It is parted in the middle and swept back in waves over the temples to a knot; a fillet holds it.
    """
    m = mirrored(p)
    cap = ellipsoid(m, (0, 14.5, -0.7), (8.2, 8.9, 10.4))
    cap = union(cap, ellipsoid(m, (5.6, 12.0, 0.6), (2.3, 3.6, 4.6)), 2.2)
    face = ellipsoid(m, (0, 8.8, 9.9), (6.5, 8.2, 8.4))
    below = box(p, (0, 2.0, 2.0), (30, 7.2, 11))
    cap = difference(difference(cap, face, 1.2), below, 1.6)
    cap = difference(cap, rod(p, (0, 24.2, 6.5), (0, 24.6, -4), 0.9, 0.9), 1.4)
    angle = np.arctan2(m[:, 0], p[:, 1] - 12.4).astype(np.float32)
    along = np.hypot(p[:, 2] - 8, 0.35 * (p[:, 1] - 18))
    locks = cap - np.float32(0.62) * (strands(angle, along, m, 3.4, 0.32, 5) - 0.4)
    return union(union(locks, _knot(p), 0.5), _fillet(p, cap), 0.15)


def _knot(p: Points) -> Distance:
    """Make the knot at the nape: a coil of hair."""
    q = p - np.array([0, 11.2, -12.2], np.float32)
    radius, angle = np.hypot(q[:, 0], q[:, 1]), np.arctan2(q[:, 1], q[:, 0])
    coil = 0.5 + 0.5 * np.cos(2 * np.pi * (radius / 1.5 - angle / (2 * np.pi)))
    fine = 0.5 + 0.5 * np.cos(2 * np.pi * (4 * radius / 1.5 - angle / (2 * np.pi)) + 2 * angle)
    return ellipsoid(p, (0, 11.2, -11.4), (4.2, 3.9, 3.4)) - (0.42 * coil + 0.12 * fine).astype(np.float32)


def _fillet(p: Points, hair: Distance) -> Distance:
    """Make a flat band around the hair, in a tilted plane."""
    plane = np.abs(0.86 * (p[:, 1] - 18.2) + 0.5 * (p[:, 2] - 1.0)) - 0.55
    return intersection(hair - np.float32(0.5), plane.astype(np.float32), 0.2)


def venus_head(p: Points) -> Distance:
    """Return the distances (n,) at `p` (n, 3), centimetres, head frame, to the woman's head with its hair."""
    return union(pupils(mirrored(p), bare_head(p, VENUS)), venus_hair(p), 0.25)


def venus_field(p: Points) -> Distance:
    """Return the distances (n,) at `p` (n, 3), centimetres, to the woman's whole bust."""
    return union(chest(p, VENUS, 0.9), venus_head(posed(p, 9, -4)), 1.4)


def man_mass(p: Points) -> Distance:
    """Return the distances (n,) at `p` (n, 3), centimetres, head frame, to the man's hair and beard without curls."""
    m = mirrored(p)
    hair = ellipsoid(m, (0, 14.4, -0.8), (8.0, 8.9, 10.4))
    hair = difference(hair, ellipsoid(m, (0, 8.6, 9.8), (6.6, 8.6, 8.0)), 1.2)
    hair = difference(hair, box(p, (0, 0.0, 4.0), (30, 8.0, 14.0)), 1.5)
    hair = difference(hair, ellipsoid(m, (7.6, 9.6, 0.4), (2.4, 3.0, 1.9)), 0.8)
    beard = rod(m, (6.3, 9.0, 1.5), (5.0, 4.2, 2.2), 0.9, 1.7)
    beard = union(beard, rod(m, (5.0, 4.0, 2.4), (1.4, 0.4, 7.2), 1.9, 2.6), 2.0)
    beard = union(beard, ellipsoid(m, (0, -1.4, 6.7), (3.6, 4.2, 3.1)), 2.0)
    beard = difference(beard, ellipsoid(m, (0, 4.5, 10.3), (2.3, 1.25, 2.4)), 0.8)
    return np.minimum(hair, beard)


@cache
def _curl_centres() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    coarse = polygonise(man_mass, (-12, -8, -13), (12, 26, 13), 0.5)
    centres = spread(coarse.positions, 1.75, 3)
    return centres, np.where(centres[:, 0] > 0, 1.0, -1.0)


def man_hair(p: Points) -> Distance:
    """Return the distances (n,) at `p` (n, 3), centimetres, head frame, to the man's hair and beard with curls."""
    mass = man_mass(p)
    near = np.abs(mass) < 3
    height = np.zeros(len(p), np.float32)
    height[near] = curls(p[near], *_curl_centres()[:1], 1.25, _curl_centres()[1])
    return mass - 0.85 * (height - 0.35)


def moustache(p: Points, d: Distance) -> Distance:
    """Return the distances `d` (n,) at `p` (n, 3), centimetres, head frame, with a moustache added."""
    m = mirrored(p)
    body = union(
        rod(m, (0.55, 5.95, 9.6), (2.3, 5.2, 8.8), 0.5, 0.55), rod(m, (2.3, 5.2, 8.8), (3.6, 3.2, 7.6), 0.55, 0.35), 0.4
    )
    hairs = np.sin(9 * (m[:, 1] + 0.55 * m[:, 0]) + 1.5 * np.sin(1.3 * m[:, 0]))
    return union(d, body - np.float32(0.1) * hairs, 0.2)


def man_field(p: Points) -> Distance:
    """Return the distances (n,) at `p` (n, 3), centimetres, to the man's whole bust."""
    h = posed(p, -8, 2)
    head = moustache(h, union(pupils(mirrored(h), bare_head(h, MAN)), man_hair(h), 0.2))
    return union(chest(p, MAN, 1.06), head, 1.0)


def venus_of_the_paper() -> Model:
    """Make the woman's bust with as many triangles as in the paper's Table 1."""
    return head_venus(VENUS_TRIANGLES)


def man_of_the_paper() -> Model:
    """Make the man's bust with as many triangles as in the paper's Table 1: an odd number, so one face is open."""
    return head_man(MAN_TRIANGLES)


def _rasped(model: Model, depth: float, seed: int) -> Model:
    """Return marble as the rasp left it: fine parallel scratches, and pores where the stone is open; centimetres."""
    p = model.positions
    height = chisel_marks(p, 0.42, depth, seed) + pores(p, 0.32, 3 * depth, seed + 5) + grain(p, 0.9, depth, seed + 6)
    return displaced(model, height + cracks(p, 16.0, 6 * depth, seed + 7))


def _cast(model: Model) -> Model:
    """Return bronze as it comes from the mould: pitted, and beaten flat here and there; centimetres."""
    p = model.positions
    return displaced(model, pores(p, 0.36, 0.05, 75) + grain(p, 0.8, 0.022, 76) + grain(p, 3.0, 0.03, 77, 2))


def _finished(model: Model, colours: NDArray[np.float32]) -> Model:
    return model.painted(colours).scaled(0.01).grounded()


def head_venus(count: int | None = None) -> Model:
    """Make a woman's bust in marble, closed, 0.46 m high, of `count` triangles; None makes about a million."""
    raw = polygonise(venus_field, (-14, FLOOR - 0.6, -16.5), (14, 25.5, 13), CELL)
    model = _rasped(raw, 0.012, 65) if count is None else with_exact_count(raw, count)
    p = model.positions
    marble = mix((0.90, 0.87, 0.81), (0.82, 0.78, 0.71), 0.5 + 0.7 * fractal(p, 9.0, 61))
    marble = veined(marble, p, (0.63, 0.59, 0.55), 11.0, 62)
    free = np.clip(interpolated_occlusion(model, 7.0, 64, ground=False) * 1.15, 0, 1)
    return _finished(model, mix(marble, (0.42, 0.34, 0.25), 0.8 * (1 - free) ** 1.2))


def head_man(count: int | None = None) -> Model:
    """Make a bearded man's bust in patinated bronze, 0.46 m high, of `count` triangles; None makes about a million.

    It is closed, but for a missing face of the underside where the count is odd.
    """
    raw = polygonise(man_field, (-16, FLOOR - 0.6, -13), (16, 25.5, 13), CELL)
    model = _cast(raw) if count is None else with_exact_count(raw, count)
    p = model.positions
    bronze = mix((0.64, 0.47, 0.28), (0.47, 0.33, 0.20), 0.5 + 0.8 * fractal(p, 5.0, 71))
    free = np.clip(interpolated_occlusion(model, 6.0, 64, ground=False) * 1.15, 0, 1)
    patina = mix((0.33, 0.52, 0.44), (0.20, 0.36, 0.32), 0.5 + 0.8 * fractal(p, 2.0, 72))
    green = smoothstep(0.25, 0.95, 1.25 * (1 - free) + 0.35 * fractal(p, 4.0, 73))
    colours = mix(bronze, patina, 0.85 * green) * (0.55 + 0.45 * free[:, None])
    return _finished(model, colours)
