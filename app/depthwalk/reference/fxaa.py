"""Blur a picture along its edges by FXAA, as the twin of shaders/fxaa/fxaa.frag.

Fast approximate anti-aliasing (Lottes 2009, "FXAA"), in the variant that looks at the brightness of a pixel and of the
four corners between it and its neighbours. The differences of the corners are the gradient; at right angles to it two,
and farther away two more colours are looked up between the pixels, and averaged.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from depthwalk.colour import LUMINANCE
from depthwalk.types import Array

SHORTEST, SHORTENED, LONGEST = 1 / 128, 1 / 8, 8.0
"""Least contrast of an edge; part of the brightness by which blurs are shortened; and longest blur, pixels."""


def brightness(colour: Array) -> NDArray[np.float64]:
    """Return the perceived brightness (…) of linear colours (…, 4): √luminance, 0 to 1, less what alpha lacks of 1."""
    return np.asarray(np.sqrt(np.clip(colour[..., :3], 0, 1) @ LUMINANCE) + colour[..., 3] - 1)


def fxaa(lit: Array, contrast: float) -> NDArray[np.float64]:
    """Return a picture blurred along its edges.

    Parameters
    ----------
    lit
        (H, W, 4) linear, premultiplied picture, row 0 at the bottom.
    contrast
        Least difference in brightness at an edge, as a part of the brightest of the five places.

    Returns
    -------
    numpy.ndarray
        (H, W, 4) the same, with blurred edges.
    """
    y, x = np.mgrid[: lit.shape[0], : lit.shape[1]].astype(float)

    def at(right: Array | float, up: Array | float) -> NDArray[np.float64]:
        """Return the colours (H, W, 4) so many pixels aside, between pixels interpolated linearly."""
        place = [y + up, x + right]
        return np.stack(
            [map_coordinates(channel, place, order=1, mode="nearest") for channel in np.moveaxis(lit, 2, 0)], -1
        )

    middle = brightness(lit)
    north_west, north_east = brightness(at(-0.5, 0.5)), brightness(at(0.5, 0.5))
    south_west, south_east = brightness(at(-0.5, -0.5)), brightness(at(0.5, -0.5))
    around = np.stack([north_west, north_east, south_west, south_east])
    darkest, brightest = np.minimum(middle, around.min(0)), np.maximum(middle, around.max(0))
    is_edge = brightest - darkest >= np.maximum(contrast * brightest, SHORTEST)
    along = np.stack(
        [south_west + south_east - north_west - north_east, north_east + south_east - north_west - south_west]
    )
    along /= np.abs(along).min(0) + np.maximum(around.mean(0) * SHORTENED, SHORTEST)
    right, up = np.clip(along, -LONGEST, LONGEST)
    narrow = (at(-right / 6, -up / 6) + at(right / 6, up / 6)) / 2
    wide = narrow / 2 + (at(-right / 2, -up / 2) + at(right / 2, up / 2)) / 4
    # What is brighter or darker than all around the pixel is beyond its edge.
    is_beyond = (brightness(wide) < darkest) | (brightness(wide) > brightest)
    return np.where(is_edge[..., None], np.where(is_beyond[..., None], narrow, wide), lit)
