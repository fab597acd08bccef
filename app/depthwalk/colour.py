"""Convert colours by the sRGB transfer function (IEC 61966-2-1): sRGB in files and on screens, linear in between."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Weights of linear red, green and blue in the luminance (Rec. 709); shaders take them from here."""


def linear_from_srgb(encoded: ArrayLike) -> NDArray[np.float32]:
    """Return the linear values (…) float32 in [0, 1] of the sRGB values `encoded` (…) in [0, 1]."""
    c = np.asarray(encoded, np.float32)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4).astype(np.float32)


@lru_cache(maxsize=256)
def linear_colour(encoded: tuple[float, float, float]) -> NDArray[np.float32]:
    """Return the same as `linear_from_srgb` for a colour of the settings, (3,), computed once; it is read-only."""
    linear = linear_from_srgb(encoded)
    linear.setflags(write=False)
    return linear


def srgb_from_linear(linear: ArrayLike) -> NDArray[np.float32]:
    """Return the sRGB values (…) float32 in [0, 1] of the linear values `linear` (…), which are clipped to [0, 1]."""
    c = np.clip(np.asarray(linear, np.float32), 0, 1)
    return np.where(c <= 0.0031308, c * 12.92, 1.055 * c ** (1 / 2.4) - 0.055).astype(np.float32)


_LINEAR_OF_BYTE = linear_from_srgb(np.arange(256) / 255)


def linear_from_srgb8(encoded: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the linear values (…) float32 in [0, 1] of the 8-bit sRGB values `encoded` (…)."""
    return _LINEAR_OF_BYTE[encoded]


def srgb8_from_linear(linear: ArrayLike) -> NDArray[np.uint8]:
    """Return the 8-bit sRGB values (…) uint8 of the linear values `linear` (…), which are clipped to [0, 1]."""
    return np.round(srgb_from_linear(linear) * 255).astype(np.uint8)
