"""Compute how fog, whose density decreases with height, dims light; this is the twin of shaders/fog/fog.glsl.

Light is lost along a ray by the Beer–Lambert law: the transmittance is exp(−∫ density ds). The density is constant up
to a height and decreases exponentially above it, for which the integral has a closed form (Wenzel 2006, "Real-Time
Atmospheric Effects in Games", volumetric fog with exponential height falloff).

All functions take the same three parameters of the fog: `density`, the part of the light lost per metre up to the
height; `height`, metres above the origin of the world; `falloff`, the metres over which the density falls to 1/e above
that height.
"""

import numpy as np

from depthwalk.render.lighting.sky import Sky
from depthwalk.types import Array


def fog_density(y: Array, density: float, height: float, falloff: float) -> Array:
    """Return the part of the light that fog absorbs per metre at given heights.

    Parameters
    ----------
    y
        Heights, metres, world, any shape.
    density
        Part of the light lost per metre where the fog is densest, 1/m.
    height
        Height up to which the density is constant, metres, world.
    falloff
        Metres above `height` over which the density falls to 1/e.

    Returns
    -------
    Array
        Part of the light lost per metre, of the shape of `y`, 1/m.
    """
    return np.asarray(density * np.exp(np.minimum(height - y, 0) / falloff))


def fog_through(viewer_y: float, way: Array, density: float, height: float, falloff: float) -> Array:
    """Return the transmittance between the viewer and points: the part of the light that comes through the fog.

    The mean density along the way is the integral of the density over height, divided by the way's rise. If the way is
    horizontal, it is the density at its middle.

    Parameters
    ----------
    viewer_y
        Height of the viewer, metres, world.
    way
        (n, 3) vectors from the viewer to the points, metres, world.
    density, height, falloff
        The fog, see `fog_density`: 1/m, metres, metres.

    Returns
    -------
    Array
        (n,) transmittance, 0 to 1.
    """

    def integral_up_to(y: Array) -> Array:
        return np.where(y < height, y - height, falloff * -np.expm1(np.minimum(height - y, 0) / falloff))

    start, rise = np.array(viewer_y), way[:, 1]
    is_level = np.abs(rise) < 1e-6 * falloff
    mean = (integral_up_to(start + rise) - integral_up_to(start)) / np.where(is_level, 1, rise)
    mean = np.where(is_level, fog_density(start + rise / 2, 1, height, falloff), mean)
    return np.asarray(np.exp(-density * mean * np.linalg.norm(way, axis=1)))


def fog_before_sky(viewer_y: float, rise: Array, density: float, height: float, falloff: float) -> Array:
    """Return the transmittance between the viewer and the sky: `fog_through` for rays without end.

    Parameters
    ----------
    viewer_y
        Height of the viewer, metres, world.
    rise
        (n,) y components of the rays' unit vectors, world.
    density, height, falloff
        The fog, see `fog_density`: 1/m, metres, metres.

    Returns
    -------
    Array
        (n,) transmittance, 0 to 1; 0 for rays that do not rise, since the fog along them never ends.
    """
    left = falloff * np.exp(min(height - viewer_y, 0) / falloff) + max(height - viewer_y, 0)
    return np.where(rise > 0, np.exp(-density * left / np.maximum(rise, 1e-6)), 0.0)


def fog_colour(sky: Sky, direction: Array) -> Array:
    """Return the colour of fog that has no colour set: that of the sky at the horizon, on the same side.

    Parameters
    ----------
    sky
        The sky.
    direction
        (n, 3) unit vectors from the viewer, world.

    Returns
    -------
    Array
        (n, 3) linear RGB.
    """
    return sky.fog(direction)
