"""Light of sun and sky as the shaders take it."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from depthwalk.colour import linear_from_srgb
from depthwalk.render.lighting.sky import Sky, Triple, direction_to_sun, sky_of, sunlight
from depthwalk.types import Array

if TYPE_CHECKING:
    from depthwalk.scene.environment import Environment


GROUND = 0.2  # part of the light that ground sends back, for the light from below: grass and soil
_STEPS = 48  # of the sphere, from pole to pole
POLYNOMIALS, UPRIGHT_POLYNOMIALS = 9, 3  # of the normal up to the second order; those of y alone, which come first
_NOTHING = 1e-6  # of the strongest: what no picture shows


@dataclass(frozen=True, kw_only=True)
class Lighting:
    """to_sun: (3,), unit, world; sun: (3,), linear, what a white surface shows that faces it; ambient: (9, 3), what
    light from everywhere adds to that, by the `polynomials` of the normal; sky: what is behind everything."""

    to_sun: Array
    sun: Array
    ambient: Array
    sky: Sky

    @property
    def defines(self) -> tuple[str, ...]:
        """Those of shaders/common/phong.glsl. Most skies are alike all around, which is a third of the arithmetic."""
        return ("UPRIGHT",) if self._upright else ()

    def uniforms(self) -> dict[str, Any]:
        """Those of shaders/common/phong.glsl, with `defines`."""
        return {
            "to_sun": tuple(self.to_sun.tolist()),
            "sun": tuple(self.sun.tolist()),
            "ambient": [
                tuple(each) for each in self.ambient[: UPRIGHT_POLYNOMIALS if self._upright else None].tolist()
            ],
        }

    @cached_property
    def _upright(self) -> bool:
        return bool(np.abs(self.ambient[UPRIGHT_POLYNOMIALS:]).max() <= _NOTHING * np.abs(self.ambient).max())


def lighting(environment: "Environment") -> Lighting:
    """Derive the light of an environment's sun, and of its sky or of `ambient:`. Once per frame, for all passes."""
    to_sun, sun, sky = direction_to_sun(environment), sunlight(environment), sky_of(environment)
    if environment.sky is not None and environment.sky.light:
        from_below = float(max(to_sun[1], 0)) * sun
        x, y, z = from_below.tolist()
        return Lighting(to_sun=to_sun, sun=sun, ambient=skylight(sky, (x, y, z)), sky=sky)
    ambient = np.zeros((POLYNOMIALS, 3))
    constant = linear_from_srgb(environment.ambient.colour) * environment.ambient.intensity
    ambient[0], ambient[1] = 0.75 * constant, 0.25 * constant  # a little less from below
    return Lighting(to_sun=to_sun, sun=sun, ambient=ambient, sky=sky)


@lru_cache(maxsize=8)
def skylight(sky: Sky, ground_sun: Triple) -> Array:
    """`irradiance` of a sky over ground that reflects `GROUND` of its light and of the sun's, which shows it white."""
    direction, _ = sphere_directions()
    above = direction[:, 1] > 0
    radiance = np.where(above[:, None], sky.radiance(direction), 0)
    up = polynomials(np.array([[0.0, 1, 0]])) @ irradiance(radiance)
    return irradiance(np.where(above[:, None], radiance, GROUND * (up + np.array(ground_sun))))


def polynomials(normal: Array) -> Array:
    """Spherical harmonics up to the second order, not normalised, (n, 9), of normals (n, 3); those of y alone first."""
    x, y, z = normal.T
    return np.column_stack([np.ones_like(x), y, 3 * y * y - 1, x, z, x * x - z * z, x * y, y * z, z * x])


def irradiance(radiance: Array) -> Array:
    """What white surfaces show, (9, 3) by `polynomials` of their normal, where the `sphere_directions` send a linear
    radiance (n, 3).

    Ramamoorthi and Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps": each order of the
    radiance counts 1, 2/3 and 1/4, what is beyond hardly at all.
    """
    direction, weight = sphere_directions()
    basis = polynomials(direction)
    square = weight * (basis**2).sum(0)
    counts = np.array([1, 2 / 3, 1 / 4, 2 / 3, 2 / 3, *[1 / 4] * 4])
    return (counts / square * weight)[:, None] * (basis.T @ radiance)


@lru_cache(maxsize=1)
def sphere_directions() -> tuple[Array, float]:
    """Directions (n, 3) that share the sphere evenly, and the solid angle of each."""
    y = 1 - (np.arange(_STEPS) + 0.5) * 2 / _STEPS
    turn = (np.arange(2 * _STEPS) + 0.5) * np.pi / _STEPS
    level = np.sqrt(1 - y * y)[:, None]
    parts = np.broadcast_arrays(level * np.cos(turn), y[:, None], level * np.sin(turn))
    direction = np.stack(parts, -1).reshape(-1, 3)
    return direction, 4 * np.pi / len(direction)
