"""Look up a picture that is the sky, as the twin of `sky_at` for SKY_IMAGE in shaders/common/sky.glsl."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.lighting.image_sky import ImageSky, bilinear, places_in
from depthwalk.render.view.view import View
from depthwalk.types import Array


def sky_radiance(sky: ImageSky, direction: Array, level: Array) -> Array:
    """Return the light of a picture in given directions, trilinearly filtered.

    Parameters
    ----------
    sky
        The sky.
    direction
        (n, 3) unit vectors, world.
    level
        (n,) mip levels, see `pixel_level`; those below 0 count as 0.

    Returns
    -------
    Array
        (n, 3) linear RGB.
    """
    return sky.intensity * trilinear(sky.image.levels, direction, sky.turn, level)


def trilinear(levels: Sequence[NDArray[np.float16]], direction: Array, turn: float, level: Array) -> Array:
    """Look up an equirectangular picture in given directions, trilinearly filtered.

    Parameters
    ----------
    levels
        (H, W, 3) each, the picture and its mip-maps.
    direction
        (n, 3) unit vectors, world.
    turn
        The picture's turn about +Y, counter-clockwise seen from above, radians.
    level
        (n,) mip levels; those below 0 count as 0.

    Returns
    -------
    Array
        (n, 3) linear RGB.
    """
    finest = np.clip(level, 0, len(levels) - 1)
    below = np.minimum(np.floor(finest).astype(int), len(levels) - 2)
    radiance = np.zeros((len(direction), 3))
    for number in np.unique(below):
        rows = below == number
        part = (finest[rows] - number)[:, None]
        near, far = (bilinear(levels[number + n], *places_in(direction[rows], turn)) for n in (0, 1))
        radiance[rows] = near * (1 - part) + far * part
    return radiance


def pixel_level(sky: ImageSky, view: View, ray: Array) -> Array:
    """Return the mip levels whose texels are as large as the pixels of a view.

    Parameters
    ----------
    sky
        The sky.
    view
        The view.
    ray
        (n, 3) vectors to the pixels, one metre deep along the view axis, world.

    Returns
    -------
    Array
        (n,) levels, below 0 where texels are larger. At the angle a from the axis, pixels are cos^1.5 a times as large
        as in the middle: the root of their solid angles.
    """
    pixel = 1 / view.focal_pixels / np.linalg.norm(ray, axis=1) ** 1.5
    return np.asarray(np.log2(pixel * len(sky.image.levels[0]) / np.pi))
