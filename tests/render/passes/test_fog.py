"""Fog takes the place of light by how much of it comes through."""

from typing import Any

import numpy as np
import pytest

from alone import SIZE, Alone, MakeAlone
from depthwalk.colour import linear_from_srgb
from depthwalk.reference.fog import fog_colour, fog_through
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.lighting.sky import environment_sky
from depthwalk.render.passes.fog import FogPass
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import Environment

FOG = {"density": 0.1, "height": 1.0, "falloff": 2.0}
DEPTH = 0.99


def draw(fog: Alone, transparent: bool = False, **values: Any) -> None:
    environment = Environment.model_validate({"fog": FOG | values})
    fog.draw(environment=environment, light=lighting(environment), transparent=transparent)


def test_light_is_lost_as_the_twin_says(alone: MakeAlone) -> None:
    fog = alone(FogPass())
    fog.targets.lighting.clear(1.0, 1.0, 1.0, 1.0, depth=DEPTH)
    draw(fog, colour=(0.0, 0.0, 0.0))
    view = fog.view
    distance = view_distance(np.array([DEPTH], np.float32), *view.depth_range)[0]
    width, height = view.size
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
    ways = distance * (np.stack([x, y, np.ones_like(x)], -1) @ view.ray_from_screen.T).reshape(-1, 3)
    expected = fog_through(view.position[1], ways, **FOG).reshape(height, width)
    assert fog.lit()[..., 0] == pytest.approx(expected, abs=2e-3)
    assert (fog.lit()[..., 3] == 1).all()


def test_a_colour_of_its_own_is_what_thick_fog_shows(alone: MakeAlone) -> None:
    fog = alone(FogPass())
    fog.targets.lighting.clear(0.0, 0.0, 0.0, 1.0, depth=DEPTH)
    draw(fog, density=1.0, height=10.0, colour=(0.2, 0.4, 0.6))
    expected = linear_from_srgb(np.array([0.2, 0.4, 0.6]))
    assert fog.lit()[4, 6, :3] == pytest.approx(expected, abs=2e-3)


def test_who_looks_straight_down_sees_no_star_of_horizons(alone: MakeAlone) -> None:
    """The sky is bright about the sun alone; where all azimuths meet, neighbouring pixels must not differ by them."""
    down = View(Camera((0.0, 80.0, 0.0), (1e-3, 0.0, 0.0), 0.5), SIZE, near=0.1, far=50.0)
    fog = alone(FogPass(), down)
    fog.targets.lighting.clear(0.0, 0.0, 0.0, 1.0, depth=0.999)
    environment = Environment.model_validate(
        {"fog": {"density": 1.0, "height": 1000.0}, "sky": {"model": "preetham"}, "sun": {"direction": (-0.6, -0.1, 0)}}
    )
    fog.draw(environment=environment, light=lighting(environment))
    width, height = SIZE
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
    rays = (np.stack([x, y, np.ones_like(x)], -1) @ down.ray_from_screen.T).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    shown = fog.lit()[..., :3]
    expected = fog_colour(environment_sky(environment), rays).reshape(height, width, 3)
    assert shown == pytest.approx(expected, rel=5e-3, abs=1e-3)
    assert np.abs(np.diff(shown, axis=1)).max() < 0.05 * shown.mean()


@pytest.mark.parametrize("transparent", [False, True])
def test_a_transparent_picture_stays_empty_where_nothing_is(alone: MakeAlone, transparent: bool) -> None:
    fog = alone(FogPass())
    fog.targets.lighting.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
    draw(fog, transparent=transparent, colour=(1.0, 1.0, 1.0))
    assert (fog.lit()[0] > 0).any() != transparent


@pytest.mark.parametrize(("fog", "expected"), [(None, False), ({"density": 0.0}, False), ({"density": 0.1}, True)])
def test_thin_air_needs_no_pass(alone: MakeAlone, fog: dict[str, float] | None, expected: bool) -> None:
    by_itself = alone(FogPass())
    frame = by_itself.frame(environment=Environment.model_validate({"fog": fog}))
    assert by_itself.pass_.enabled(frame, by_itself.pass_.params) is expected
