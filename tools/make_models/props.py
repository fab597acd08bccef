"""Make props: paving, bench, hedge, wall and pedestal, which ship as depth images; teapot, table and room as meshes."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from tools.make_models.leaves import BOX, leaves
from tools.make_models.model import Model, merged
from tools.make_models.noise import fractal, noise, ridged
from tools.make_models.paint import mix, shaded, smoothstep
from tools.make_models.plants import clumps, leaf_colours, unit
from tools.make_models.relief import displaced, grain, weathered
from tools.make_models.surfaces import (
    Polyline,
    assembled,
    block,
    curve,
    lathe,
    panel,
    rounded_block,
    rounded_profile,
    tube,
)

from depthwalk.types import Array

OAK_WOOD = ((0.60, 0.43, 0.27), (0.44, 0.29, 0.17))


def wooden(model: Model, along: int, seed: int) -> Model:
    """Return `model` painted as oak wood, its grain along the axis `along` (0, 1, 2 = x, y, z), chosen by `seed`."""
    stretch = np.full(3, 1.0)
    stretch[along] = 0.06
    return model.painted(mix(*OAK_WOOD, 0.5 + 0.9 * fractal(model.positions * stretch + seed, 0.05, seed, 3)))


def toned(rng: np.random.Generator, colour: ArrayLike, spread: float) -> Array:
    """Return `colour` (3,), sRGB, made lighter or darker by a part that `rng` draws, of the deviation `spread`."""
    return np.clip(np.asarray(colour) * (1 + spread * rng.normal()), 0, 1)


def path_tile() -> Model:
    """Make 2 m of garden path along z, 1.2 m wide: flagstones of unequal width on a bed of gravel, 6 cm high."""
    rng = np.random.default_rng(51)
    bed = rounded_block([-0.6, 0, -1], [0.6, 0.036, 1], 0.004, 0.004)
    gravel = 0.003 * ridged(bed.positions, 0.022, 54, 2)
    pebbles = mix((0.34, 0.31, 0.27), (0.56, 0.52, 0.45), 0.5 + noise(bed.positions, 0.02, 55))
    parts = [displaced(bed, gravel.astype(np.float32)).painted(pebbles)]
    for row in range(5):
        z, split = -1 + 0.4 * row, rng.uniform(-0.22, 0.22)
        for low, high in ((-0.6, split), (split, 0.6)):
            top = 0.055 + rng.uniform(-0.004, 0.005)
            flag = rounded_block([low + 0.012, 0.01, z + 0.012], [high - 0.012, top, z + 0.388], 0.018, 0.0034)
            worn = weathered(flag, 0.022, 56, chisel=0.05)
            parts.append(worn.painted(toned(rng, (0.62, 0.58, 0.52), 0.07)))
    tile = assembled(*parts)
    return shaded(tile.painted(tile.colours * (1 + 0.12 * fractal(tile.positions, 0.12, 52)[:, None])), 0.08, 0.4)


def bench() -> Model:
    """Make a garden bench of five slats and a back on two iron frames, 1.6 m wide; it faces +z."""
    seat = [([-0.8, 0.43, -0.21 + 0.095 * k], [0.8, 0.46, -0.13 + 0.095 * k]) for k in range(5)]
    back = [([-0.8, 0.56 + 0.13 * k, -0.285 - 0.02 * k], [0.8, 0.65 + 0.13 * k, -0.26 - 0.02 * k]) for k in range(3)]
    wood = [wooden(_plank(*plank, 160 + k), 0, 60 + k) for k, plank in enumerate(seat + back)]
    iron = merged([frame.moved([x, 0, 0]) for x in (-0.68, 0.68) for frame in _bench_frame()]).painted(
        (0.13, 0.16, 0.15)
    )
    return shaded(assembled(*wood, iron), 0.3, 0.45)


def _plank(lower: ArrayLike, upper: ArrayLike, seed: int) -> Model:
    """Make a board along x whose grain rain has raised."""
    board = rounded_block(lower, upper, 0.004, 0.0024)
    drawn = board.positions * np.array([0.05, 1, 1])
    split = -0.0022 * smoothstep(0.9, 0.99, ridged(drawn, 0.05, seed, 1))
    return displaced(board, (0.0009 * fractal(drawn, 0.012, seed, 2) + split).astype(np.float32))


def _bench_frame() -> list[Model]:
    leg = curve([[0, 0, 0.24], [0, 0.2, 0.19], [0, 0.42, 0.2]], 60)
    rear = curve([[0, 0, -0.33], [0, 0.25, -0.22], [0, 0.45, -0.22], [0, 0.98, -0.34]], 100)
    seat = curve([[0, 0.41, -0.22], [0, 0.4, 0], [0, 0.415, 0.23]], 60)
    arm = curve(
        [[0, 0.66, -0.27], [0, 0.7, -0.05], [0, 0.68, 0.2], [0, 0.62, 0.25], [0, 0.5, 0.21], [0, 0.42, 0.2]], 120
    )
    return [tube(path, 0.018, 32) for path in (leg, rear, seat, arm)]


def hedge() -> Model:
    """Make 2 m of clipped hedge along x, about 0.7 m deep and 0.8 m high."""
    rng = np.random.default_rng(71)
    half = np.array([1.06, 0.37, 0.29])
    core = rounded_block(-half * 0.93, half * 0.93, 0.05, 0.01).painted((0.17, 0.26, 0.10))
    count = 30_000
    areas = np.array([half[1] * half[2], half[0] * half[2], half[0] * half[1]])
    axis = rng.choice(3, count, p=areas / areas.sum())
    base = rng.uniform(-1, 1, (count, 3)) * half
    sign = np.where((axis == 1) | (rng.random(count) < 0.5), 1.0, -1.0)
    base[np.arange(count), axis] = sign * half[axis] * rng.uniform(0.9, 1, count)
    base[:, 1] = np.maximum(base[:, 1], 0.05 - half[1])  # the tips stay above the ground
    out = np.zeros((count, 3))
    out[np.arange(count), axis] = sign
    heading = unit(0.5 * out + unit(rng.normal(size=(count, 3))))
    box = leaves(base, heading, out, 0.045 * rng.uniform(0.7, 1.2, count), 0.62, unit(out + 0.35 * heading), BOX)
    green = leaf_colours(rng, box, BOX, (0.46, 0.58, 0.22), (0.15, 0.29, 0.10), clumps(rng, base, 0.16))
    return shaded(assembled(core, green), 0.3, 0.5)


def wall() -> Model:
    """Make 2 m of low brick wall along x with a stone coping, 0.8 m high."""
    rng = np.random.default_rng(81)
    mortar = rounded_block([-0.99, 0, -0.105], [0.99, 0.72, 0.105], 0.004, 0.006)
    parts = [displaced(mortar, grain(mortar.positions, 0.01, 0.0015, 82)).painted((0.62, 0.59, 0.53))]
    for row in range(9):
        for k in range(-1 * (row % 2), 8):
            low = max(-1.0, -1 + 0.25 * (k + 0.5 * (row % 2)))
            high = min(1.0, -1 + 0.25 * (k + 1 + 0.5 * (row % 2)))
            corners = [low + 0.006, 0.08 * row + 0.006, -0.115], [high - 0.006, 0.08 * row + 0.074, 0.115]
            brick = weathered(rounded_block(*corners, 0.005, 0.0052), 0.018, 83, 0.09)
            parts.append(brick.painted(toned(rng, (0.62, 0.34, 0.25), 0.12)))
    coping = [
        weathered(
            rounded_block([-1 + 0.5 * k, 0.72, -0.15], [-0.505 + 0.5 * k, 0.8, 0.15], 0.008, 0.0045),
            0.02,
            84,
            chisel=0.06,
        ).painted(toned(rng, (0.70, 0.66, 0.58), 0.05))
        for k in range(4)
    ]
    bricks = assembled(*parts, *coping)
    return shaded(bricks.painted(bricks.colours * (1 + 0.1 * fractal(bricks.positions, 0.05, 85)[:, None])), 0.2, 0.35)


def teapot() -> Model:
    """Make a round-bellied pot with lid, hooped handle and spout, blue on white, 0.2 m high."""
    outline: Polyline = [
        [0, 0], [0.055, 0], [0.06, 0.012], [0.085, 0.04], [0.098, 0.075], [0.09, 0.115], [0.06, 0.142], [0.052, 0.146],
        [0.055, 0.152], [0.05, 0.16], [0.03, 0.172], [0.012, 0.176], [0.011, 0.184], [0.018, 0.192], [0.012, 0.202],
        [0, 0.204],
    ]  # fmt: skip
    body = lathe(rounded_profile(outline, 46), 48)
    handle = tube(
        curve([[-0.08, 0.115, 0], [-0.12, 0.13, 0], [-0.15, 0.1, 0], [-0.135, 0.055, 0], [-0.085, 0.04, 0]], 30),
        0.0085,
        12,
    )
    spout_path = curve([[0.07, 0.05, 0], [0.115, 0.065, 0], [0.135, 0.105, 0], [0.165, 0.145, 0]], 26)
    spout = tube(spout_path, np.linspace(0.024, 0.011, 26) + 0.003 * np.linspace(0, 1, 26) ** 8, 16)
    pot = assembled(body, handle, spout)
    return shaded(pot.painted(_glaze(pot.positions.astype(np.float64))), 0.05, 0.35)


def _glaze(p: Array) -> NDArray[np.float32]:
    """Return white glaze with two blue bands, a wave between them, and blue on knob, handle and spout's tip."""
    theta, y = np.arctan2(p[:, 2], p[:, 0]), p[:, 1]
    wave = np.abs(y - 0.075 - 0.014 * np.sin(8 * theta)) - 0.005
    bands = np.minimum(np.abs(y - 0.045), np.abs(y - 0.108)) - 0.003
    radius = np.hypot(p[:, 0], p[:, 2])
    ornament = np.where(radius < 0.101, np.minimum(wave, bands), 1)
    ends = np.minimum(np.where(radius < 0.03, 0.186 - y, 1), 0.16 - np.hypot(p[:, 0], 0 * y) * np.sign(p[:, 0] + 1e-9))
    blue = smoothstep(0.002, -0.001, np.minimum(ornament, np.minimum(ends, p[:, 0] + 0.101)))
    return mix((0.93, 0.93, 0.90), (0.13, 0.22, 0.52), blue)


def table() -> Model:
    """Make a wooden table, 1.4 × 0.75 × 0.8 m, on turned legs."""
    top = wooden(block([-0.7, 0.71, -0.4], [0.7, 0.75, 0.4]), 0, 91)
    rails = [block([-0.6, 0.62, z - 0.012], [0.6, 0.71, z + 0.012]) for z in (-0.31, 0.31)]
    rails += [block([x - 0.012, 0.62, -0.31], [x + 0.012, 0.71, 0.31]) for x in (-0.6, 0.6)]
    outline: Polyline = [
        [0, 0],
        [0.022, 0],
        [0.03, 0.03],
        [0.018, 0.06],
        [0.03, 0.2],
        [0.036, 0.42],
        [0.022, 0.5],
        [0.036, 0.54],
        [0.036, 0.71],
        [0, 0.71],
    ]
    leg = lathe(rounded_profile(outline, 26), 16)
    legs = [leg.moved([x, 0, z]) for x in (-0.6, 0.6) for z in (-0.31, 0.31)]
    return shaded(assembled(top, wooden(merged(rails), 0, 92), wooden(merged(legs), 1, 93)), 0.3, 0.35)


def pedestal() -> Model:
    """Make a square plinth for busts, 0.5 m wide and 1.05 m high, of pale marble."""
    steps = [(0.25, 0, 0.12), (0.225, 0.12, 0.16), (0.19, 0.16, 0.92), (0.215, 0.92, 0.96), (0.245, 0.96, 1.05)]
    parts = [rounded_block([-h, low, -h], [h, high, h], 0.005, 0.0031) for h, low, high in steps]
    fields = [rounded_block([-0.13, 0.26, 0.185], [0.13, 0.82, 0.2], 0.005, 0.003).turned(1, 90 * k) for k in range(4)]
    plinth = weathered(merged(parts + fields), 0.014, 96, chisel=0.05).grounded()
    return shaded(
        plinth.painted(mix((0.80, 0.78, 0.74), (0.66, 0.64, 0.61), 0.5 + fractal(plinth.positions, 0.4, 95))), 0.25, 0.4
    )


BEYOND = 0.05  # metres by which walls go on behind what they meet: edges that only touch let pixels through


def room() -> Model:
    """Make a room seen from inside, 6 × 3 × 6 m: plank floor, plaster walls, a window in the wall at −z, skirting."""
    walls = [
        panel([-3, 0, 3], [0, 0, -6], [0, 3 + BEYOND, 0], (12, 6)),
        panel([3, 0, -3], [0, 0, 6], [0, 3 + BEYOND, 0], (12, 6)),
        panel([3 + BEYOND, 0, 3], [-6 - 2 * BEYOND, 0, 0], [0, 3 + BEYOND, 0], (12, 6)),
        *_opened_wall(),
        *_outside(),
    ]
    plaster = merged(walls)
    plaster = plaster.painted(mix((0.87, 0.84, 0.76), (0.80, 0.76, 0.68), 0.5 + fractal(plaster.positions, 1.1, 97)))
    ceiling = panel([-3, 3, -3], [6, 0, 0], [0, 0, 6], (8, 8)).painted((0.93, 0.92, 0.89))
    skirting = [block([-3, 0, -3], [3, 0.12, -2.97]), block([-3, 0, 2.97], [3, 0.12, 3])]
    skirting += [block([-3, 0, -2.97], [-2.97, 0.12, 2.97]), block([2.97, 0, -2.97], [3, 0.12, 2.97])]
    shell = merged([*_planks(), plaster, ceiling])
    shell = replace(shell, positions=shell.positions.round(6))  # what meets has the same vertices, to the bit
    return assembled(
        shaded(shell, 0.9, 0.25),
        merged(skirting + _window()).painted((0.90, 0.88, 0.83)),
    )


def _planks() -> list[Model]:
    """Make floorboards along z, 0.2 m wide, each of two lengths and of its own tone.

    All have vertices at the same z, so that no gaps open between them.
    """
    rng = np.random.default_rng(98)
    boards = []
    for k in range(30):
        joint = int(rng.integers(4, 13))
        for first, last in ((0, joint), (joint, 16)):
            low, high = (-3 + 0.375 * cut for cut in (first, last))
            board = panel([-3 + 0.2 * k, 0, low], [0, 0, high - low], [0.2, 0, 0], (last - first, 2))
            boards.append(board.painted(wooden(board, 2, 99 + k).colours * (1 + 0.1 * rng.normal())))
    return boards


OPENING = (-0.9, 0.9, 0.95, 2.35)  # left, right, lower and upper edge, metres


def _opened_wall() -> list[Model]:
    """Make the wall at z = −3 around the window's opening, inside and outside, and the opening's four inner sides."""
    left, right, low, high = OPENING
    columns = (-3 - BEYOND, left, 5), (left, right, 4), (right, 3 + BEYOND, 5)  # from, to, cells
    rows = (0.0, low, 2), (low, high, 3), (high, 3 + BEYOND, 2)
    around = [
        panel([begin if z == -3 else end, bottom, z], [sign * (end - begin), 0, 0], [0, top - bottom, 0], (across, up))
        for z, sign in ((-3, 1), (-3.25, -1))
        for begin, end, across in columns
        for bottom, top, up in rows
        if (begin, bottom) != (left, low)
    ]
    sides = [
        panel([left, low, -3], [0, high - low, 0], [0, 0, -0.25], (3, 1)),
        panel([right, high, -3], [0, low - high, 0], [0, 0, -0.25], (3, 1)),
        panel([left, high, -3], [right - left, 0, 0], [0, 0, -0.25], (4, 1)),
        panel([right, low, -3], [left - right, 0, 0], [0, 0, -0.25], (4, 1)),
    ]
    return around + sides


def _outside() -> list[Model]:
    """Make the roof and the outer sides of the walls at both ends of x.

    Nobody sees them, but beside a corner the sun must find more before it than the wall itself, which is no thicker
    than what shadow maps resolve.
    """
    edge, north, across, up = 3 + BEYOND, -3.25, [0, 0, 6.25], [0, 3 + BEYOND, 0]
    return [
        panel([-edge, 0, north], across, up, (1, 1)),
        panel([edge, 0, 3], [0, 0, -6.25], up, (1, 1)),
        panel([-edge, edge, 3], [2 * edge, 0, 0], [0, 0, -6.25], (1, 1)),
    ]


def _window() -> list[Model]:
    """Make the window's sill, frame and bars."""
    left, right, low, high = OPENING
    sill = block([left - 0.08, low - 0.05, -3.05], [right + 0.08, low, -2.85])
    upright = [block([x - 0.03, low, -3.2], [x + 0.03, high, -3.14]) for x in (left + 0.03, 0.0, right - 0.03)]
    level = (low + 0.03, 0.5 * (low + high), high - 0.03)
    return [sill, *upright, *(block([left, y - 0.03, -3.195], [right, y + 0.03, -3.145]) for y in level)]
