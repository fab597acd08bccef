"""Make models that are hard to hold in depth images, each in its own way, for `depthwalk compare` and the tests.

All stand on y = 0; most are about 1 m high and mottled, so that a sample in the wrong place shows. They do not ship:
`python -m tools.make_models FOLDER NAME...` makes them.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from tools.make_models.meshing import polygonise
from tools.make_models.model import Model
from tools.make_models.noise import fractal
from tools.make_models.paint import mix
from tools.make_models.sdf import Blob, Distance, Field, Points, Rod, Stroke, difference, ellipsoid, rod, sculpt
from tools.make_models.surfaces import assembled, block, lathe, rounded_profile, tube

HALF_FLAT = 0.005  # m; half the thickness of the flat figure, 1 m high


def animal(cell: float = 0.008) -> Model:
    """Make a four-legged animal with long thin legs, a neck and a tail, of marching cubes of edge `cell`, metres."""
    return _mottled(_polygonised(_animal, (-0.62, -0.01, -0.2), (0.75, 1.02, 0.2), cell), (0.62, 0.44, 0.28), 1)


def plate(cell: float = 0.008) -> Model:
    """Make an upright plate with a straight and a slanting round hole, of marching cubes of edge `cell`, metres."""
    return _mottled(_polygonised(_plate, (-0.55, -0.05, -0.1), (0.55, 1.05, 0.1), cell), (0.46, 0.54, 0.62), 2)


def torus(sides: int = 48) -> Model:
    """Make a ring that lies slanting, so that no face looks straight through it.

    Its cross-section has `sides` vertices; four times as many go round the ring.
    """
    theta = np.linspace(0, 2 * np.pi, 4 * sides + 1)
    circle = np.stack([0.4 * np.cos(theta), 0 * theta, 0.4 * np.sin(theta)], -1)
    return _mottled(tube(circle, 0.11, sides).turned(0, 50).grounded(), (0.66, 0.36, 0.30), 3)


def flat_figure(cell: float = 0.004) -> Model:
    """Make a gingerbread man, a hundredth of his height thick, of marching cubes of edge `cell`, metres."""
    margin = HALF_FLAT + 2 * cell
    model = _polygonised(_flat_figure, (-0.4, -0.02, -margin), (0.4, 1.02, margin), cell)
    return _mottled(model, (0.70, 0.50, 0.30), 4)


def figure(cell: float = 0.006) -> Model:
    """Make a slim person of 1.75 m, arms and fingers spread, legs apart, of marching cubes of edge `cell`, metres.

    Three quarters of the cylinder that holds it are air, through which one sees what stands behind.
    """
    model = _polygonised(_figure, (-0.62, -0.02, -0.16), (0.62, 1.8, 0.24), cell)
    return _mottled(model, (0.64, 0.46, 0.38), 10)


def cup(segments: int = 160) -> Model:
    """Make a tall cup with walls of 1.5 cm and a handle; `segments` vertices go round it."""
    outer = rounded_profile([(0.27, 0.0), (0.30, 0.1), (0.34, 0.5), (0.38, 0.97)], 60)
    inner = outer[::-1] - [0.015, 0.0]
    inner = inner[inner[:, 1] > 0.03]
    profile = [[0.0, 0.0], *outer, [0.3725, 0.9775], *inner, [inner[-1, 0] - 0.01, 0.02], [0.0, 0.02]]
    bow = np.radians(np.linspace(-80, 80, 40))
    handle = np.stack([0.34 + 0.2 * np.cos(bow), 0.52 + 0.27 * np.sin(bow), 0 * bow], -1)
    return _mottled(assembled(lathe(profile, segments), tube(handle, 0.03, 24)), (0.80, 0.78, 0.72), 5)


def chair() -> Model:
    """Make a chair of laths with gaps between them: a lattice that hides itself many times over."""
    posts = [
        ((x, 0.0, z), (x + 0.045, 1.0 if z < 0 else 0.45, z + 0.045)) for x in (-0.25, 0.205) for z in (-0.25, 0.205)
    ]
    seat = [((-0.25, 0.45, z), (0.25, 0.47, z + 0.03)) for z in np.arange(-0.25, 0.23, 0.06)]
    back = [((x, 0.5, -0.24), (x + 0.02, 0.95, -0.22)) for x in np.arange(-0.18, 0.18, 0.06)]
    rails = [((-0.25, y, -0.245), (0.25, y + 0.04, -0.21)) for y in (0.5, 0.95)]
    rungs = [((x, 0.15, -0.24), (x + 0.025, 0.175, 0.24)) for x in (-0.24, 0.215)]
    return _mottled(assembled(*(block(*box) for box in (*posts, *seat, *back, *rails, *rungs))), (0.58, 0.41, 0.24), 6)


def coil(sides: int = 20) -> Model:
    """Make a spring of six turns, in which wire hides wire from the side; the wire has `sides` vertices round it."""
    theta = np.linspace(0, 2 * np.pi * 6, 6 * 6 * sides)
    path = np.stack([0.35 * np.cos(theta), theta / theta[-1], 0.35 * np.sin(theta)], -1)
    return _mottled(tube(path, 0.03, sides).grounded(), (0.50, 0.52, 0.55), 7)


def wheel(sides: int = 32) -> Model:
    """Make a wheel with twelve thin spokes, upright; its rim has `sides` vertices round it, six times as many along."""
    theta = np.linspace(0, 2 * np.pi, 6 * sides + 1)
    circle = np.stack([0.45 * np.cos(theta), 0.45 * np.sin(theta), 0 * theta], -1)
    angles = np.arange(12) * np.pi / 6
    spokes = [
        tube(np.outer([0.05, 0.45], [np.cos(a), np.sin(a), 0]) + np.array([0, 0, 0.03 * (-1) ** k]), 0.008, 12)
        for k, a in enumerate(angles)
    ]
    hub = tube([[0, 0, -0.08], [0, 0, 0.08]], 0.07, 2 * sides)
    return _mottled(assembled(tube(circle, 0.035, sides), hub, *spokes), (0.45, 0.40, 0.34), 8)


def links(sides: int = 40) -> Model:
    """Make three rings that go through each other like those of a chain; `sides` vertices round each cross-section."""
    theta = np.linspace(0, 2 * np.pi, 4 * sides + 1)
    flat = np.stack([0.25 * np.cos(theta), 0.25 * np.sin(theta), 0 * theta], -1)
    rings = [tube(flat[:, [0, 1, 2] if k % 2 else [0, 2, 1]] + [0.27 * (k - 1), 0, 0], 0.06, sides) for k in range(3)]
    return _mottled(assembled(*rings), (0.60, 0.55, 0.42), 9)


def _animal(p: Points) -> Distance:
    body = ellipsoid(p, (0, 0.62, 0), (0.42, 0.15, 0.13))
    legs: list[Stroke] = [
        Rod((0.9 * x, 0.56, 0.9 * z), (x, 0.03, z), 0.05, 0.018, 0.05) for x in (-0.3, 0.3) for z in (-0.08, 0.08)
    ]
    rest: list[Stroke] = [
        Rod((0.32, 0.66, 0), (0.55, 0.9, 0), 0.085, 0.05, 0.08),  # neck
        Blob((0.62, 0.91, 0), (0.11, 0.055, 0.05), 0.03, turn=(2, -25.0)),  # head
        Rod((0.53, 0.93, 0.03), (0.51, 1.0, 0.045), 0.014, 0.006, 0.01),  # ears
        Rod((0.53, 0.93, -0.03), (0.51, 1.0, -0.045), 0.014, 0.006, 0.01),
        Rod((-0.4, 0.66, 0), (-0.56, 0.36, 0), 0.025, 0.012, 0.03),  # tail
    ]
    return sculpt(p, body, [*legs, *rest])


def _plate(p: Points) -> Distance:
    q = np.abs(p - np.array([0, 0.5, 0], np.float32)) - np.array([0.5, 0.5, 0.04], np.float32)
    solid = np.maximum.reduce([q[:, 0], q[:, 1], q[:, 2]])
    hole = rod(p, (-0.15, 0.6, -1), (-0.15, 0.6, 1), 0.2, 0.2)
    slant = rod(p, (-0.45, 0.25, -1), (1.05, 0.25, 1), 0.08, 0.08)
    return difference(difference(solid, hole, 0.01), slant, 0.01)


def _flat_figure(p: Points) -> Distance:
    flat = p * np.array([1, 1, 0], np.float32)
    strokes: list[Stroke] = [
        Rod((0, 0.45, 0), (-0.17, 0.08, 0), 0.09, 0.07, 0.06),
        Rod((0, 0.45, 0), (0.17, 0.08, 0), 0.09, 0.07, 0.06),
        Rod((0, 0.6, 0), (-0.3, 0.5, 0), 0.08, 0.05, 0.06),
        Rod((0, 0.6, 0), (0.3, 0.5, 0), 0.08, 0.05, 0.06),
        Blob((0, 0.85, 0), (0.15, 0.15, 0.15), 0.05),
    ]
    outline = sculpt(flat, rod(flat, (0, 0.4, 0), (0, 0.6, 0), 0.13, 0.12), strokes)
    return np.maximum(outline, np.abs(p[:, 2]) - np.float32(HALF_FLAT))


def _figure(p: Points) -> Distance:
    trunk = ellipsoid(p, (0, 1.2, 0), (0.15, 0.27, 0.095))
    strokes: list[Stroke] = [
        Blob((0, 0.96, -0.01), (0.15, 0.11, 0.1), 0.06),  # hips
        Rod((0, 1.4, 0), (0, 1.56, 0.01), 0.055, 0.045, 0.04),  # neck
        Blob((0, 1.65, 0.015), (0.075, 0.105, 0.095), 0.02),
    ]
    for side in (-1, 1):
        strokes += [
            Rod((side * 0.09, 0.93, 0), (side * 0.18, 0.5, 0.03), 0.075, 0.05, 0.04),  # leg
            Rod((side * 0.18, 0.5, 0.03), (side * 0.25, 0.08, -0.01), 0.048, 0.028, 0.03),
            Rod((side * 0.25, 0.03, -0.03), (side * 0.29, 0.028, 0.15), 0.035, 0.022, 0.03),
            Rod((side * 0.15, 1.39, 0), (side * 0.34, 1.16, -0.02), 0.05, 0.036, 0.04),  # arm
            Rod((side * 0.34, 1.16, -0.02), (side * 0.48, 0.96, 0.09), 0.035, 0.022, 0.02),
            Blob((side * 0.5, 0.92, 0.115), (0.026, 0.045, 0.026), 0.015),  # hand
        ]
        for number in range(4):
            across = 0.02 * (number - 1.5)
            tip = (side * (0.54 + 0.6 * across), 0.83 + 0.3 * abs(across), 0.15 + 1.6 * across)
            strokes.append(Rod((side * 0.505, 0.895, 0.12 + across), tip, 0.009, 0.006, 0.006))
    return sculpt(p, trunk, strokes)


def _polygonised(field: Field, lower: ArrayLike, upper: ArrayLike, cell: float) -> Model:
    return polygonise(field, lower, upper, cell).grounded()


def _mottled(model: Model, colour: ArrayLike, seed: int) -> Model:
    """Return `model` painted with patches of `colour` and of a darker one, a hand wide, chosen by `seed`."""
    dark = 0.55 * np.asarray(colour)
    return model.painted(mix(colour, dark, 0.5 + fractal(model.positions, 0.15, seed)))


SPECIMENS: dict[str, Callable[[], Model]] = {
    "animal": animal,
    "plate": plate,
    "torus": torus,
    "flat_figure": flat_figure,
    "figure": figure,
    "cup": cup,
    "chair": chair,
    "coil": coil,
    "wheel": wheel,
    "links": links,
}
