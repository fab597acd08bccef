"""Make rocks, urn, column, fountain and sundial: carved, turned and weathered stone."""

import numpy as np
from tools.make_models.leaves import IVY, leaves
from tools.make_models.meshing import polygonise
from tools.make_models.model import Model, merged
from tools.make_models.noise import fractal, ridged
from tools.make_models.paint import mix, mossy, shaded, smoothstep, stone
from tools.make_models.plants import leaf_colours, unit
from tools.make_models.relief import weathered
from tools.make_models.sdf import Distance, Points, ellipsoid, intersection, union
from tools.make_models.surfaces import (
    Polyline,
    assembled,
    bevelled_profile,
    block,
    curve,
    dense,
    lathe,
    rounded_block,
    rounded_profile,
    tube,
)

from depthwalk.types import Array

LIMESTONE = ((0.80, 0.76, 0.67), (0.66, 0.61, 0.52))
GRANITE = ((0.60, 0.58, 0.55), (0.38, 0.37, 0.36))


def rock(size: tuple[float, float, float], planes: int, seed: int, cell: float) -> Model:
    """Make a boulder: an ellipsoid split by planes, then weathered.

    Parameters
    ----------
    size
        Half extents of the ellipsoid along x, y and z, metres.
    planes
        Number of the planes.
    seed
        Seed of the planes and of all noise.
    cell
        Edge of the marching cubes, metres.

    Returns
    -------
    Model
        The boulder, painted, on y = 0.
    """
    rng = np.random.default_rng(seed)
    normals = unit(rng.normal(size=(planes, 3))).astype(np.float32)
    normals[:, 1] = np.abs(normals[:, 1])
    support = np.sqrt(((normals * size) ** 2).sum(axis=1))
    offsets = (support * rng.uniform(0.62, 0.85, planes)).astype(np.float32)
    bend = 0.13 * min(size)

    def field(p: Points) -> Distance:
        q = p + bend * np.stack([fractal(p, 0.9 * min(size), seed + k, 2) for k in (50, 60, 70)], axis=1)
        d = union(
            ellipsoid(q, (0, 0, 0), size),
            ellipsoid(q, (0.6 * size[0], -0.3 * size[1], 0.2), np.multiply(size, 0.6)),
            0.1,
        )
        for normal, offset in zip(normals, offsets, strict=True):
            d = intersection(d, q @ normal - offset, 0.05 * min(size))
        d = d + 0.16 * min(size) * (ridged(p, 0.55 * min(size), seed, 5) - 0.6)
        d = d + 0.05 * min(size) * smoothstep(0.9, 0.98, ridged(p, 0.8 * min(size), seed + 7, 2))
        return intersection(d, -0.35 * size[1] - p[:, 1], 0.02)

    raw = polygonise(field, np.multiply(size, (-1.25, -0.45, -1.25)), np.multiply(size, 1.25), cell)
    mesh = weathered(raw, 0.02, seed + 80, 0.12).grounded()
    base = stone(mesh, *GRANITE, 0.35, seed)
    lichen = smoothstep(0.35, 0.6, fractal(base.positions, 0.16, seed + 11, 3))
    base = base.painted(mix(base.colours, (0.66, 0.66, 0.54), 0.7 * lichen))
    layered = 0.5 + 0.5 * fractal(base.positions * np.array([0.3, 2.5, 0.3]), 0.2, seed + 1, 3)
    return mossy(base.painted(mix(base.colours, (0.52, 0.44, 0.35), 0.5 * layered)), 0.5, 0.45, seed + 2)


def boulder() -> Model:
    """Make a round boulder, about 1.3 m wide."""
    return rock((0.75, 0.6, 0.62), 9, 3, 0.0029)


def slab_rock() -> Model:
    """Make a flat boulder, about 1.3 m wide."""
    return rock((0.8, 0.34, 0.5), 12, 8, 0.0025)


def urn() -> Model:
    """Make a garden urn with lobed belly, a garland in relief and two handles, 0.95 m high."""
    outline: Polyline = [
        [0, 0], [0.19, 0], [0.19, 0.05], [0.165, 0.075], [0.12, 0.11], [0.075, 0.17], [0.085, 0.2], [0.075, 0.225],
        [0.13, 0.28], [0.24, 0.38], [0.285, 0.50], [0.275, 0.60], [0.20, 0.70], [0.17, 0.76], [0.185, 0.82],
        [0.25, 0.885], [0.268, 0.91], [0.26, 0.935], [0.235, 0.93], [0.17, 0.86], [0.14, 0.78], [0.16, 0.7], [0, 0.62],
    ]  # fmt: skip
    fine = rounded_profile(outline, 4000)
    relief = (np.arange(4000) < 2400) & (fine[:, 1] > 0.4) & (fine[:, 1] < 0.68)
    rings = np.interp(np.linspace(0, 1, 700), np.cumsum(1 + relief) / np.sum(1 + relief), np.arange(4000))
    body = lathe(fine[np.unique(np.round(rings).astype(int))], 720, _urn_relief)
    handle = curve(
        [[0.26, 0.58, 0], [0.36, 0.64, 0], [0.38, 0.75, 0], [0.32, 0.83, 0], [0.25, 0.78, 0], [0.19, 0.75, 0]], 240
    )
    handles = [tube(handle, 0.018 + 0.007 * np.cos(np.linspace(0, 2 * np.pi, 240)), 64).turned(1, a) for a in (0, 180)]
    urn = weathered(merged([body, *handles]), 0.011, 16, chisel=0.05).grounded()
    return mossy(stone(urn, (0.82, 0.77, 0.68), (0.70, 0.63, 0.53), 0.2, 14), 0.12, 0.2, 15)


def _urn_relief(theta: Array, y: Array) -> Array:
    lobes = smoothstep(0.25, 0.3, y) * smoothstep(0.475, 0.44, y) * 0.1 * (np.abs(np.sin(10 * theta)) - 0.6)
    drop = 0.635 - 0.08 * np.abs(np.cos(2 * theta)) ** 1.2  # four swags hang from knots
    swag = np.exp(-(((y - drop) / 0.017) ** 2)) * (0.085 + 0.02 * np.sin(30 * theta)) * np.abs(np.cos(2 * theta)) ** 0.4
    knots = 0.09 * np.exp(-(((y - 0.64) / 0.022) ** 2)) * np.exp(-((np.sin(2 * (theta - np.pi / 4)) / 0.17) ** 2))
    beads = 0.06 * np.exp(-(((y - 0.455) / 0.012) ** 2)) * (0.6 + 0.4 * np.cos(36 * theta))
    rim = 0.025 * np.exp(-(((y - 0.9) / 0.016) ** 2)) * np.cos(24 * theta)
    return 1 + np.where(y < 0.925, lobes + swag + knots + beads + rim, 0)


def column() -> Model:
    """Make a fluted column with leafy capital and ivy that winds up, 3.2 m high."""
    # The foot is round, and its steps slope: a square one's corners would lie below the scrolls, a third layer deep,
    # and ledges of less than two texels would be missed.
    foot: Polyline = [
        [0, 0], [0.3, 0], [0.3, 0.11], [0.272, 0.15], [0.285, 0.2], [0.245, 0.23], [0.265, 0.265], [0.25, 0.3],
        [0.22, 0.31], [0, 0.31],
    ]  # fmt: skip
    base = lathe(dense(bevelled_profile(foot, 0.012), 0.005), 360)
    y = np.linspace(0.3, 2.62, 560)
    swell = 0.205 - 0.035 * ((y - 0.3) / 2.32) ** 1.6
    shaft = lathe(np.concatenate([[[0, 0.3]], np.stack([swell, y], axis=1), [[0, 2.62]]]), 720, _flutes)
    bell = lathe(
        dense(
            [[0, 2.6], [0.175, 2.6], [0.19, 2.63], [0.175, 2.66], [0.165, 2.7], [0.185, 2.9], [0.27, 3.06], [0, 3.06]],
            0.006,
        ),
        240,
    )
    plate = rounded_block([-0.29, 3.06, -0.29], [0.29, 3.17, 0.29], 0.006, 0.006)
    carved = weathered(merged([base, shaft, bell, plate, *_acanthus()]), 0.024, 22, 0.05)
    marble = stone(carved, *LIMESTONE, 0.5, 21)
    return shaded(assembled(marble, *_ivy()), 0.2, 0.35)


def _flutes(theta: Array, y: Array) -> Array:
    """Return factors on the radius for fourteen hollows between ridges, which end in plain rings below and above."""
    fluted = smoothstep(0.36, 0.42, y) * smoothstep(2.56, 2.5, y)
    return 1 - 0.08 * fluted * np.abs(np.sin(7 * theta)) ** 0.8


def _acanthus() -> list[Model]:
    """Make two rows of eight curling leaves and four corner scrolls, each a closed shell.

    No rib, lobe or gap is narrower than two texels of the column's depth images, 3 cm, which would show it torn.
    """
    lower = [_curled_leaf(0.185, 2.65, 0.19, 0.17).turned(1, 45 * k) for k in range(8)]
    upper = [_curled_leaf(0.175, 2.7, 0.31, 0.16).turned(1, 45 * k + 22.5) for k in range(8)]
    t = np.linspace(0, 1, 90)
    turns, radius = 2 * np.pi * (0.25 + 1.1 * t), 0.075 * (1 - 0.65 * t)
    scroll = np.stack([0.31 - radius * np.sin(turns - 1.9), 2.97 + radius * np.cos(turns - 1.9), 0 * t], axis=1)
    stalk = np.concatenate([curve([[0.2, 2.75, 0], [0.225, 2.9, 0], scroll[0]], 30)[:-1], scroll])
    scrolls = [tube(stalk, np.linspace(0.034, 0.028, len(stalk)), 20).turned(1, 45 + 90 * k) for k in range(4)]
    return lower + upper + scrolls


def _curled_leaf(radius: float, y: float, height: float, width: float) -> Model:
    """Make a lobed leaf that stands against a bell and rolls over at the top; on the +X side."""
    rows, columns = 42, 33
    v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
    lobes = 0.9 + 0.1 * np.abs(np.sin(2.5 * np.pi * v))
    half = 0.5 * width * np.sqrt(np.clip(1.02 - v**3, 0, 1)) * lobes
    curl = np.clip((v - 0.62) / 0.38, 0, 1)
    bend = 1.7 * curl
    rib = 0.012 * np.cos(2 * np.pi * u) * (1 - curl)  # one in the middle, and the raised edges
    out = radius + 0.02 + 0.02 * v + 0.16 * height * (1 - np.cos(bend)) + rib
    up = y + height * (np.minimum(v, 0.62) + 0.16 * np.sin(bend) * 1.4) - 0.015 * np.abs(u)
    z = u * half
    front = np.stack([out - 0.5 * z**2 / radius, up, z], axis=-1)
    back = front - 0.045 * np.stack([np.cos(bend), -np.sin(bend), 0 * z], axis=-1)
    return _shell(front, back)


def _shell(front: Array, back: Array) -> Model:
    """Make a closed solid between two grids (rows, columns, 3) that share their outline's order."""
    rows, columns = front.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    skin = np.stack([a, c, b, a, d, c], axis=-1).reshape(-1, 3)
    rim = np.concatenate([index[0], index[1:, -1], index[-1, -2::-1], index[-2:0:-1, 0]])
    following, other = np.roll(rim, -1), rows * columns
    edge = np.stack([rim, following, following + other, rim, following + other, rim + other], axis=1).reshape(-1, 3)
    positions = np.concatenate([front.reshape(-1, 3), back.reshape(-1, 3)]).astype(np.float32)
    faces = np.concatenate([skin, skin[:, ::-1] + other, edge]).astype(np.int32)
    return Model(positions, faces, np.ones_like(positions))


def _ivy() -> list[Model]:
    """Make a stem that winds up the shaft, and leaves along it."""
    rng = np.random.default_rng(17)
    t = np.linspace(0, 1, 160)
    angle = 1.0 + 9.5 * t + 0.4 * np.sin(17 * t)
    y = 0.02 + 2.35 * t + 0.05 * np.sin(29 * t)
    radius = 0.235 - 0.045 * t + 0.13 * np.exp(-t * 30)
    path = np.stack([radius * np.cos(angle), y, radius * np.sin(angle)], axis=1)
    stem = tube(path, np.linspace(0.014, 0.005, 160), 10).painted((0.33, 0.26, 0.17))
    count = 820
    at = np.sort(rng.beta(1.0, 1.35, count))
    here = np.stack([np.interp(at, t, path[:, k]) for k in range(3)], axis=1)
    turn = rng.normal(0, 0.34 * (1.1 - at), count)
    c, s = np.cos(turn), np.sin(turn)
    base = np.stack(
        [c * here[:, 0] - s * here[:, 2], here[:, 1] + rng.normal(0, 0.06, count), s * here[:, 0] + c * here[:, 2]],
        axis=1,
    )
    out = unit(base * [1, 0, 1])
    base = base + out * rng.uniform(-0.005, 0.03, count)[:, None]
    base[:, 1] = np.maximum(base[:, 1], 0.12)  # the tips stay above the ground
    hanging = unit(0.35 * out + [0, -0.8, 0] + 0.7 * unit(rng.normal(size=(count, 3))))
    ivy = leaves(
        base,
        hanging,
        unit(out + 0.3 * rng.normal(size=(count, 3))),
        0.1 * rng.uniform(0.65, 1.2, count),
        0.95,
        unit(out + np.array([0, 0.4, 0])),
        IVY,
    )
    return [stem, leaf_colours(rng, ivy, IVY, (0.45, 0.58, 0.24), (0.14, 0.29, 0.12), (at * 20).astype(int))]


def fountain() -> Model:
    """Make a round basin, two lobed bowls on a baluster, and the water, 1.75 m high and 2.4 m wide."""
    wall: Polyline = [
        [0, 0], [1.2, 0], [1.2, 0.09], [1.13, 0.12], [1.13, 0.36], [1.19, 0.39], [1.19, 0.46], [1.0, 0.46], [1.0, 0.2],
        [0, 0.2],
    ]  # fmt: skip
    stem: Polyline = [
        [0, 0.1], [0.3, 0.1], [0.3, 0.3], [0.2, 0.36], [0.13, 0.5], [0.19, 0.68], [0.12, 0.84], [0.16, 0.9], [0.1, 1.0],
        [0.08, 1.15], [0.12, 1.28], [0.07, 1.36], [0.05, 1.5], [0.075, 1.58], [0.055, 1.66], [0.02, 1.74], [0, 1.75],
    ]  # fmt: skip
    basin = lathe(dense(bevelled_profile(wall, 0.015), 0.006), 720, _panels)
    parts = [basin, lathe(rounded_profile(stem, 300), 240, _reeds), _bowl(0.62, 0.9), _bowl(0.36, 1.34)]
    rough = weathered(merged(parts), 0.024, 35, chisel=0.04)
    carved = mossy(stone(rough, *LIMESTONE, 0.6, 33), 0.1, 0.3, 34)
    waters = [_water(1.02, 0.37), _water(0.54, 1.0), _water(0.306, 1.412)]
    return shaded(assembled(carved, *waters), 0.4, 0.3)


def _panels(theta: Array, y: Array) -> Array:
    """Return factors on the radius for sixteen flat pilasters around the basin's wall."""
    wall = smoothstep(0.12, 0.14, y) * smoothstep(0.37, 0.35, y)
    return 1 + 0.012 * wall * np.sign(np.cos(16 * theta))


def _reeds(theta: Array, y: Array) -> Array:
    """Return factors on the radius for round reeds along the swelling parts of the fountain's stem."""
    swelling = smoothstep(0.5, 0.58, y) * smoothstep(0.82, 0.74, y) + smoothstep(1.16, 1.22, y) * smoothstep(
        1.34, 1.3, y
    )
    return 1 + 0.05 * swelling * np.abs(np.cos(8 * theta))


def _bowl(radius: float, y: float) -> Model:
    outline = np.array(
        [
            [0, -0.06],
            [0.2, -0.05],
            [0.6, 0.02],
            [0.9, 0.16],
            [1.0, 0.24],
            [1.02, 0.27],
            [0.97, 0.28],
            [0.85, 0.17],
            [0.5, 0.08],
            [0, 0.06],
        ]
    )
    profile = rounded_profile(outline * [radius, 0.55 * radius + 0.2], 180) + np.array([0, y])

    def lobes(theta: Array, height: Array) -> Array:
        share = (height - y) / (0.55 * radius + 0.2)
        return 1 + 0.05 * smoothstep(-0.05, 0.05, share) * smoothstep(0.24, 0.18, share) * (
            np.abs(np.sin(12 * theta)) - 0.5
        )

    return lathe(profile, 480, lobes)


def _water(radius: float, y: float) -> Model:
    """Make a thin disc with rings, as falling drops draw them."""
    r = np.concatenate([[0], np.linspace(0.01, 1, 110)]) * radius
    top = np.stack([r, y + 0.004 * np.sin(r * 60) * np.exp(-r * 1.5)], axis=1)[::-1]
    disc = lathe(np.concatenate([[[0, y - 0.006], [radius, y - 0.006]], top]), 240)
    share = np.hypot(disc.positions[:, 0], disc.positions[:, 2]) / radius
    return disc.painted(mix((0.42, 0.60, 0.64), (0.17, 0.38, 0.44), share + 0.3 * fractal(disc.positions, 0.2, 3)))


def sundial() -> Model:
    """Make a dial plate with gnomon on a baluster, 1.05 m high."""
    foot = rounded_block([-0.26, 0, -0.26], [0.26, 0.09, 0.26], 0.006, 0.004)
    outline: Polyline = [
        [0, 0.08],
        [0.2, 0.08],
        [0.2, 0.14],
        [0.12, 0.2],
        [0.1, 0.28],
        [0.16, 0.46],
        [0.11, 0.72],
        [0.09, 0.8],
        [0.17, 0.88],
        [0.24, 0.9],
        [0.24, 0.95],
        [0, 0.95],
    ]
    shaft = lathe(
        rounded_profile(outline, 600),
        760,
        lambda a, y: 1 + 0.03 * smoothstep(0.24, 0.32, y) * smoothstep(0.74, 0.66, y) * np.cos(12 * a),
    )
    rough = weathered(merged([foot, shaft]), 0.013, 43, chisel=0.05)
    pedestal = mossy(stone(rough, *LIMESTONE, 0.3, 41), 0.08, 0.2, 42)
    bronze = (0.45, 0.40, 0.24)
    plate = lathe(
        dense(bevelled_profile([[0, 0.945], [0.2, 0.945], [0.2, 0.96], [0, 0.962]], 0.004), 0.006), 240
    ).painted(bronze)
    hours = [
        block([0.14, 0.96, -0.004], [0.19, 0.967, 0.004]).turned(1, 15 * k).painted((0.78, 0.68, 0.38))
        for k in range(13)
    ]
    side = np.array([[0.14, 0.96], [-0.12, 0.96], [-0.12, 1.06]])
    gnomon = _shell(_triangle_grid(side, -0.006), _triangle_grid(side, 0.006)).turned(1, 90).painted(bronze)
    return shaded(assembled(pedestal, plate, *hours, gnomon), 0.15, 0.35)


def _triangle_grid(corners: Array, z: float) -> Array:
    """Return a grid (2, 2, 3) of one quadrilateral whose upper edge is short; `corners` are (3, 2), x and y."""
    a, b, c = (np.array([*corner, z]) for corner in corners)
    return np.array([[b, a], [c, c + np.array([0.012, -0.004, 0])]])
