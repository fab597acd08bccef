"""Tone curves at the points that define them."""

import numpy as np
import pytest

from depthwalk.colour import LUMINANCE
from depthwalk.reference.tone import TONES, aces, agx, reinhard


def test_reinhard_maps_luminance_l_to_l_over_one_plus_l() -> None:
    light = np.array([[0.2, 0.2, 0.2], [1.0, 1, 1], [9.0, 9, 9], [3.0, 0.1, 0.4]])
    luminance = light @ LUMINANCE
    assert reinhard(light) @ LUMINANCE == pytest.approx(luminance / (1 + luminance))
    assert reinhard(light)[3] / light[3] == pytest.approx([1 / (1 + luminance[3])] * 3)  # the hue stays


def test_aces_ends_a_little_above_white() -> None:
    assert aces(np.array([[0.0, 1.0, 1e6]])) == pytest.approx(np.array([[0, 2.54 / 3.16, 2.51 / 2.43]]), rel=1e-5)


def test_agx_shows_middle_grey_half_way_up_and_bright_colours_as_white() -> None:
    assert agx(np.full((1, 3), 0.18))[0] == pytest.approx([0.5**2.2] * 3, abs=0.01)
    dim, bright = agx(np.array([[0.2, 0.01, 0.01], [40.0, 2.0, 2.0]]))
    assert dim[1] / dim[0] < 0.2 < 0.5 < bright[1] / bright[0]


def test_none_changes_nothing() -> None:
    light = np.array([[0.0, 0.5, 7.0]])
    assert TONES["none"](light) is light
