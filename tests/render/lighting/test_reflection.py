"""The sky as surfaces reflect it: blurred by GGX, against sums over all directions, and what a split sum leaves off."""

from typing import Any

import numpy as np
import pytest

from depthwalk.reference.reflection import (
    Microfacets,
    environment_brdf,
    lobe_direction,
    microfacet,
    mirrored,
    sky_reflection,
)
from depthwalk.render.lighting.harmonics import polynomials
from depthwalk.render.lighting.image_sky import ImageSky, image_irradiance, prepare_sky_image, texel_directions
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.lighting.reflection import LEAST_WIDTH, ROUGHEST_WIDTH, ReflectedSky, blurred
from depthwalk.render.lighting.sky import daylight
from depthwalk.scene.environment import Environment
from depthwalk.types import Array

WIDTH = 64


def studio(direction: Array) -> Array:
    """A dark room with a soft bright side, a small lamp and a floor, without any symmetry, (n, 3)."""
    x, y, z = direction.T
    lamp = direction @ np.array([0.48, 0.6, 0.64]) > np.cos(0.2)
    return np.stack([0.2 + np.maximum(x, 0), 0.3 + 0.3 * y * (y > 0), 0.1 + 0.4 * (z > 0.3)], -1) + 8.0 * lamp[:, None]


def picture(height: int) -> Array:
    direction, _ = texel_directions(height, 2 * height)
    return studio(direction).reshape(height, 2 * height, 3).astype(np.float32)


def ggx(direction: Array, normal: Array, alpha: float) -> Array:
    """Weights of light (n,) that a surface sends to a viewer straight above it."""
    cosine = direction @ normal
    return np.asarray(np.maximum(cosine, 0) / ((1 + cosine) / 2 * (alpha**2 - 1) + 1) ** 2)


@pytest.mark.parametrize("alpha", [0.125, 0.5, 1.0])
def test_each_texel_is_the_mean_of_a_lobe(alpha: float) -> None:
    """Near the poles, at the seam, and anywhere else."""
    radiance = picture(WIDTH // 2)
    direction, weight = texel_directions(*radiance.shape[:2])
    row_weight = np.repeat(np.sin(np.pi * (np.arange(WIDTH // 2) + 0.5) / (WIDTH // 2)), WIDTH)
    np.testing.assert_allclose(weight / weight.sum(), row_weight / row_weight.sum(), rtol=1e-3)
    found = blurred(radiance, alpha).reshape(-1, 3)
    for texel in (0, WIDTH - 1, len(found) - 1, *np.random.default_rng(3).integers(0, len(found), 5)):
        lobe = ggx(direction, direction[texel], alpha) * row_weight
        assert found[texel] == pytest.approx(lobe @ radiance.reshape(-1, 3) / lobe.sum(), rel=1e-4)


def test_an_even_sky_stays_even() -> None:
    for alpha in (0.06, 1.0):
        np.testing.assert_allclose(blurred(np.full((32, 64, 3), 0.7, np.float32), alpha), 0.7, rtol=1e-5)


def painted(**values: Any) -> ReflectedSky:
    environment = Environment.model_validate({"sky": {"light": True, **values}})
    reflected = lighting(environment).reflected
    assert reflected is not None
    return reflected


def test_levels_halve_down_to_one_row() -> None:
    levels = painted().levels()
    sizes = [level.shape for level in levels]
    assert sizes == [(LEAST_WIDTH >> k + 1, LEAST_WIDTH >> k, 3) for k in range(len(levels))] and sizes[-1][0] == 1
    assert levels[int(painted().uniforms(len(levels))["roughest"])].shape[1] == ROUGHEST_WIDTH


def test_the_ground_below_a_painted_sky_is_that_which_lights() -> None:
    reflected = painted(model="preetham")
    first = reflected.levels()[0].astype(float)
    half = len(first) // 2
    direction, _ = texel_directions(*first.shape[:2])
    np.testing.assert_allclose(first[half:], np.broadcast_to(reflected.ground, first[half:].shape), rtol=1e-3)
    seen = reflected.sky.radiance(direction[: half * LEAST_WIDTH])
    np.testing.assert_allclose(first[:half].reshape(-1, 3), seen, rtol=1e-3)


def test_small_pictures_are_as_blurred_as_large_ones() -> None:
    """They have no texels as small as the narrowest lobes: without more of them, rough surfaces would show edges."""
    small, part = picture(16), ((np.arange(16) + 0.5) / 16)[:, None, None]
    wrapped = np.concatenate([small[:, -1:], small, small[:, :1]], 1)
    padded = np.concatenate([wrapped[:1], wrapped, wrapped[-1:]])
    tall = (padded[:-1, None] * (1 - part) + padded[1:, None] * part).reshape(-1, 34, 3)
    wide = (tall[:, :-1, None] * (1 - part[:, 0]) + tall[:, 1:, None] * part[:, 0]).reshape(len(tall), -1, 3)
    large = wide[8:-8, 8:-8]
    assert large.shape == (LEAST_WIDTH // 2, LEAST_WIDTH, 3)
    found, wanted = (
        ReflectedSky(sky=ImageSky(image=prepare_sky_image(image.astype(np.float32)), turn=0.0, intensity=1.0)).levels()
        for image in (small, large)
    )
    assert len(found) == len(wanted)
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.01, atol=0.01)


def test_skies_that_give_no_light_are_not_reflected() -> None:
    for sky in (None, {"light": False}):
        assert lighting(Environment.model_validate({"sky": sky})).reflected is None


def test_a_picture_loses_the_sun_that_lights_by_itself_and_keys_ignore_its_turn() -> None:
    direction, _ = texel_directions(64, 128)
    radiance = studio(direction) + 500.0 * (direction @ np.array([[0.48], [-0.6], [0.64]]) > np.cos(0.06))
    image = prepare_sky_image(radiance.reshape(64, 128, 3).astype(np.float32))
    sky = [ImageSky(image=image, turn=turn, intensity=1 + turn) for turn in (0.0, 1.0)]
    with_sun, without = (ReflectedSky(sky=sky[0], with_sun=with_sun) for with_sun in (True, False))
    assert with_sun.levels()[0].max() > 499 > 10 > without.levels()[0].max()
    assert with_sun.key != without.key == ReflectedSky(sky=sky[1], with_sun=False).key
    one, other = (daylight(np.array([0.0, 1.0, 0.0]), turbidity, 1.0) for turbidity in (2.0, 4.0))
    assert ReflectedSky(sky=one).key != ReflectedSky(sky=other).key != ReflectedSky(sky=other, ground=(1, 1, 1)).key


def surfaces(count: int, metalness: float, base: float = 1.0) -> tuple[Microfacets, Array]:
    """Surfaces of all roughnesses, from mirrors to chalk, seen at angles up to 84°, and view vectors, (n, 3)."""
    rng = np.random.default_rng(7)
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    aside = np.cross(normal, rng.normal(size=(count, 3)))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    facing = rng.uniform(0.1, 1, count)[:, None]
    made = Microfacets(
        base=np.full((count, 3), base),
        metalness=np.full(count, metalness),
        roughness=np.linspace(0, 1, count),
        normal=normal,
    )
    return made, -(facing * normal + np.sqrt(1 - facing**2) * aside)


@pytest.mark.parametrize("metalness", [0.0, 0.5, 1.0])
def test_in_a_furnace_white_surfaces_show_what_is_all_around(metalness: float) -> None:
    """Mirrors and chalk, of metal and of anything else: no light is lost or made."""
    made, view = surfaces(100, metalness)
    ones = np.ones((100, 3))
    np.testing.assert_allclose(sky_reflection(made, view, ones, ones, np.ones(100)), ones, atol=1e-9)


def hemisphere(count: int) -> tuple[Array, Array]:
    """Directions (n, 3) about +z by the cosine between halfway vector and normal, and weights of these, for α = 1."""
    height = (np.arange(count) + 0.5) / count
    turn = 2 * np.pi * (np.arange(2 * count) + 0.5) / (2 * count)
    radius = np.sqrt(1 - height**2)[:, None]
    parts = np.broadcast_arrays(radius * np.cos(turn), radius * np.sin(turn), height[:, None])
    return np.stack(parts, -1).reshape(-1, 3), np.full(2 * count * count, np.pi / (count * count))


@pytest.mark.slow
def test_the_table_of_reflected_parts_holds_sums_over_all_directions() -> None:
    """Of a white metal and of a black dielectric; such sums need wide lobes."""
    to_light, weight = hemisphere(60)
    off = []
    for roughness in (0.4, 0.6, 0.8, 1.0):
        for facing in (0.15, 0.4, 0.7, 1.0):
            view = -np.array([np.sqrt(1 - facing**2), 0, facing])
            scale, bias = environment_brdf(np.array([facing]), np.array([roughness]))
            for base, metalness, normally in ((1.0, 1.0, 1.0), (0.0, 0.0, 0.04)):
                count = len(to_light)
                each = Microfacets(
                    base=np.full((count, 3), base),
                    metalness=np.full(count, metalness),
                    roughness=np.full(count, roughness),
                    normal=np.broadcast_to([0.0, 0.0, 1.0], (count, 3)),
                )
                reflected = microfacet(each, np.broadcast_to(view, (count, 3)), to_light)[:, 0] @ weight / np.pi
                off.append(normally * scale[0] + bias[0] - reflected)
    assert np.abs(off).max() < 0.015


@pytest.mark.slow
@pytest.mark.parametrize(("metalness", "base", "usual", "most"), [(1.0, 0.8, 0.05, 0.25), (0.0, 0.4, 0.05, 0.12)])
def test_surfaces_shine_as_the_sum_over_all_directions(
    metalness: float, base: float, usual: float, most: float
) -> None:
    """Errors as parts of the mean, below a lamp thirty times as bright: of half and of nine tenths of the surfaces.

    Of metal, what leaves it after one reflection, as `microfacet` counts.
    """
    radiance, count = picture(64), 100
    reflected = ReflectedSky(sky=ImageSky(image=prepare_sky_image(radiance), turn=0.0, intensity=1.0))
    levels = reflected.levels()
    made, view = surfaces(count, metalness, base)
    made = Microfacets(
        base=made.base, metalness=made.metalness, normal=made.normal, roughness=np.linspace(0.3, 1, count)
    )
    sky = mirrored(reflected, levels, lobe_direction(made, view), made.roughness)
    direction, weight = texel_directions(*radiance.shape[:2])
    light = radiance.reshape(-1, 3).astype(float)
    everywhere = polynomials(made.normal) @ image_irradiance(light, direction, weight)
    everywhere *= 1 - metalness
    found = sky_reflection(made, view, sky, everywhere, np.ones(count))
    expected = np.zeros_like(found)
    for k in range(count):
        lights = len(direction)
        each = Microfacets(
            base=np.broadcast_to(made.base[k], (lights, 3)),
            metalness=np.broadcast_to(made.metalness[k], lights),
            roughness=np.broadcast_to(made.roughness[k], lights),
            normal=np.broadcast_to(made.normal[k], (lights, 3)),
        )
        expected[k] = (microfacet(each, np.broadcast_to(view[k], (lights, 3)), direction) * light).T @ weight / np.pi
    off = (found - expected) / expected.mean()
    assert abs(off.mean()) < 0.1
    assert (np.quantile(np.abs(off), (0.5, 0.9)) < (usual, most)).all()
