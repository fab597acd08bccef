"""Reflection and lamps in cases that can be computed by hand."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import pytest

from depthwalk.reference.light import Surfaces, lamp_light, phong, reflected
from depthwalk.types import Array

UP = np.array([0.0, 1.0, 0.0])


def surface(
    view: Sequence[float],
    to_light: Array,
    albedo: tuple[float, float, float] = (0.5, 0.25, 1.0),
    specular: float = 0.0,
    shininess: float = 8.0,
) -> Array:
    """What a level surface reflects of one light."""
    one = np.ones(1)
    level = Surfaces(albedo=np.array([albedo]), specular=specular * one, normal=UP[None], shininess=shininess * one)
    return reflected(level, np.array([view]), to_light)[0]


@pytest.mark.parametrize("degrees", [0, 30, 60, 90, 120])
def test_diffuse_light_goes_with_the_cosine(degrees: int) -> None:
    angle = np.radians(degrees)
    to_light = np.array([np.sin(angle), np.cos(angle), 0])
    expected = np.array([0.5, 0.25, 1.0]) * max(np.cos(angle), 0)
    assert surface([0.0, -1, 0], to_light) == pytest.approx(expected, abs=1e-12)


def test_the_highlight_is_where_the_mirror_image_is() -> None:
    to_light = np.array([0.6, 0.8, 0.0])
    glossy = partial(surface, albedo=(0.0, 0.0, 0.0), specular=0.3)
    assert glossy([0.6, -0.8, 0.0], to_light) == pytest.approx([0.3] * 3)  # seen in the mirror's direction
    beside = glossy([0.0, -1.0, 0.0], to_light)  # the mirrored view is straight up
    assert beside == pytest.approx([0.3 * 0.8**8] * 3)
    assert glossy([0.6, -0.8, 0.0], -to_light) == pytest.approx([0.0] * 3)  # from below


def test_ambient_light_is_half_as_strong_from_below() -> None:
    normals = np.array([UP, [1.0, 0, 0], -UP])
    one, view = np.ones(3), np.tile([0.0, 0, -1], (3, 1))
    white = Surfaces(albedo=np.ones((3, 3)), specular=0 * one, normal=normals, shininess=one)
    lit = phong(white, view, UP, np.zeros(3), np.array([0.4, 0.8, 1.2]))
    assert lit == pytest.approx(np.outer([1.0, 0.75, 0.5], [0.4, 0.8, 1.2]))


def test_phong_adds_the_sun_by_its_colour() -> None:
    one, view = np.ones(1), np.array([[0.0, -1, 0]])
    grey = Surfaces(albedo=np.full((1, 3), 0.5), specular=0 * one, normal=UP[None], shininess=one)
    lit = phong(grey, view, UP, np.array([1.0, 0.5, 0]), np.zeros(3))
    assert lit == pytest.approx(np.array([[0.5, 0.25, 0.0]]))


def test_lamps_lose_strength_with_the_square_of_the_distance_and_end_at_their_range() -> None:
    point = np.array([[1.0, 0, 0], [0, 2.0, 0], [0, 0, 10.0], [0, 0, 11.0]])
    strength, to_lamp = lamp_light(point, np.zeros(3), 10.0)
    assert strength == pytest.approx([(1 - 1e-4) ** 2, (1 - 16e-4) ** 2 / 4, 0, 0])
    assert to_lamp == pytest.approx(-point / np.linalg.norm(point, axis=1, keepdims=True))


def test_a_cone_is_whole_within_four_fifths_of_its_angle() -> None:
    degrees = np.array([0.0, 23.9, 27.0, 30.0, 45.0])
    angle = np.radians(degrees)
    point = np.stack([np.sin(angle), -np.cos(angle), 0 * angle], -1)
    strength = lamp_light(point, np.zeros(3), 1e3, -UP, np.radians(60))[0]
    edge, full = np.cos(np.radians([30, 24]))
    part = (np.cos(angle[2]) - edge) / (full - edge)
    assert strength == pytest.approx([1, 1, part**2, 0, 0], abs=1e-9)
