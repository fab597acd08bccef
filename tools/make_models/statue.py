"""Make a draped woman with a bowl, on a plinth: the head of `heads` on a body that is modelled in the same way.

She is sculpted in centimetres and returned in metres. Functions of points `p` (n, 3) return signed distances (n,),
negative inside.
"""

import numpy as np
from tools.make_models.decimate import with_exact_count
from tools.make_models.heads import venus_head
from tools.make_models.meshing import polygonise
from tools.make_models.model import Model
from tools.make_models.noise import fractal, noise
from tools.make_models.paint import mossy, stone
from tools.make_models.relief import weathered
from tools.make_models.sdf import (
    Blob,
    Distance,
    Points,
    Rod,
    Stroke,
    box,
    difference,
    disc,
    ellipsoid,
    intersection,
    rod,
    sculpt,
    turned,
    union,
)

CHIN = 144.5  # the head frame's origin
PLINTH = 9.0  # its height; it lies below y = 0
CELL = 0.26  # centimetres: about a million triangles
DRYAD_TRIANGLES = 20_000

TORSO: list[Stroke] = [
    Blob((0, 122, -0.5), (14.2, 19, 10), 3.0),
    Rod((8, 136.5, -2), (16.5, 133.5, -1.5), 4.2, 5.0, 4.0),
    Rod((-8, 136.5, -2), (-16.5, 133.5, -1.5), 4.2, 5.0, 4.0),
    Blob((6.6, 123, 8.2), (5.2, 5.4, 4.6), 3.5),
    Blob((-6.6, 123, 8.2), (5.2, 5.4, 4.6), 3.5),
    Blob((0, 104, 0), (12, 15, 9.2), 4.0),
]
RIGHT_ARM: list[Stroke] = [
    Rod((-18, 133, -1.5), (-22.5, 108, -2.5), 4.7, 3.7, 2.0),
    Rod((-22.5, 108, -2.5), (-22, 85, 4), 3.8, 2.4, 1.5),
    Blob((-21.6, 79.5, 6), (2.0, 4.4, 3.2), 1.5, turn=(0, -20)),
    Rod((-21.2, 76.5, 8), (-20, 70, 9.5), 1.25, 0.8, 0.6),
    Rod((-22, 76, 6.5), (-21, 69, 7.5), 1.25, 0.8, 0.6),
    Rod((-22.4, 76, 5), (-21.8, 69.5, 5.4), 1.2, 0.75, 0.6),
]
LEFT_ARM: list[Stroke] = [
    Rod((18, 133, -1.5), (22, 109, -1), 4.7, 3.8, 2.0),
    Rod((22, 109, -1), (14, 107, 20), 3.8, 2.5, 1.5),
    Blob((11.5, 106.6, 24), (4.2, 1.8, 3.8), 1.5),
    Rod((9.5, 106.4, 26), (5, 106.8, 28), 1.2, 0.8, 0.6),
    Rod((10.5, 106.2, 27.4), (7, 106.4, 31), 1.2, 0.8, 0.6),
]


def folds(p: Points, count: float, wander: float, seed: int) -> Distance:
    """Return the heights (n,), 0 to 1, of the folds of drapery about the body's axis: round ridges, narrow valleys.

    Parameters
    ----------
    p
        (n, 3) points, centimetres.
    count
        Half the number of ridges that go round the body.
    wander
        How far the ridges stray from straight lines, radians of their phase.
    seed
        Seed of the noise.
    """
    angle = np.arctan2(p[:, 0], p[:, 2])
    slow = p * np.array([1, 0.12, 1], np.float32)
    phase = count * angle + wander * fractal(slow, 12, seed, 2)
    depth = 0.65 + 0.35 * noise(slow, 9, seed + 3)
    return (np.sqrt(np.abs(np.sin(phase))) * depth).astype(np.float32)


def skirt(p: Points) -> Distance:
    """Return the distances (n,) at `p` (n, 3), centimetres, to the long dress from the girdle to the ground.

    It falls over a bent left knee, and its hem trails.
    """
    fall = np.clip((98 - p[:, 1]) / 98, 0, 1)
    radius = 13.2 + 4.6 * np.sin(np.clip(fall * 4.2, 0, np.pi / 2)) - 1.5 * fall + 5.5 * fall**4
    depth = 0.78 + 0.12 * fall
    cone = (np.hypot(p[:, 0], p[:, 2] / depth) - radius) * 0.75
    legs = union(rod(p, (7, 86, 3), (8.5, 50, 12), 8.2, 6.6), rod(p, (8.5, 50, 12), (8, 6, 4), 6.6, 5.2), 4.0)
    shell = union(cone.astype(np.float32), legs, 5.0)
    knee = np.exp(-(((p[:, 0] - 8.5) / 7) ** 2) - ((p[:, 1] - 56) / 26) ** 2) * (p[:, 2] > 0)
    relief = (0.5 + 2.6 * np.sqrt(fall)) * (1 - 0.85 * knee)
    shell = shell - relief.astype(np.float32) * (folds(p, 9, 1.7, 5) - 0.75)
    return intersection(shell, np.maximum(p[:, 1] - 99, 0.5 - p[:, 1]), 1.5)


def overfold(p: Points) -> Distance:
    """Return the distances (n,) at `p` (n, 3), centimetres, to the upper cloth of the peplos, a Greek dress.

    It hangs from the shoulders over the girdle and ends in a waved hem at the hips.
    """
    fall = np.clip((112 - p[:, 1]) / 26, 0, 1)
    cloth = ellipsoid(p, (0, 112, 0.3), (15.2, 32, 11.3))
    flare = ((np.hypot(p[:, 0] / 1.22, p[:, 2]) - (9.6 + 5.2 * fall**1.3)) * 0.8).astype(np.float32)
    cloth = union(intersection(cloth, 101 - p[:, 1], 3), intersection(flare, np.abs(p[:, 1] - 98) - 14, 1), 3.0)
    cloth = union(cloth, sculpt(p, cloth, TORSO[3:5]) - 0.4, 1.0)
    girdle = np.exp(-(((p[:, 1] - 111) / 2.2) ** 2)).astype(np.float32)
    cloth = cloth + 1.2 * girdle - (0.75 + 1.05 * fall) * (folds(p, 11, 1.3, 9) - 0.6)
    hem = 85.5 + 2.2 * np.sin(5 * np.arctan2(p[:, 0], p[:, 2])) + 1.2 * noise(p, 5, 11)
    neckline = ellipsoid(p, (0, 143, 6), (11, 10.5, 9))
    return difference(intersection(cloth, hem.astype(np.float32) - p[:, 1], 0.8), neckline, 1.0)


def bowl(p: Points) -> Distance:
    """Return the distances (n,) at `p` (n, 3), centimetres, to a shallow offering bowl on the left palm."""
    q = p - np.array([7, 109.6, 28], np.float32)
    outer = ellipsoid(q, (0, 1.5, 0), (8, 4, 8))
    inner = ellipsoid(q, (0, 2.4, 0), (7.2, 3.6, 7.2))
    return difference(intersection(outer, q[:, 1] - 1.4, 0.3), inner, 0.3)


def figure(p: Points) -> Distance:
    """Return the distances (n,) at `p` (n, 3), centimetres, to figure and plinth."""
    body = sculpt(p, ellipsoid(p, (0, 90, 0), (15, 14, 10.5)), TORSO)
    body = sculpt(p, body, RIGHT_ARM + LEFT_ARM)
    body = union(body, rod(p, (0, 132, -2.5), (0, 152, -1.5), 6.0, 5.2), 3.0)
    head = turned(p - np.array([0, CHIN, 0.5], np.float32), (0, 0, -2), 1, 14)
    body = union(body, venus_head(head), 0.8)
    dressed = union(union(body, skirt(p), 1.0), overfold(p), 0.5)
    feet = union(ellipsoid(p, (8.5, 2, 17), (4, 3, 9)), ellipsoid(p, (-8, 2, 13), (4, 3, 8)), 0.5)
    dressed = union(union(dressed, feet, 1.0), bowl(p), 0.4)
    plinth = union(box(p, (0, -PLINTH / 2, 0), (27, PLINTH / 2, 25), 0.8), disc(p, 0.4, 23.5, 0.8, 0.5), 0.6)
    return union(dressed, plinth, 0.8)


def statue() -> Model:
    """Make the figure in chiselled, weathered limestone, closed, 1.8 m high with its plinth."""
    model = weathered(_hewn(CELL), 0.011, 133, chisel=0.07).grounded()
    return _coloured(model)


def dryad() -> Model:
    """Make the figure smooth and with few triangles, for depth images over which a relief is laid."""
    return _coloured(with_exact_count(_hewn(2 * CELL), DRYAD_TRIANGLES).grounded())


def _hewn(cell: float) -> Model:
    """Return the figure as marching cubes of `cell` centimetres leave it, metres."""
    return polygonise(figure, (-29, -PLINTH - 1, -27), (29, 170, 38), cell).scaled(0.01)


def _coloured(model: Model) -> Model:
    limestone = stone(model, (0.80, 0.77, 0.69), (0.66, 0.62, 0.54), 0.4, 131)
    return mossy(limestone, 0.05, 0.25, 132)
