"""Colour models by place, height and light, which turns a form into a material. Colours are sRGB, 0 to 1."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from tools.make_models.meshing import interpolated_occlusion
from tools.make_models.model import Model, vertex_normals
from tools.make_models.noise import fractal, ridged

ColourComponents = NDArray[np.float32]


def mix(a: ArrayLike, b: ArrayLike, share: NDArray[np.floating]) -> ColourComponents:
    """Return colours (n, 3) between `a` and `b`, (3,) or (n, 3) each; `share` (n,), clipped to 0 to 1, is that of b."""
    t = np.clip(share, 0, 1)[:, None]
    return (np.asarray(a) * (1 - t) + np.asarray(b) * t).astype(np.float32)


def smoothstep(low: float, high: float, x: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return 0 where `x` (n,) is below `low`, 1 above `high`, and a smooth step in between, as GLSL does."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return (t * t * (3 - 2 * t)).astype(np.float32)


def shaded(model: Model, bounding_radius: float, strength: float = 0.55, rays: int = 40) -> Model:
    """Return a model darkened where other surfaces are near.

    Parameters
    ----------
    model
        The model, metres.
    bounding_radius
        Distance within which surfaces darken each other, metres.
    strength
        Part of the light that the darkest places lose, 0 to 1.
    rays
        Number of rays per vertex, see `ambient_occlusion`.

    Returns
    -------
    Model
        The darkened model.
    """
    free = np.clip(interpolated_occlusion(model, bounding_radius, rays) * 1.12, 0, 1)
    return model.painted(model.colours * (1 - strength * (1 - free[:, None])))


def stone(
    model: Model, base: ArrayLike, dark: ArrayLike, cell: float, seed: int, dirt: ArrayLike = (0.33, 0.31, 0.26)
) -> Model:
    """Return a model painted as stone, of two tones in patches, and dirty where the form is hollow.

    Parameters
    ----------
    model
        The model, metres.
    base, dark
        (3,) the two tones, sRGB.
    cell
        Size of the patches, metres.
    seed
        Seed of the noise.
    dirt
        (3,) colour of the hollows, sRGB.

    Returns
    -------
    Model
        The painted model.
    """
    p = model.positions
    colours = mix(base, dark, 0.5 + 0.8 * fractal(p, cell, seed))
    colours = colours * (1 + 0.06 * fractal(p, cell / 12, seed + 9)[:, None])
    free = np.clip(interpolated_occlusion(model, 0.12 * float(np.ptp(p[:, 1])), 40) * 1.12, 0, 1)
    colours = mix(colours, np.asarray(dirt), 0.75 * (1 - free) ** 1.3)
    return model.painted(colours)


def veined(
    colours: ColourComponents, p: NDArray[np.float32], vein: ArrayLike, cell: float, seed: int
) -> ColourComponents:
    """Return colours with the veins of marble added: thin bent lines.

    Parameters
    ----------
    colours
        (n, 3) sRGB.
    p
        (n, 3) the points that have these colours.
    vein
        (3,) colour of the veins, sRGB.
    cell
        Distance between veins, about, in the unit of `p`.
    seed
        Seed of the noise.

    Returns
    -------
    ColourComponents
        (n, 3) sRGB.
    """
    bent = p + 0.35 * cell * np.stack([fractal(p, cell, seed + k) for k in (20, 30, 40)], axis=1)
    return mix(colours, vein, 0.55 * smoothstep(0.86, 0.98, ridged(bent, cell, seed, 3)))


def mossy(model: Model, amount: float, cell: float, seed: int) -> Model:
    """Return a model with patches of moss on surfaces that face up.

    Parameters
    ----------
    model
        The model, metres.
    amount
        How much of the surface the moss covers, 0 to 1, roughly.
    cell
        Size of the patches, metres.
    seed
        Seed of the noise.

    Returns
    -------
    Model
        The painted model.
    """
    up = vertex_normals(model)[:, 1]
    p = model.positions
    cover = smoothstep(0.9 - amount, 1.3 - amount, up + 0.55 * fractal(p, cell, seed))
    green = mix((0.23, 0.29, 0.10), (0.42, 0.47, 0.19), 0.5 + 0.9 * fractal(p, cell / 6, seed + 5))
    return model.painted(mix(model.colours, green, cover))
