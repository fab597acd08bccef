"""Model the sky: its radiance by direction, as two colours or as daylight, and the colour of the sun.

`image_sky` is about pictures of a sky.

Daylight is the analytic model of Preetham, Shirley and Smits 1999, "A Practical Analytic Model for Daylight". Here it
is evaluated for many directions at once, for the light that falls on surfaces; shaders/common/sky.glsl evaluates it per
pixel, from the uniforms of a sky.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from depthwalk.colour import linear_colour
from depthwalk.errors import InputError
from depthwalk.render.lighting.image_sky import ImageSky, SkyImage
from depthwalk.types import Array

if TYPE_CHECKING:
    from depthwalk.scene.environment import Environment

Triple = tuple[float, float, float]

# kcd/m² of a white surface that faces a sun of intensity 1 and so has a colour of 1; above the air it receives 128 klx.
_WHITE = 128 / np.pi
# Preetham et al., appendix A.2: coefficients A to E of luminance Y and chromaticity x and y, by turbidity and 1.
_PEREZ = np.array(
    [
        [[0.1787, -1.4630], [-0.0193, -0.2592], [-0.0167, -0.2608]],
        [[-0.3554, 0.4275], [-0.0665, 0.0008], [-0.0950, 0.0092]],
        [[-0.0227, 5.3251], [-0.0004, 0.2125], [-0.0079, 0.2102]],
        [[0.1206, -2.5771], [-0.0641, -0.8989], [-0.0441, -1.6537]],
        [[-0.0670, 0.3703], [-0.0033, 0.0452], [-0.0109, 0.0529]],
    ]
)
# Chromaticity x and y at the zenith (appendix A.2): rows by turbidity², turbidity, 1; columns by θ³, θ², θ, 1 of the
# sun's angle θ from the zenith.
_ZENITH = np.array(
    [
        [
            [0.00166, -0.00375, 0.00209, 0],
            [-0.02903, 0.06377, -0.03202, 0.00394],
            [0.11693, -0.21196, 0.06052, 0.25886],
        ],
        [
            [0.00275, -0.00610, 0.00317, 0],
            [-0.04214, 0.08970, -0.04153, 0.00516],
            [0.15346, -0.26756, 0.06670, 0.26688],
        ],
    ]
)
# CIE XYZ to linear RGB of Rec. 709; shaders read it.
RGB_FROM_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
_WAVELENGTHS = np.array([0.68, 0.55, 0.44])  # µm; they stand for red, green and blue
_TWILIGHT = np.radians(3.0)  # angle of the sun below the horizon at which the sky's light has fallen to a tenth


class PaintedSky(ABC):
    """Give a sky's radiance by a formula."""

    @abstractmethod
    def radiance(self, direction: Array) -> Array:
        """Return the colour of the sky in given directions.

        Parameters
        ----------
        direction
            (n, 3) unit vectors, world.

        Returns
        -------
        Array
            (n, 3) linear RGB.
        """

    def fog(self, direction: Array) -> Array:
        """Return the colour of fog in directions (n, 3), unit vectors: that of the horizon on the same side, (n, 3).

        The horizontal part of the direction stands for the horizon. It gets shorter the steeper one looks, so that the
        angle to the sun tends to a right angle, whatever the azimuth; a unit vector would show a star there, with all
        horizons in one point.
        """
        return self.radiance(direction * [1, 0, 1])


@dataclass(frozen=True, kw_only=True)
class Gradient(PaintedSky):
    """Model a sky of two colours, mixed by the square root of a direction's y.

    Attributes
    ----------
    zenith
        Linear RGB straight up.
    horizon
        Linear RGB at the horizon and below it.
    defines
        The defines of shaders/common/sky.glsl for this sky.
    """

    zenith: Triple
    horizon: Triple
    defines: tuple[str, ...] = ()

    def radiance(self, direction: Array) -> Array:
        """Do as `PaintedSky.radiance` says. Directions below the horizon have the colour of the horizon."""
        rise = np.sqrt(np.clip(direction[:, 1:2], 0, 1))
        return np.asarray(np.array(self.horizon) * (1 - rise) + np.array(self.zenith) * rise)

    def uniforms(self) -> dict[str, Any]:
        """Return the uniforms of shaders/common/sky.glsl by name, for programs compiled with `defines`."""
        return {"zenith": self.zenith, "horizon": self.horizon}


@dataclass(frozen=True, kw_only=True)
class Daylight(PaintedSky):
    """Model a clear to hazy sky about the sun.

    Attributes
    ----------
    perez
        Five coefficients A to E of Perez' function (Perez et al. 1993), each for luminance Y and chromaticity x and y.
    at_zenith
        Y, x and y of the sky at the zenith, each divided by Perez' function at the zenith.
    sun
        Unit vector to the sun, world, not below the horizon.
    defines
        The defines of shaders/common/sky.glsl for this sky.
    """

    perez: tuple[Triple, ...]
    at_zenith: Triple
    sun: Triple
    defines: tuple[str, ...] = ("PREETHAM",)

    def radiance(self, direction: Array) -> Array:
        """Do as `PaintedSky.radiance` says (Preetham et al.). Below the horizon the colour is that of the horizon."""
        up, cosine = np.maximum(direction[:, 1], 1e-3), np.clip(direction @ np.array(self.sun), -1, 1)
        luminance, x, y = (np.array(self.at_zenith) * _perez(np.array(self.perez), up, cosine)).T
        xyz = (luminance / y)[:, None] * np.column_stack([x, y, 1 - x - y])
        return np.asarray(np.maximum(xyz @ RGB_FROM_XYZ.T, 0))

    def uniforms(self) -> dict[str, Any]:
        """Return the uniforms of shaders/common/sky.glsl by name, for programs compiled with `defines`."""
        return {"perez": list(self.perez), "at_zenith": self.at_zenith, "sky_sun": self.sun}


Sky = Gradient | Daylight | ImageSky
ReadImage = Callable[[Path], SkyImage]


def no_images(path: Path) -> SkyImage:
    """Refuse to read the picture of a sky, in programs that draw none. Raises InputError."""
    raise InputError(f"{path}: a picture as the sky is not supported here")


def _perez(coefficients: Array, up: Array, cosine: Array) -> Array:
    """Evaluate Perez' function, the relative brightness of the sky by direction (Perez et al. 1993).

    Parameters
    ----------
    coefficients
        (5, 3) A to E, of Y, x and y.
    up
        (n,) cosine of the angle between direction and zenith, above 0.
    cosine
        (n,) cosine of the angle between direction and sun.

    Returns
    -------
    Array
        (n, 3) for Y, x and y, up to a factor.
    """
    a, b, c, d, e = coefficients
    up, cosine = up[:, None], cosine[:, None]
    return np.asarray((1 + a * np.exp(b / up)) * (1 + c * np.exp(d * np.arccos(cosine)) + e * cosine**2))


def direction_to_sun(environment: "Environment") -> Array:
    """Return the unit vector (3,), world, that points to the sun of `environment`."""
    to_sun = -np.asarray(environment.sun.direction, float)
    return np.asarray(to_sun / np.linalg.norm(to_sun))


def environment_sky(environment: "Environment", read: ReadImage = no_images) -> Sky:
    """Return the sky that is seen behind everything.

    Parameters
    ----------
    environment
        What surrounds the objects; without a sky, its plain background is used.
    read
        Returns the picture of a sky in a file.

    Returns
    -------
    Sky
        The sky, in linear RGB.
    """
    sky = environment.sky
    if sky is None:
        background = _triple(linear_colour(environment.background))
        return Gradient(zenith=background, horizon=background)
    if sky.model == "gradient":
        return Gradient(zenith=_triple(linear_colour(sky.zenith)), horizon=_triple(linear_colour(sky.horizon)))
    if sky.model == "image" and sky.image is not None:
        return ImageSky(image=read(sky.image), turn=float(np.radians(sky.turn)), intensity=sky.intensity)
    return daylight(direction_to_sun(environment), sky.turbidity, environment.sun.intensity)


def daylight(to_sun: Array, turbidity: float, intensity: float) -> Daylight:
    """Return the daylight sky about a sun (Preetham et al., appendix A.2).

    Parameters
    ----------
    to_sun
        (3,) unit vector to the sun, world. For a sun below the horizon the sky keeps the colours of sunset and darkens.
    turbidity
        Haze: 2 is very clear air, 10 very hazy.
    intensity
        Brightness of a white surface that faces the sun above the air.

    Returns
    -------
    Daylight
        The sky.
    """
    level = np.array([to_sun[0], max(to_sun[1], 0.0), to_sun[2]])
    level = level / np.linalg.norm(level) if level.any() else np.array([1.0, 0, 0])
    angle = float(np.arccos(level[1]))  # of the sun from the zenith
    perez = _PEREZ @ [turbidity, 1]
    chi = (4 / 9 - turbidity / 120) * (np.pi - 2 * angle)
    luminance = (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192  # kcd/m²
    colour = [turbidity**2, turbidity, 1] @ _ZENITH @ [angle**3, angle**2, angle, 1]
    zenith = np.array([luminance / _WHITE * intensity * _twilight(to_sun), *colour])
    over = zenith / _perez(perez, np.ones(1), level[1:2])[0]
    return Daylight(perez=tuple(map(_triple, perez)), at_zenith=_triple(over), sun=_triple(level))


def sunlight(environment: "Environment") -> Array:
    """Return the light of the sun, as the colour of a white surface that faces it.

    In a daylight sky the air absorbs some of the light, by molecules and by haze (Preetham et al., appendix A.1,
    without ozone, gases and water vapour), so that a low sun is red.

    Parameters
    ----------
    environment
        What surrounds the objects, with sun and sky.

    Returns
    -------
    Array
        (3,) linear RGB.
    """
    sun = linear_colour(environment.sun.colour) * environment.sun.intensity
    if environment.sky is None or environment.sky.model != "preetham":
        return sun
    to_sun = direction_to_sun(environment)
    angle = float(np.degrees(np.arccos(max(to_sun[1], 0.0))))
    mass = 1 / (max(to_sun[1], 0.0) + 0.15 * (93.885 - angle) ** -1.253)
    haze = 0.04608 * environment.sky.turbidity - 0.04586
    lost = 0.008735 * _WAVELENGTHS**-4.08 + haze * _WAVELENGTHS**-1.3
    return np.asarray(sun * np.exp(-lost * mass) * _twilight(to_sun))


def _twilight(to_sun: Array) -> float:
    """Return the part of the light that remains when the sun is below the horizon, by a rule of thumb."""
    return float(10 ** (min(np.arcsin(np.clip(to_sun[1], -1, 1)), 0.0) / _TWILIGHT))


def _triple(values: Array) -> Triple:
    """Return three numbers (3,) as a tuple, which can be hashed and set as a uniform."""
    x, y, z = np.asarray(values, float).tolist()
    return x, y, z
