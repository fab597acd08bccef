"""Colours in few bytes against the colours."""

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.cook import colour_pca
from depthwalk.cook.colour_pca import few_components
from depthwalk.types import Array

USED = np.arange(64) < 60 + np.zeros((64, 1))


@pytest.fixture(autouse=True)
def none_is_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(colour_pca, "_SMALL", 0)


def texels(colour: Array) -> NDArray[np.uint16]:
    """Colours (64, 64, 4), of 65535, of those in 0 … 1."""
    return np.where(USED[..., None], np.round(np.asarray(colour) * 65535), 0).astype(np.uint16)


def light_and_dark() -> Array:
    """One colour, brighter and darker from texel to texel, whose hue and specular strength change slowly."""
    rng = np.random.default_rng(1)
    slow = np.linspace(0, 1, 64)[:, None, None] * np.array([0.03, -0.03, 0.0, 0.01])
    return rng.uniform(0.3, 0.9, (64, 64, 1)) * np.array([1, 0.8, 0.6, 0]) + slow + np.array([0, 0.03, 0, 0.1])


def test_what_is_of_one_colour_needs_no_texels() -> None:
    few = few_components(texels(np.full((64, 64, 4), 0.4)), USED)
    assert few.components.shape == (64, 64, 0) and not few.tints.size
    assert np.abs(few.palette[0] - 0.4).max() < 1 / 255


def test_light_and_dark_is_one_component_with_tints() -> None:
    colours = texels(light_and_dark())
    few = few_components(colours, USED)
    assert few.components.shape == (64, 64, 1) and few.tints.shape == (32, 32, 2)
    c = np.concatenate([few.components / 127, (few.tints / 255).repeat(2, 0).repeat(2, 1)], -1)
    off = (few.palette[0] + c @ few.palette[1:]) * 255 - colours / 257
    assert np.abs(off[USED]).max() < 1


def test_two_colours_that_mix_are_two_components_with_a_tint() -> None:
    """Hue changes from texel to texel as well as brightness, but not on its own axis of each."""
    colours = light_and_dark()
    colours += np.random.default_rng(3).uniform(0, 0.05, (64, 64, 1)) * np.array([1, -1, 0, 0])
    few = few_components(texels(colours), USED)
    assert few.components.shape == (64, 64, 2) and few.tints.shape == (32, 32, 1)
    c = np.concatenate([few.components / 127, (few.tints / 255).repeat(2, 0).repeat(2, 1)], -1)
    off = (few.palette[0] + c @ few.palette[1:]) * 255 - texels(colours) / 257
    assert np.abs(off[USED]).max() < 1.5


@pytest.mark.parametrize("spots", [0.5, 0.001])
def test_other_colours_beside_each_other_stay_as_they_are(spots: float) -> None:
    """Were it a spot or two."""
    colour = light_and_dark()
    colour[np.random.default_rng(2).random((64, 64)) < spots] = (0.1, 0.2, 0.9, 0.1)
    few = few_components(texels(colour), USED)
    assert (few.components == np.round(texels(colour) / 257)).all() and not few.tints.size


def test_little_is_stored_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(colour_pca, "_SMALL", 64 * 64 + 1)
    assert few_components(texels(light_and_dark()), USED).components.shape[2] == 4
