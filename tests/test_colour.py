"""The sRGB transfer function at its known points."""

import numpy as np
import pytest

from depthwalk.colour import (
    LUMINANCE,
    linear_colour,
    linear_from_srgb,
    linear_from_srgb8,
    srgb8_from_linear,
    srgb_from_linear,
)


def test_known_values_of_the_standard() -> None:
    """Both ends, the join of line and power, and middle grey."""
    assert linear_from_srgb([0, 0.04045, 0.5, 1]) == pytest.approx([0, 0.0031308, 0.2140411, 1], abs=1e-6)


def test_encoding_undoes_decoding() -> None:
    values = np.linspace(0, 1, 1001)
    assert srgb_from_linear(linear_from_srgb(values)) == pytest.approx(values, abs=1e-6)
    every = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(srgb8_from_linear(linear_from_srgb8(every)), every)


def test_what_no_screen_shows_is_clipped() -> None:
    np.testing.assert_array_equal(srgb8_from_linear([[-1.0, 0.0], [1.0, 40.0]]), [[0, 0], [255, 255]])


def test_luminance_of_white_is_one() -> None:
    assert LUMINANCE.sum() == pytest.approx(1)


def test_colours_of_settings_are_computed_once_and_cannot_be_changed() -> None:
    colour = linear_colour((0.2, 0.5, 1.0))
    np.testing.assert_array_equal(colour, linear_from_srgb([0.2, 0.5, 1.0]))
    assert linear_colour((0.2, 0.5, 1.0)) is colour
    with pytest.raises(ValueError, match="read-only"):
        colour *= 2
