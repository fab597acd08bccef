"""Dither a picture before it is rounded to 8 bits, as the twin of shaders/common/dither.glsl.

Rounding turns a smooth gradient into bands, whose borders the eye finds even where neighbours differ by one step.
Noise of one step's width, added before, hides the borders: the mean over a few pixels is then the exact value (Roberts
1962, "Picture coding using pseudo-random noise"). The noise is interleaved gradient noise (Jimenez 2014, "Next
Generation Post Processing in Call of Duty: Advanced Warfare"), which depends on nothing but the place of the pixel, so
that a picture is the same each time, and whose values in any 3 × 3 pixels are spread evenly.
"""

import numpy as np

from depthwalk.render.passes.output import DITHER_AMPLITUDE, NOISE_ACROSS, NOISE_FACTOR, NOISE_UP
from depthwalk.types import Array


def dither_noise(size: tuple[int, int]) -> Array:
    """Return what is added to each pixel of a picture, in steps of 8 bits.

    Parameters
    ----------
    size
        Width and height of the picture, pixels.

    Returns
    -------
    Array
        (H, W), from −`DITHER_AMPLITUDE` to `DITHER_AMPLITUDE`, row 0 at the bottom.
    """
    x, y = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    inner = NOISE_ACROSS * x + NOISE_UP * y
    noise = np.modf(NOISE_FACTOR * np.modf(inner)[0])[0]
    return np.asarray(2 * DITHER_AMPLITUDE * (noise - 0.5))


def dithered(screen: Array) -> Array:
    """Return `screen` (H, W, 3), sRGB from 0 to 1, row 0 at the bottom, with noise, the same in a pixel's channels.

    Colours that 8 bits hold exactly are rounded to themselves afterwards, as the noise is less than half a step.
    """
    height, width = screen.shape[:2]
    return np.asarray(screen + dither_noise((width, height))[..., None] / 255)
