"""Layers over each other, in cases that can be computed by hand."""

import numpy as np
import pytest

from depthwalk.colour import srgb_from_linear
from depthwalk.reference.light import Surfaces
from depthwalk.reference.translucency import in_fog, over, translucent_light
from depthwalk.types import Array

UP, DOWN = np.array([[0.0, 1.0, 0.0]]), np.array([[0.0, -1.0, 0.0]])


def pane(opacity: float, specular: float = 0.0, emission: float = 0.0) -> Array:
    """A level pane of colour .5, seen from above, in light from above alone."""
    one = np.ones(1)
    colour, light, dark = np.full((1, 3), 0.5), np.ones(3), np.zeros(3)
    surfaces = Surfaces(albedo=colour, specular=specular * one, normal=UP, shininess=8 * one)
    return translucent_light(surfaces, opacity * one, DOWN, UP[0], light, dark, np.full((1, 3), emission))


def test_diffuse_and_own_light_go_with_opacity_and_highlights_do_not() -> None:
    assert pane(0.5)[0].tolist() == [0.25, 0.25, 0.25, 0.5]
    assert pane(0.0, specular=0.3)[0] == pytest.approx([0.3, 0.3, 0.3, 0])
    assert pane(0.5, emission=2.0)[0] == pytest.approx([1.25, 1.25, 1.25, 0.5])


def test_layers_hide_what_is_behind_them_and_what_hides_nothing_is_added() -> None:
    white, grey = np.array([1.0, 1, 1, 1]), np.array([0.25, 0.25, 0.25, 0.5])
    assert over(grey, white).tolist() == [0.75, 0.75, 0.75, 1]
    assert over(grey, np.zeros(4)).tolist() == grey.tolist()
    assert over(np.array([2.0, 0, 0, 0]), white).tolist() == [3, 1, 1, 1]


def test_fog_before_layers_is_fog_before_the_whole_picture() -> None:
    """A pane in fog: in front of it part a comes through, behind it part b."""
    colour, a, b = np.array([0.3, 0.5, 0.7]), np.array([0.6]), np.array([0.8])
    glass, wall = pane(0.4), np.array([[0.9, 0.2, 0.1, 1.0]])
    step_by_step = in_fog(over(glass, in_fog(wall, b, colour)), a, colour)
    assert over(in_fog(glass, a, colour), in_fog(wall, a * b, colour)) == pytest.approx(step_by_step)


def test_weighted_blending_is_off_where_panes_hide_much() -> None:
    """Steps of 8 bits by which it differs from `over` (McGuire and Bavoil 2013, equation 7, 2 to 12 m away)."""
    for opacity, least, most in ((0.1, 3.0, 5.0), (0.5, 8.0, 10.0), (0.8, 13.0, 17.0)):
        random = np.random.default_rng(0)
        distance = -np.sort(-random.uniform(2, 12, (4000, 2)))
        colour, behind = random.uniform(0, 1, (4000, 2, 3)), random.uniform(0, 1, (4000, 3))
        exact = np.concatenate([behind, np.ones((4000, 1))], 1)
        for layer in range(2):
            exact = over(np.column_stack([opacity * colour[:, layer], np.full(4000, opacity)]), exact)
        weight = np.clip(10 / (1e-5 + (distance / 5) ** 2 + (distance / 200) ** 6), 1e-2, 3e3)[..., None]
        mean, passed = (weight * colour).sum(1) / weight.sum(1), (1 - opacity) ** 2
        weighted = (1 - passed) * mean + passed * behind
        off = 255 * np.abs(srgb_from_linear(weighted) - srgb_from_linear(exact[:, :3])).max(1)
        assert least < off.mean() < most
