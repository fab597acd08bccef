"""Prepare a picture of all directions as a sky: mip-maps for the background, irradiance, its sun and its horizon.

The picture is equirectangular: its columns are equal steps of azimuth, its rows equal steps of the angle from the
zenith. Unturned, its middle column is seen along −z and the columns to the right of it toward +x.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.colour import LUMINANCE
from depthwalk.render.lighting.harmonics import LAMBERT, polynomials
from depthwalk.types import Array, Ints

HORIZON_ORDER = 4  # of the series that gives fog its colour by azimuth; its kernel is 80° wide at half height
HORIZON_TERMS = 2 * HORIZON_ORDER + 1
_MOST_LIGHT = 65504.0  # that a half float holds
_LIGHT_WIDTH = 512  # texels, 0.7° each, across the picture from which light is summed
_HORIZON = np.radians(5)  # height of the band above the horizon that fog is coloured by
_SPOT, _RING = np.cos(np.radians([10, 15]))  # cosines of the angles within which a sun and its surroundings lie
_RING_SHARE = 0.9  # of the ring that must be darker than the spot: at the edge of a wide lamp only half of it is
_LEAST_SUN = 0.02  # part of the picture's light; a weaker spot is left where it is
# Integrals of the squares of `polynomials` over the sphere.
_NORM = 4 * np.pi * np.array([1, 1 / 3, 4 / 5, 1 / 3, 1 / 3, 4 / 15, *[1 / 15] * 3])


@dataclass(frozen=True, kw_only=True, eq=False)
class SkyImage:
    """Hold a picture of all directions, not turned and of intensity 1; all colours are linear RGB.

    Attributes
    ----------
    levels
        (H, W, 3) float16, and its mip-maps down to one row; row 0 at the zenith.
    ambient
        (9, 3) coefficients of the `polynomials` of a surface's normal: the light that it receives.
    ambient_without_sun
        The same without the light that `sun` adds.
    to_sun
        (3,) unit vector to the brightest spot; None where no spot is both small and bright.
    sun
        (3,) colour of a white surface that faces the spot, in its light.
    horizon
        (HORIZON_TERMS, 3) coefficients of 1, cos a, sin a, cos 2a, sin 2a, … of the azimuth a from −z toward +x.
    """

    levels: tuple[NDArray[np.float16], ...]
    ambient: Array
    ambient_without_sun: Array
    to_sun: Array | None
    sun: Array
    horizon: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class ImageSky:
    """Show a picture as the sky.

    Attributes
    ----------
    image
        The picture.
    turn
        Its turn about +Y, counter-clockwise seen from above, radians.
    intensity
        Multiplies its light.
    defines
        The defines of shaders/common/sky.glsl for this sky.
    """

    image: SkyImage
    turn: float
    intensity: float
    defines: tuple[str, ...] = ("SKY_IMAGE",)

    def uniforms(self) -> dict[str, Any]:
        """Return the uniforms of shaders/common/sky.glsl by name, for programs compiled with `defines`."""
        return {
            "sky_turn": self.turn,
            "sky_intensity": self.intensity,
            "horizon_terms": [tuple(term) for term in self.horizon.tolist()],
        }

    @property
    def horizon(self) -> Array:
        """Return the terms (HORIZON_TERMS, 3) of the horizon's colour, turned and of its intensity."""
        terms = self.image.horizon.copy()
        for k in range(1, HORIZON_ORDER + 1):
            cosine, sine = np.cos(k * self.turn), np.sin(k * self.turn)
            even, odd = self.image.horizon[2 * k - 1 : 2 * k + 1]
            terms[2 * k - 1 : 2 * k + 1] = cosine * even + sine * odd, cosine * odd - sine * even
        return terms * self.intensity

    def ambient(self, with_sun: bool) -> Array:
        """Return the light that surfaces receive, (9, 3) coefficients of `polynomials`, with or without its sun's."""
        image = self.image
        own = image.ambient if with_sun else image.ambient_without_sun
        return turned_light(own, self.turn) * self.intensity

    def sun(self) -> tuple[Array, Array] | None:
        """Return the unit vector to the picture's sun and the colour of its light, both (3,); None if it has none."""
        if self.image.to_sun is None:
            return None
        x, y, z = self.image.to_sun
        cosine, sine = np.cos(self.turn), np.sin(self.turn)
        to_sun = np.array([cosine * x + sine * z, y, cosine * z - sine * x])
        return to_sun, self.image.sun * self.intensity

    def radiance(self, direction: Array, level: int = 0) -> Array:
        """Return the light from given directions, filtered bilinearly.

        Parameters
        ----------
        direction
            (n, 3) unit vectors, world.
        level
            The mip level; 0 is the whole picture.

        Returns
        -------
        Array
            (n, 3) linear RGB.
        """
        return self.intensity * bilinear(self.image.levels[level], *places_in(direction, self.turn))

    def fog(self, direction: Array) -> Array:
        """Return the colour of fog in directions (n, 3), unit vectors: that of the horizon, smoothed, (n, 3).

        A power of (1 + cos a)/2 smooths it over the azimuth, so that no weight is negative. Steeper directions, whose
        horizontal part is shorter, see the mean of a wider part of the horizon (Poisson's kernel): straight up and
        down all azimuths meet.
        """
        around = -direction[:, 2] + 1j * direction[:, 0]
        powers = around[:, None] ** np.arange(1, HORIZON_ORDER + 1)
        basis = np.stack([powers.real, powers.imag], -1).reshape(len(direction), -1)
        terms = self.horizon
        return np.asarray(np.maximum(terms[0] + basis @ terms[1:], 0))


class SkyImages:
    """Keep the picture of a scene's sky prepared.

    Parameters
    ----------
    read
        Returns the texels of a file as `load_sky_image` does.
    """

    def __init__(self, read: Callable[[Path], NDArray[np.float32]]) -> None:
        self._read = read
        self._last: tuple[Path, SkyImage] | None = None

    def __call__(self, path: Path) -> SkyImage:
        """Return the picture in the file `path`, read when it is another one than last. Raises InputError."""
        if self._last is None or self._last[0] != path:
            self._last = path, prepare_sky_image(self._read(path))
        return self._last[1]


def prepare_sky_image(texels: NDArray[np.float32]) -> SkyImage:
    """Compute from a picture (H, W, 3), linear RGB with row 0 at the zenith, what a sky needs."""
    levels = [texels]
    while levels[-1].shape[0] > 1:
        levels.append(halved(levels[-1]))
    small = next(level for level in levels if level.shape[1] <= _LIGHT_WIDTH)
    direction, weight = texel_directions(*small.shape[:2])
    radiance = small.reshape(-1, 3).astype(float)
    to_sun, sun, rest = without_sun(radiance, direction, weight)
    return SkyImage(
        levels=tuple(np.minimum(level, _MOST_LIGHT).astype(np.float16) for level in levels),
        ambient=image_irradiance(radiance, direction, weight),
        ambient_without_sun=image_irradiance(rest, direction, weight),
        to_sun=to_sun,
        sun=sun,
        horizon=_horizon(radiance, direction, weight),
    )


def halved(level: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a picture (H, W, 3) of half the height and width, of which each texel is the mean of four."""
    from depthwalk.ingest.sky_image import shrunk  # here, since few scenes have a picture

    height, width = level.shape[:2]
    return shrunk(level, max(width // 2, 1), height // 2)


def texel_directions(height: int, width: int) -> tuple[Array, Array]:
    """Return the directions of an equirectangular picture's texels, row by row, and their solid angles.

    Returns
    -------
    tuple
        (height · width, 3) unit vectors, and (height · width,) steradians.
    """
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    down, around = np.pi * (np.arange(height) + 0.5) / height, 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    level = np.sin(down)[:, None]
    parts = np.broadcast_arrays(level * np.sin(around), np.cos(down)[:, None], -level * np.cos(around))
    weight = np.repeat((edges[:-1] - edges[1:]) * 2 * np.pi / width, width)
    return np.stack(parts, -1).reshape(-1, 3), weight


def image_irradiance(radiance: Array, direction: Array, weight: Array) -> Array:
    """Project light onto the `polynomials` of a surface's normal, as `irradiance` does (Ramamoorthi and Hanrahan 2001).

    Parameters
    ----------
    radiance
        (n, 3) linear RGB.
    direction
        (n, 3) unit vectors from which it comes.
    weight
        (n,) solid angles, steradians.

    Returns
    -------
    Array
        (9, 3) coefficients: `polynomials(normal) @ coefficients` is the colour of white surfaces.
    """
    return np.asarray((LAMBERT / _NORM)[:, None] * (polynomials(direction).T @ (radiance * weight[:, None])))


def turned_light(coefficients: Array, turn: float) -> Array:
    """Turn light about +Y, counter-clockwise seen from above.

    Parameters
    ----------
    coefficients
        (9, 3) coefficients of `polynomials`.
    turn
        Radians.

    Returns
    -------
    Array
        (9, 3) coefficients of the turned light. The polynomials of order k in x and z turn by k times the angle.
    """
    one, y, upright, x, z, x2_z2, xy, yz, zx = coefficients
    c, s, c2, s2 = np.cos(turn), np.sin(turn), np.cos(2 * turn), np.sin(2 * turn)
    return np.stack(
        [
            one,
            y,
            upright,
            c * x + s * z,
            c * z - s * x,
            c2 * x2_z2 + s2 / 2 * zx,
            c * xy + s * yz,
            c * yz - s * xy,
            c2 * zx - 2 * s2 * x2_z2,
        ]
    )


def without_sun(radiance: Array, direction: Array, weight: Array) -> tuple[Array | None, Array, Array]:
    """Find the brightest spot: what is brighter than the ring around it.

    Returns
    -------
    The direction (3,) of the spot, or None where its light is negligible; the colour (3,) of a white surface that faces
    it; and the radiance (n, 3) without it. What the spot is given is taken from the rest, so that no light is lost.
    """
    brightness = radiance @ LUMINANCE
    cosine = direction @ direction[int(np.argmax(brightness))]
    spot, ring = cosine >= _SPOT, (cosine < _SPOT) & (cosine >= _RING)
    if ring.any():
        around = np.quantile(radiance[ring], _RING_SHARE, axis=0)
        excess = np.maximum(radiance[spot] - around, 0)
        light = weight[spot] @ excess
        if light @ LUMINANCE > _LEAST_SUN * (weight @ brightness):
            to_sun = (weight[spot] * (excess @ LUMINANCE)) @ direction[spot]
            rest = radiance.copy()
            rest[spot] -= excess
            return to_sun / np.linalg.norm(to_sun), light / np.pi, rest
    return None, np.zeros(3), radiance


def _horizon(radiance: Array, direction: Array, weight: Array) -> Array:
    """Return the terms of `SkyImage.horizon` of the band above the horizon: a Fourier series, smoothed.

    Its terms are multiplied by those of the series of ((1 + cos a)/2)^HORIZON_ORDER, which are binomial coefficients.
    """
    height = np.arcsin(np.clip(direction[:, 1], -1, 1))
    steps = np.abs(height - _HORIZON / 2)
    band = steps <= max(_HORIZON / 2, float(steps.min()) + 1e-9)  # at least one row
    azimuth = np.arctan2(direction[band, 0], -direction[band, 2])
    share = weight[band] / weight[band].sum()
    terms, damping = [share @ radiance[band]], 1.0
    for k in range(1, HORIZON_ORDER + 1):
        damping *= (HORIZON_ORDER - k + 1) / (HORIZON_ORDER + k)
        for wave in (np.cos(k * azimuth), np.sin(k * azimuth)):
            terms.append(2 * damping * (share * wave) @ radiance[band])
    return np.stack(terms)


def places_in(direction: Array, turn: float) -> tuple[Array, Array]:
    """Return where an equirectangular picture shows directions.

    Parameters
    ----------
    direction
        (n, 3) unit vectors, world.
    turn
        The picture's turn about +Y, counter-clockwise seen from above, radians.

    Returns
    -------
    tuple
        (n,) each: parts of the width from the left, of which whole numbers do not matter, and of the height from the
        top.
    """
    azimuth = np.arctan2(direction[:, 0], -direction[:, 2])
    down = np.arctan2(np.hypot(direction[:, 0], direction[:, 2]), direction[:, 1]) / np.pi
    return 0.5 + (azimuth + turn) / (2 * np.pi), down


def bilinear(texels: NDArray[np.float16], across: Array, down: Array) -> Array:
    """Filter texels (H, W, 3) at texture coordinates (n,); they repeat horizontally and end vertically."""
    height, width = texels.shape[:2]
    x, y = across * width - 0.5, np.clip(down * height - 0.5, 0, height - 1)
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    right_part, lower_part = (x - left)[:, None], (y - top)[:, None]

    def row(of: Ints) -> Array:
        near, far = (texels[of, column % width].astype(float) for column in (left, left + 1))
        return np.asarray(near * (1 - right_part) + far * right_part)

    return np.asarray(row(top) * (1 - lower_part) + row(np.minimum(top + 1, height - 1)) * lower_part)
