"""Compute how microfacet surfaces reflect lights and the sky, as shaders/light/reflected_sky.glsl does.

This is the twin of shaders/common/microfacet.glsl, too. Surfaces are GGX (Walter et al. 2007, "Microfacet Models for
Refraction through Rough Surfaces") of α = roughness², with the masking of Heitz 2014 and Schlick's Fresnel factor. All
colours are linear RGB.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.reference.image_sky import trilinear
from depthwalk.render.lighting.reflection import DIELECTRIC, LEAST_ROUGHNESS, ReflectedSky, reflected_parts
from depthwalk.types import Array


@dataclass(frozen=True, kw_only=True)
class Microfacets:
    """Hold what the reflection of n surfaces depends on.

    Attributes
    ----------
    base : (n, 3) linear RGB, of the diffuse reflection, or of metal's mirror reflection.
    metalness : (n,) 0 to 1.
    roughness : (n,) 0 to 1.
    normal : (n, 3) unit vectors, world.
    """

    base: Array
    metalness: Array
    roughness: Array
    normal: Array

    @property
    def reflectance(self) -> Array:
        """Return the part of light at normal incidence that is reflected, (n, 3)."""
        return np.asarray(DIELECTRIC + (self.base - DIELECTRIC) * self.metalness[:, None])


def microfacet(surfaces: Microfacets, view: Array, to_light: Array) -> Array:
    """Return the light that surfaces reflect from a light of strength 1, as `reference.light.reflected` does.

    Parameters
    ----------
    surfaces
        The n surfaces.
    view
        (n, 3) unit vectors from the viewer to the surfaces.
    to_light
        (n, 3) or (3,) unit vectors to the light.

    Returns
    -------
    Array
        (n, 3) linear RGB; zero where the surface faces away from the light.
    """
    lambert = (surfaces.normal * to_light).sum(-1)
    facing = np.maximum(np.abs((surfaces.normal * view).sum(-1)), 1e-3)
    square = np.maximum(surfaces.roughness, LEAST_ROUGHNESS) ** 4
    halfway = to_light - view
    halfway = halfway / np.linalg.norm(halfway, axis=-1, keepdims=True)
    cosine, incidence = (surfaces.normal * halfway).sum(-1), 1 - np.clip((halfway * to_light).sum(-1), 0, 1)
    lit = np.maximum(lambert, 1e-9)
    masking = lit * np.sqrt(facing**2 * (1 - square) + square) + facing * np.sqrt(lit**2 * (1 - square) + square)
    lobe = square / (cosine**2 * (square - 1) + 1) ** 2 * 0.5 / masking
    normally = surfaces.reflectance
    fresnel = normally + (1 - normally) * incidence[:, None] ** 5
    shown = (1 - surfaces.metalness[:, None]) * surfaces.base + fresnel * lobe[:, None]
    return np.asarray(np.where(lambert > 0, lambert, 0)[:, None] * shown)


def environment_brdf(facing: Array, roughness: Array) -> tuple[Array, Array]:
    """Return factor and summand that turn reflectances at normal incidence into the part of even light reflected.

    Parameters
    ----------
    facing
        (n,) cosines of the angle between normal and viewer.
    roughness
        (n,) of the surfaces.

    Returns
    -------
    tuple[Array, Array]
        (n,) each, from the table `reflected_parts`.
    """
    table = reflected_parts().astype(float)
    rows, columns, _ = table.shape
    y, x = roughness * (rows - 1), facing * (columns - 1)
    top, left = np.minimum(y.astype(int), rows - 2), np.minimum(x.astype(int), columns - 2)
    lower, right = (y - top)[:, None], (x - left)[:, None]
    upper = table[top, left] * (1 - right) + table[top, left + 1] * right
    found = upper * (1 - lower) + (table[top + 1, left] * (1 - right) + table[top + 1, left + 1] * right) * lower
    return found[:, 0], found[:, 1]


def lobe_direction(surfaces: Microfacets, view: Array) -> Array:
    """Return the directions from which surfaces reflect most, (n, 3), of any length; view: (n, 3), from the viewer.

    Rough ones reflect more from where they face than mirrors do (Lagarde and de Rousiers 2014, "Moving Frostbite to
    PBR", §4.9.3).
    """
    alpha = surfaces.roughness[:, None] ** 2
    part = (1 - alpha) * (np.sqrt(1 - alpha) + alpha)
    mirror = view - 2 * (view * surfaces.normal).sum(1, keepdims=True) * surfaces.normal
    return np.asarray(surfaces.normal * (1 - part) + mirror * part)


def mirrored(reflected: ReflectedSky, levels: tuple[NDArray[np.float16], ...], direction: Array, rough: Array) -> Array:
    """Look up the sky that surfaces reflect.

    Parameters
    ----------
    reflected
        The sky.
    levels
        Its `levels`.
    direction
        (n, 3) vectors of any length, world, see `lobe_direction`.
    rough
        (n,) roughness.

    Returns
    -------
    Array
        (n, 3) linear RGB.
    """
    values = reflected.uniforms(len(levels))
    level = np.maximum(values["roughest"] + 2 * np.log2(np.maximum(rough, 1e-3)), 0)
    return np.asarray(values["mirrored_intensity"] * trilinear(levels, direction, values["mirrored_turn"], level))


def sky_reflection(surfaces: Microfacets, view: Array, sky: Array, everywhere: Array, visibility: Array) -> Array:
    """Return the light of the sky that surfaces send to the viewer.

    Parameters
    ----------
    surfaces
        The n surfaces.
    view
        (n, 3) unit vectors from the viewer to them.
    sky
        (n, 3) the blurred sky in the `lobe_direction`, see `mirrored`.
    everywhere
        (n, 3) light from all sides on a white surface.
    visibility
        (n,) part of the light from all sides that nothing hides.

    Returns
    -------
    Array
        (n, 3) linear RGB. What leaves a surface after several reflections between facets comes from all sides
        (Fdez-Agüera 2019, "A Multiple-Scattering Microfacet Model for Real-Time Image-based Lighting"). Visibility of a
        narrow lobe: Lagarde and de Rousiers 2014, §4.10.
    """
    facing = np.clip(-(surfaces.normal * view).sum(-1), 0, 1)
    scale, bias = environment_brdf(facing, surfaces.roughness)
    scale, bias = scale[:, None], bias[:, None]
    metal = surfaces.metalness[:, None]
    glazed, shown = (_reflected_parts(normally, scale, bias) for normally in (np.array([DIELECTRIC]), surfaces.base))
    once, often = ((1 - metal) * one + metal * other for one, other in zip(glazed, shown, strict=True))
    through = surfaces.base * (1 - metal) * (1 - sum(glazed))
    lobe = np.exp2(-16 * surfaces.roughness - 1)
    seen = np.clip((facing + visibility) ** lobe - 1 + visibility, 0, 1)
    return np.asarray(seen[:, None] * once * sky + (often + through) * everywhere)


def _reflected_parts(normally: Array, scale: Array, bias: Array) -> tuple[Array, Array]:
    """Return the parts of even light that a surface reflects at once and after several reflections between facets.

    Parameters
    ----------
    normally
        Reflectance at normal incidence.
    scale, bias
        See `environment_brdf`.
    """
    average, rest = normally + (1 - normally) / 21, 1 - scale - bias
    once = normally * scale + bias
    return once, once * average / (1 - rest * average) * rest
