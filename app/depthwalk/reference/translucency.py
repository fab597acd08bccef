"""Compute light from translucent surfaces and blend it, as the twin of shaders/translucency.

Light is premultiplied by opacity, so that layers are blended by one rule whatever they hide (Porter and Duff 1984,
"Compositing Digital Images", the operator `over`). All colours are linear RGB.
"""

from dataclasses import replace

import numpy as np

from depthwalk.reference.light import Surfaces, phong
from depthwalk.types import Array


def translucent_light(
    surfaces: Surfaces,
    opacity: Array,
    view: Array,
    to_sun: Array,
    sun: Array,
    ambient: Array,
    emission: Array | float = 0.0,
) -> Array:
    """Return what translucent surfaces add to a picture: diffuse light by their opacity, and complete highlights.

    Highlights are reflected where light enters a surface, so transmitted light does not dim them.

    Parameters
    ----------
    surfaces
        The n surfaces.
    opacity
        (n,) part of the light from behind that each surface hides, 0 to 1.
    view, to_sun, sun, ambient
        The viewer and the light, as for `reference.light.phong`.
    emission
        (n, 3) linear RGB that the surfaces emit where they are opaque.

    Returns
    -------
    Array
        (n, 4) linear RGB, premultiplied, and opacity.
    """
    hidden = replace(surfaces, albedo=opacity[:, None] * surfaces.albedo)
    light = phong(hidden, view, to_sun, sun, ambient) + opacity[:, None] * emission
    return np.concatenate([light, opacity[:, None]], 1)


def in_fog(light: Array, through: Array, colour: Array) -> Array:
    """Return premultiplied light as seen through fog, which hides as much of it as of what is behind it.

    Blended over a picture that already has its fog, this equals fog in front of, between and behind the layers.

    Parameters
    ----------
    light
        (n, 4) linear RGB, premultiplied, and opacity.
    through
        (n,) transmittance of the fog between viewer and surface, see `reference.fog.fog_through`.
    colour
        (3,) linear RGB of the fog.

    Returns
    -------
    Array
        (n, 4) of the same kind.
    """
    part = through[:, None]
    return np.concatenate([part * light[:, :3] + (1 - part) * light[:, 3:] * colour, light[:, 3:]], 1)


def over(front: Array, behind: Array) -> Array:
    """Return premultiplied light `front` (…, 4) over `behind` (…, 4); a layer of opacity 0 is added."""
    return np.asarray(front + (1 - front[..., 3:]) * behind)
