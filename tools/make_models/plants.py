"""Make trees and a clipped bush: wood as tubes, foliage as thick leaves. Lengths are metres, Y is up."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from tools.make_models.leaves import BOX, OAK, brushes, leaf_pattern, leaves
from tools.make_models.model import Model, merged
from tools.make_models.noise import fractal, ridged
from tools.make_models.paint import mix, shaded, smoothstep
from tools.make_models.relief import displaced, grain
from tools.make_models.surfaces import Polyline, assembled, bevelled_profile, curve, dense, lathe, tube

from depthwalk.types import Array


def unit(v: Array) -> Array:
    """Return the vectors `v` (…, 3) scaled to length 1."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def scattered_directions(rng: np.random.Generator, count: int) -> Array:
    """Return (count, 3) unit vectors, uniform over the sphere, drawn from `rng`."""
    return unit(rng.normal(size=(count, 3)))


def bark(model: Model, light: ArrayLike, dark: ArrayLike, seed: int) -> Model:
    """Return the stem `model` painted as bark: grooves of the colour `dark` (3,), sRGB, on a ground of `light` (3,).

    The grooves run up the stem; `seed` chooses their places.
    """
    stretched = model.positions * np.array([1, 0.16, 1], np.float32)
    return model.painted(mix(light, dark, 0.5 + 1.3 * fractal(stretched, 0.07, seed, 3)))


def foliage(
    rng: np.random.Generator, centres: Array, radii: Array, count: int, size: float, slim: float, heart: Array
) -> tuple[Model, NDArray[np.intp]]:
    """Make leaves that clothe the clumps of a crown.

    Parameters
    ----------
    rng
        Source of random numbers.
    centres, radii
        (n, 3) and (n,) the clumps, metres.
    count
        Number of leaves.
    size
        Mean length of a leaf, metres.
    slim
        Greatest width of a leaf as a part of its length.
    heart
        (3,) middle of the whole crown, metres.

    Returns
    -------
    tuple[Model, NDArray[np.intp]]
        The leaves, and the clump (count,) to which each belongs.
    """
    clump = rng.choice(len(centres), count, p=radii**2 / (radii**2).sum())
    out = scattered_directions(rng, count)
    depth = 1 - 0.45 * rng.random(count) ** 2
    base = centres[clump] + out * (radii[clump] * depth)[:, None] * [1, 0.82, 1]
    hanging = unit(out + 0.7 * scattered_directions(rng, count) + [0, -0.35, 0])
    up = unit(0.8 * out + 0.5 * scattered_directions(rng, count) + [0, 0.7, 0])
    shading = unit(0.75 * out + 0.5 * unit(base - heart) + 0.35 * up)
    sizes = size * rng.uniform(0.7, 1.2, count)
    return leaves(base - 0.4 * sizes[:, None] * hanging, hanging, up, sizes, slim, shading, OAK), clump


def leaf_colours(
    rng: np.random.Generator,
    model: Model,
    outline: tuple[float, ...],
    young: ArrayLike,
    old: ArrayLike,
    group: NDArray[np.intp],
) -> Model:
    """Return leaves painted from old to young green: each group has a tone, each leaf differs a little from it.

    Parameters
    ----------
    rng
        Source of random numbers.
    model
        The leaves, as `leaves` returns them.
    outline
        The outline that `leaves` was given, which tells ribs and tips, painted lighter.
    young, old
        (3,) the two greens, sRGB.
    group
        (count,) the group of each leaf.

    Returns
    -------
    Model
        The painted leaves.
    """
    pattern = leaf_pattern(outline)
    count = len(model.positions) // len(pattern)
    tone = 0.3 * rng.normal(size=int(group.max()) + 1)[group] + 0.25 * rng.normal(size=count) + 0.45
    per_corner = np.repeat(tone, len(pattern)) + np.tile(pattern, count)
    return model.painted(mix(old, young, per_corner))


def clumps(rng: np.random.Generator, base: Array, size: float) -> NDArray[np.intp]:
    """Return the clump (n,) of about `size` metres in which each leaf grew, since shoots of one twig share their tone.

    `base` (n, 3) are the ends of the leaves' stalks, metres; `rng` blurs the borders of the clumps.
    """
    corners = np.floor((base + rng.normal(0, 0.3 * size, base.shape)) / size).astype(np.int64)
    return np.unique(corners, axis=0, return_inverse=True)[1].reshape(-1)


def crown_clumps(rng: np.random.Generator, heart: Array, extent: Array, count: int) -> tuple[Array, Array]:
    """Return centres (count, 3) and radii (count,), metres, of clumps of leaves, spread over an ellipsoid.

    `heart` (3,) is the ellipsoid's centre, `extent` (3,) are its half axes, metres. `rng` scatters the clumps.
    """
    k = np.arange(count) + 0.5
    y = 1 - 1.75 * k / count
    angle = k * np.pi * (3 - np.sqrt(5)) + rng.normal(0, 0.25, count)
    ring = np.sqrt(1 - y * y)
    shell = np.stack([ring * np.cos(angle), y, ring * np.sin(angle)], axis=1) * rng.uniform(0.72, 0.98, (count, 1))
    return heart + shell * extent, rng.uniform(0.25, 0.38, count) * extent.mean()


def limbs(rng: np.random.Generator, fork: Array, ends: Array, thickness: float) -> Model:
    """Make bent branches from around `fork` (3,), on the trunk, to each of `ends` (n, 3), metres.

    `thickness` is about the radius of a branch where it begins, metres; `rng` varies the branches.
    """
    parts = []
    for end in ends:
        start = fork + np.array([0, rng.uniform(-0.5, 0.35), 0])
        middle = 0.5 * (start + end) + [0, -0.12 * np.linalg.norm(end - start), 0] + rng.normal(0, 0.07, 3)
        path = curve([start, middle, end], 60)
        parts.append(tube(path, np.linspace(thickness, 0.18 * thickness, 60) * rng.uniform(0.7, 1.1), 24))
    return merged(parts)


def bark_relief(model: Model, depth: float, seed: int) -> Model:
    """Return the stem `model` with bark that furrows of up to `depth` metres split into plates; its foot stays level.

    `seed` chooses the places of the furrows.
    """
    p = model.positions
    plates = ridged(p * np.array([1, 0.3, 1]), 0.07, seed, 2)
    height = -depth * smoothstep(0.72, 0.92, plates) + 0.3 * depth * fractal(p, 0.03, seed + 5, 3)
    moved = displaced(model, height.astype(np.float32))
    above = np.maximum(moved.positions, [-np.inf, float(p[:, 1].min()), -np.inf])
    return replace(moved, positions=above.astype(np.float32))


def trunk(points: Polyline, base: float, top: float, seed: int) -> Model:
    """Make a trunk through `points` (n, 3), flared and ribbed at the foot.

    `base` and `top` are about its radii at the foot and at the top, metres; `seed` chooses the noise of its bark.
    """
    path = curve(points, 320)
    t = np.linspace(0, 1, 320)
    stem = tube(path, base + (top - base) * t**0.7 + 0.75 * base * np.exp(-t * 14), 200)
    p = stem.positions.astype(np.float64)
    axis = np.stack([np.interp(p[:, 1], path[:, 1], path[:, k]) for k in (0, 2)], axis=1)
    out = p[:, [0, 2]] - axis
    theta = np.arctan2(out[:, 1], out[:, 0])
    roots = 0.22 * np.exp(-p[:, 1] * 3.0) * np.sin(5 * theta + 1) + 0.06 * np.sin(9 * theta + 3 * p[:, 1])
    grain = 0.1 * fractal(p * [1, 0.25, 1], 0.12, seed, 3)
    p[:, [0, 2]] = axis + out * (1 + roots + grain)[:, None]
    p[:, 1] = np.maximum(p[:, 1], 0)  # the foot is level
    return bark_relief(Model(p.astype(np.float32), stem.faces, stem.colours), 0.012, seed + 20)


def oak() -> Model:
    """Make a broad-leaved tree, about 5 m high."""
    rng = np.random.default_rng(11)
    heart, extent = np.array([0.1, 3.35, 0.0]), np.array([1.75, 1.45, 1.7])
    centres, radii = crown_clumps(rng, heart, extent, 30)
    centres[::8] = heart + 0.45 * (centres[::8] - heart)  # some fill the middle
    stem = trunk([[0, -0.06, 0], [0.06, 0.8, 0.03], [-0.02, 1.6, -0.04], [0.1, 2.7, 0]], 0.17, 0.09, 5)
    wood = bark(
        merged([stem, limbs(rng, np.array([0.04, 2.0, 0.0]), centres, 0.07)]), (0.46, 0.38, 0.29), (0.2, 0.16, 0.12), 3
    )
    crown, clump = foliage(rng, centres, radii, 19_000, 0.135, 0.62, heart)
    green = leaf_colours(rng, crown, OAK, (0.58, 0.68, 0.25), (0.21, 0.37, 0.12), clump)
    return shaded(assembled(wood, green), 1.2, 0.52)


def fir() -> Model:
    """Make a conifer of drooping boughs, about 5.3 m high."""
    rng = np.random.default_rng(23)
    stem = tube(curve([[0, 0, 0], [0.03, 2, 0.02], [0, 5.15, 0]], 500), np.linspace(0.13, 0.012, 500), 96)
    wood = bark(bark_relief(stem, 0.008, 41), (0.42, 0.31, 0.24), (0.2, 0.14, 0.11), 4)
    level = np.sort(rng.uniform(0, 1, 158)) ** 0.85
    root = np.stack([np.zeros(158), 0.75 + 4.5 * level, np.zeros(158)], axis=1)
    angle = np.arange(158) * np.pi * (3 - np.sqrt(5)) + rng.normal(0, 0.2, 158)
    bounding_radius = (1.5 * (1 - level) ** 0.85 + 0.12) * rng.uniform(0.82, 1.12, 158)
    out = np.stack([np.cos(angle), np.zeros(158), np.sin(angle)], axis=1)
    base, tip, width, tone = boughs(rng, root, out, bounding_radius, 36)
    needles, outward = brushes(base, tip, 1.25 * width, 7, 13)
    shade = np.repeat(tone, len(outward)) + np.tile(0.5 * outward - 0.3, len(tone))
    needles = needles.painted(mix((0.10, 0.23, 0.15), (0.40, 0.55, 0.36), shade))
    return shaded(assembled(wood, needles), 1.0, 0.5)


def boughs(
    rng: np.random.Generator, root: Array, out: Array, bounding_radius: Array, twigs: int
) -> tuple[Array, Array, Array, Array]:
    """Place twigs along boughs that sag and lift at the end.

    Parameters
    ----------
    rng
        Source of random numbers.
    root
        (m, 3) points of the trunk at which the boughs begin, metres.
    out
        (m, 3) level unit vectors along the boughs.
    bounding_radius
        (m,) how far the boughs reach, metres.
    twigs
        Number of twigs of each bough.

    Returns
    -------
    tuple[Array, Array, Array, Array]
        Base (n, 3), tip (n, 3) and width (n,) of the twigs, metres; and their tone (n,), dark 0 to light 1, about.
    """
    t = np.tile(np.linspace(0.12, 1, twigs), (len(root), 1)) ** 0.8
    sag = (-0.42 * t + 0.22 * t**2.5)[..., None] * [0, 1, 0]
    at = root[:, None] + bounding_radius[:, None, None] * (t[..., None] * out[:, None] + sag)
    side = np.cross(out, [0, 1, 0])[:, None] * np.where(np.arange(twigs) % 2, 1, -1)[:, None]
    spread = (1.05 - 0.75 * t)[..., None]
    droop = np.array([0, -0.38, 0]) + 0.16 * rng.normal(size=(*t.shape, 3))
    heading = unit(0.75 * out[:, None] + spread * side + droop)
    size = (0.11 + 0.34 * bounding_radius[:, None] * (1.15 - t) * 0.62) * rng.uniform(0.8, 1.25, t.shape)
    tone = 0.25 + 0.3 * t + 0.16 * rng.normal(size=t.shape)
    flat = [a.reshape(-1, 3) for a in (at, at + size[..., None] * heading)]
    return flat[0], flat[1], (0.062 + 0.055 * size).reshape(-1), tone.reshape(-1)


def topiary() -> Model:
    """Make two clipped balls on a stem in a terracotta pot, about 1.6 m high."""
    rng = np.random.default_rng(31)
    centres, radii = np.array([[0, 0.86, 0], [0, 1.38, 0]]), np.array([0.325, 0.225])
    cores = [
        lathe(_ball(r * 0.86, 40), 80).moved(c).painted((0.07, 0.12, 0.05)) for c, r in zip(centres, radii, strict=True)
    ]
    count = 28_500
    ball = rng.choice(2, count, p=radii**2 / (radii**2).sum())
    out = scattered_directions(rng, count)
    base = centres[ball] + out * (radii[ball] * rng.uniform(0.86, 0.97, count))[:, None]
    heading = unit(out * 0.55 + scattered_directions(rng, count))
    box = leaves(base, heading, out, 0.034 * rng.uniform(0.75, 1.2, count), 0.6, unit(out + 0.3 * heading), BOX)
    green = leaf_colours(rng, box, BOX, (0.48, 0.60, 0.22), (0.13, 0.28, 0.09), clumps(rng, base, 0.1))
    stem = bark(tube([[0, 0.3, 0], [0.01, 0.8, 0], [0, 1.4, 0]], 0.036, 12), (0.4, 0.33, 0.26), (0.2, 0.16, 0.12), 8)
    return shaded(assembled(pot(), stem, *cores, green), 0.25, 0.6)


def _ball(radius: float, steps: int) -> Array:
    angle = np.linspace(-np.pi / 2, np.pi / 2, steps)
    profile = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    profile[[0, -1], 0] = 0
    return profile


def pot() -> Model:
    """Make a terracotta pot with earth in it, 0.36 m high."""
    outline: Polyline = [
        [0, 0],
        [0.17, 0],
        [0.2, 0.1],
        [0.235, 0.27],
        [0.26, 0.27],
        [0.268, 0.36],
        [0.235, 0.36],
        [0.225, 0.315],
        [0, 0.32],
    ]
    raw = lathe(dense(bevelled_profile(outline, 0.008), 0.005), 240)
    clay = displaced(raw, grain(raw.positions, 0.012, 0.0006, 44))
    p = clay.positions
    warm = mix((0.70, 0.40, 0.27), (0.56, 0.31, 0.22), 0.5 + 0.8 * fractal(p, 0.12, 40))
    inside = smoothstep(0.225, 0.215, np.hypot(p[:, 0], p[:, 2])) * (p[:, 1] > 0.3)
    return clay.painted(mix(warm, (0.2, 0.15, 0.11), inside))
