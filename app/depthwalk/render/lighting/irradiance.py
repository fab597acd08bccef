"""Compute the light of sun and sky that surfaces receive, as uniforms of shaders/common/phong.glsl.

Ambient light depends on the direction that a surface faces, and so smoothly that nine numbers per colour hold it: the
coefficients of spherical harmonics up to the second order (Ramamoorthi and Hanrahan 2001, "An Efficient Representation
for Irradiance Environment Maps").
"""

from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from depthwalk.colour import linear_colour
from depthwalk.render.lighting.harmonics import LAMBERT, polynomials
from depthwalk.render.lighting.image_sky import ImageSky
from depthwalk.render.lighting.reflection import ReflectedSky
from depthwalk.render.lighting.sky import (
    PaintedSky,
    Sky,
    Triple,
    direction_to_sun,
    environment_sky,
    no_images,
    sunlight,
)
from depthwalk.types import Array

if TYPE_CHECKING:
    from depthwalk.render.lighting.sky import ReadImage
    from depthwalk.scene.environment import AmbientParams, Environment


GROUND = 0.2  # albedo of the ground below a sky, as of grass and soil, which reflects light upward
POLYNOMIALS = 9  # polynomials of the normal, up to the second order
UPRIGHT_POLYNOMIALS = 3  # those of the normal's y alone, which come first
_STEPS = 48  # rows of directions from pole to pole over which light is summed
_NEGLIGIBLE = 1e-6  # of the strongest coefficient: too little to show in any picture


@dataclass(frozen=True, kw_only=True)
class Lighting:
    """Hold the light of sun and sky.

    Attributes
    ----------
    to_sun
        (3,) unit vector to the sun, world.
    sun
        (3,) linear RGB of a white surface that faces the sun.
    ambient
        (9, 3) linear RGB of ambient light, added to `sun`: coefficients of the `polynomials` of the normal.
    sky
        The sky, seen behind everything.
    reflected
        The sky that surfaces reflect; None where it does not light the scene.
    """

    to_sun: Array
    sun: Array
    ambient: Array
    sky: Sky
    reflected: ReflectedSky | None = None

    @property
    def defines(self) -> tuple[str, ...]:
        """Return the defines of shaders/common/phong.glsl: `UPRIGHT` where `ambient` depends on y alone."""
        return ("UPRIGHT",) if self._upright else ()

    @property
    def key(self) -> Hashable:
        """Return a key that is equal for lights that light surfaces equally."""
        return self.to_sun.tobytes(), self.sun.tobytes(), self.ambient.tobytes()

    def uniforms(self) -> dict[str, Any]:
        """Return the uniforms of shaders/common/phong.glsl by name, for programs compiled with `defines`."""
        return {
            "to_sun": tuple(self.to_sun.tolist()),
            "sun": tuple(self.sun.tolist()),
            "ambient": [tuple(row) for row in self.ambient[: UPRIGHT_POLYNOMIALS if self._upright else None].tolist()],
        }

    @cached_property
    def _upright(self) -> bool:
        """Return whether ambient light depends only on the y of the normal."""
        return bool(np.abs(self.ambient[UPRIGHT_POLYNOMIALS:]).max() <= _NEGLIGIBLE * np.abs(self.ambient).max())


def lighting(environment: "Environment", read: "ReadImage" = no_images) -> Lighting:
    """Derive the light of sun and sky from the environment, once per frame for all passes.

    Parameters
    ----------
    environment
        What surrounds the objects. Its `ambient` light is used unless its sky gives light.
    read
        Returns the picture of the sky in a file.

    Returns
    -------
    Lighting
        The light, linear RGB.
    """
    to_sun, sun, sky = direction_to_sun(environment), sunlight(environment), environment_sky(environment, read)
    takes_sun = environment.sky is not None and environment.sky.is_sun
    if isinstance(sky, ImageSky) and takes_sun:
        to_sun, sun = sky.sun() or (to_sun, np.zeros(3))
    if environment.sky is not None and environment.sky.light:
        if isinstance(sky, ImageSky):
            reflected = ReflectedSky(sky=sky, with_sun=not takes_sun)
            ambient = sky.ambient(with_sun=not takes_sun)
            return Lighting(to_sun=to_sun, sun=sun, ambient=ambient, sky=sky, reflected=reflected)
        red, green, blue = (float(max(to_sun[1], 0)) * sun).tolist()  # on level ground
        ambient, ground = skylight(sky, (red, green, blue))
        reflected = ReflectedSky(sky=sky, ground=ground)
        return Lighting(to_sun=to_sun, sun=sun, ambient=ambient, sky=sky, reflected=reflected)
    return Lighting(to_sun=to_sun, sun=sun, ambient=_ambient(environment.ambient), sky=sky)


def _ambient(light: "AmbientParams") -> Array:
    """Return the coefficients (9, 3) of a hemisphere light."""
    return _hemisphere(light.colour, light.intensity, light.direction, light.contrast)


@lru_cache(maxsize=8)
def _hemisphere(colour: Triple, intensity: float, direction: Triple, contrast: float) -> Array:
    """Return the coefficients (9, 3) of light that falls from `intensity` by `contrast` with the cosine of the angle.

    Surfaces at right angles to its direction receive the mean of both extremes.
    """
    brightest = linear_colour(colour) * intensity
    x, y, z = -np.array(direction) / np.linalg.norm(direction)
    half = contrast / 2
    ambient = np.zeros((POLYNOMIALS, 3))
    ambient[[0, 1, 3, 4]] = np.outer([1 - half, half * y, half * x, half * z], brightest)  # 1 and the normal's y, x, z
    ambient.setflags(write=False)  # kept for later frames
    return ambient


@lru_cache(maxsize=8)
def skylight(sky: PaintedSky, ground_sun: Triple) -> tuple[Array, Triple]:
    """Return the light that surfaces receive from a sky, and from ground that reflects sky and sun by `GROUND`.

    Parameters
    ----------
    sky
        The sky, whose lower half is replaced by the ground.
    ground_sun
        Linear RGB of white level ground in the light of the sun.

    Returns
    -------
    tuple
        (9, 3) linear RGB coefficients, see `irradiance`, and the linear RGB of the ground.
    """
    direction, _ = sphere_directions()
    above = direction[:, 1] > 0
    radiance = np.where(above[:, None], sky.radiance(direction), 0)
    up = polynomials(np.array([[0.0, 1, 0]])) @ irradiance(radiance)
    ground = GROUND * (up + np.array(ground_sun))
    red, green, blue = ground[0].tolist()
    return irradiance(np.where(above[:, None], radiance, ground)), (red, green, blue)


def irradiance(radiance: Array) -> Array:
    """Project the light from all directions onto `polynomials` of a surface's normal.

    The cosine of Lambert's law multiplies the orders of the radiance by 1, 2/3 and 1/4, and hardly lets through higher
    ones (Ramamoorthi and Hanrahan 2001).

    Parameters
    ----------
    radiance
        (n, 3) linear RGB from each of the `sphere_directions`.

    Returns
    -------
    Array
        (9, 3) coefficients: `polynomials(normal) @ irradiance(radiance)` is the colour of white surfaces.
    """
    direction, weight = sphere_directions()
    basis = polynomials(direction)
    norm = weight * (basis**2).sum(0)
    return np.asarray((LAMBERT / norm * weight)[:, None] * (basis.T @ radiance))


@lru_cache(maxsize=1)
def sphere_directions() -> tuple[Array, float]:
    """Return directions spread evenly over the sphere, for integrals over all directions.

    Returns
    -------
    tuple[Array, float]
        (n, 3) unit vectors, world, and the solid angle of each, steradians.
    """
    y = 1 - (np.arange(_STEPS) + 0.5) * 2 / _STEPS
    turn = (np.arange(2 * _STEPS) + 0.5) * np.pi / _STEPS
    level = np.sqrt(1 - y * y)[:, None]
    parts = np.broadcast_arrays(level * np.cos(turn), y[:, None], level * np.sin(turn))
    direction = np.stack(parts, -1).reshape(-1, 3)
    return direction, 4 * np.pi / len(direction)
