"""Roughness and metalness as one number."""

import numpy as np
import pytest

from depthwalk.bake.reflection_code import reflection_codes, reflections_of_codes


def test_codes_tell_roughness_and_metalness() -> None:
    """In the eight bits that cooked files have: finer than the G-buffer's 50 steps."""
    roughness, metalness = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 1, 101), (0.0, 0.4, 0.5, 1.0)))
    codes = np.round(255 * reflection_codes(roughness, metalness)) / 255
    assert codes.min() >= 0 and codes.max() <= 1
    found, metal = reflections_of_codes(codes)
    assert np.abs(found - roughness).max() <= 0.5 / 49 / 2
    assert np.abs(metal - (metalness >= 0.5)).max() < 0.02


def test_what_lies_between_is_no_smoother_than_both() -> None:
    """On the way from any texel to any other."""
    rng = np.random.default_rng(5)
    ends = rng.uniform(size=(2, 500))
    codes = reflection_codes(ends, rng.integers(0, 2, ends.shape).astype(float))
    part = np.linspace(0, 1, 21)[:, None]
    between, metal = reflections_of_codes((1 - part) * codes[0] + part * codes[1])
    assert (between >= ends.min(0) - 1e-9).all()
    assert set(metal[between < 1 - 1e-9]) <= {0, 1}
    assert reflections_of_codes(np.array([0.5]))[1] == pytest.approx(0.5)
