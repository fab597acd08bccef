"""Fog takes the place of light by how much of it comes through."""

from typing import Any

import numpy as np
import pytest

from alone import Alone, MakeAlone
from depthwalk.colour import linear_from_srgb
from depthwalk.reference.fog import fog_through
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.passes.fog import FogPass
from depthwalk.render.view.view import view_distance
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
