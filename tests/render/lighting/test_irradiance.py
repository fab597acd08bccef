"""Light from everywhere, where it can be computed by hand."""

import numpy as np
import pytest

from depthwalk.colour import linear_from_srgb
from depthwalk.render.lighting.harmonics import polynomials
from depthwalk.render.lighting.irradiance import (
    GROUND,
    POLYNOMIALS,
    UPRIGHT_POLYNOMIALS,
    irradiance,
    lighting,
    skylight,
    sphere_directions,
)
from depthwalk.render.lighting.sky import Gradient
from depthwalk.scene.environment import Environment
from depthwalk.types import Array

RNG = np.random.default_rng(2)


def normals(count: int = 50) -> Array:
    found = RNG.normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def test_directions_share_the_sphere() -> None:
    direction, weight = sphere_directions()
    assert weight * len(direction) == pytest.approx(4 * np.pi)
    assert np.linalg.norm(direction, axis=1) == pytest.approx(np.ones(len(direction)))
    assert direction.mean(0) == pytest.approx(np.zeros(3), abs=1e-12)
    assert direction.T @ direction / len(direction) == pytest.approx(np.eye(3) / 3, abs=1e-3)


def test_polynomials_are_orthogonal() -> None:
    direction, weight = sphere_directions()
    basis = polynomials(direction)
    products = weight * basis.T @ basis
    assert basis.shape[1] == POLYNOMIALS
    assert products - np.diag(np.diag(products)) == pytest.approx(np.zeros((9, 9)), abs=0.01)


def test_an_even_sky_lights_all_surfaces_alike() -> None:
    direction, _ = sphere_directions()
    light = irradiance(np.tile([0.2, 0.4, 0.6], (len(direction), 1)))
    assert polynomials(normals()) @ light == pytest.approx(np.tile([0.2, 0.4, 0.6], (50, 1)), abs=1e-3)


def test_light_from_one_side_is_lamberts_law_up_to_the_second_order() -> None:
    """A far lamp of solid angle w: exact is max(cos, 0) · w / π; the second order is off by 1/16 of its peak or so."""
    direction, weight = sphere_directions()
    lamp = np.argmin(np.linalg.norm(direction - np.array([0.6, 0.8, 0.0]), axis=1))
    radiance = np.zeros((len(direction), 3))
    radiance[lamp] = np.pi / weight
    cosine = normals(400)
    found = (polynomials(cosine) @ irradiance(radiance))[:, 0]
    expected = np.maximum(cosine @ direction[lamp], 0)
    assert np.abs(found - expected).max() < 0.1
    assert (polynomials(direction[lamp][None]) @ irradiance(radiance))[0, 0] == pytest.approx(
        1 / 4 + 2 / 4 + 5 / 16, abs=0.01
    )


def test_ground_sends_back_a_fifth_of_what_falls_on_it() -> None:
    sky = Gradient(zenith=(1.0, 1.0, 1.0), horizon=(1.0, 1.0, 1.0))
    down = np.array([[0.0, -1, 0]])
    dark, sunny = (polynomials(down) @ skylight(sky, (sun,) * 3)[0] for sun in (0.0, 2.0))
    assert sunny - dark == pytest.approx(np.full((1, 3), 2 * GROUND), abs=0.05)
    up = polynomials(-down) @ skylight(sky, (0.0, 0.0, 0.0))[0]
    assert up == pytest.approx(np.ones((1, 3)), abs=0.1)


def test_constant_ambient_light_is_half_from_below_and_needs_few_polynomials() -> None:
    light = lighting(Environment.model_validate({"ambient": {"colour": (1, 1, 1), "intensity": 0.4}}))
    expected = float(linear_from_srgb([1.0])[0]) * 0.4
    shown = polynomials(np.array([[0.0, 1, 0], [1, 0, 0], [0, -1, 0]])) @ light.ambient
    assert shown[:, 0] == pytest.approx(np.array([1, 0.75, 0.5]) * expected)
    assert light.defines == ("UPRIGHT",) and len(light.uniforms()["ambient"]) == UPRIGHT_POLYNOMIALS


def test_ambient_light_falls_by_its_contrast_away_from_its_direction() -> None:
    ambient = {"colour": (1, 1, 1), "intensity": 0.4, "direction": (-3, 0, 4), "contrast": 0.9}
    light = lighting(Environment.model_validate({"ambient": ambient}))
    facing = np.array([0.6, 0, -0.8])
    shown = polynomials(np.array([facing, [0, 1, 0], [0.8, 0, 0.6], -facing])) @ light.ambient
    assert shown == pytest.approx(0.4 * np.array([[1], [0.55], [0.55], [0.1]]) * np.ones(3))
    assert light.defines == ()


def test_a_sky_about_the_sun_needs_all_polynomials() -> None:
    light = lighting(
        Environment.model_validate({"sky": {"model": "preetham", "light": True}, "sun": {"direction": (-1, -0.3, 0)}})
    )
    assert light.defines == () and len(light.uniforms()["ambient"]) == POLYNOMIALS
    east, west = polynomials(np.array([[1.0, 0, 0], [-1, 0, 0]])) @ light.ambient
    assert (east > west).all()
