"""The level ground: where it is, which colour it has, and what hides it."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from alone import Alone, MakeAlone
from depthwalk.colour import linear_from_srgb
from depthwalk.reference.gbuffer import unpacked_surfaces
from depthwalk.render.passes.ground import GroundPass
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import Environment
from depthwalk.types import Array, Picture


def white(path: Path) -> Picture:
    return np.full((2, 2, 4), 255, np.uint8)


def draw(ground: Alone, **values: float | tuple[float, float, float]) -> None:
    environment = Environment.model_validate({"ground": {"height": 0.0, "half_size": 20.0, **values}})
    assets = SimpleNamespace(texture=white)
    ground.draw(environment=environment, assets=assets)


def ground_distance(view: View) -> Array:
    """Metres along the view axis to the plane y = 0 at each pixel, inf above the horizon."""
    width, height = view.size
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
    rise = (np.stack([x, y, np.ones_like(x)], -1) @ view.ray_from_screen.T)[..., 1]
    return np.where(rise < 0, -view.position[1] / np.minimum(rise, -1e-9), np.inf)


def test_it_is_where_rays_meet_its_plane(alone: MakeAlone) -> None:
    ground = alone(GroundPass())
    ground.targets.polygons.clear(depth=1.0)
    draw(ground, colour=(1.0, 1.0, 1.0))
    expected = ground_distance(ground.view)
    found = view_distance(ground.read("depth", np.float32, 1)[..., 0], *ground.view.depth_range)
    near = expected < 15  # within the square
    assert near.sum() > 20
    assert found[near] == pytest.approx(expected[near], rel=2e-3)
    assert np.isinf(found[np.isinf(expected)]).all()


@pytest.mark.parametrize("half_size", [1e3, 1e6])
def test_a_large_one_covers_the_picture_to_its_borders(alone: MakeAlone, half_size: float) -> None:
    camera = Camera((-400.0, 1.6, 400.0), (-400.3, 0.0, 399.0), 0.87)
    ground = alone(GroundPass(), View(camera, (1024, 64), near=0.1, far=4 * half_size))
    ground.targets.polygons.clear(depth=1.0)
    draw(ground, half_size=half_size)
    found = view_distance(ground.read("depth", np.float32, 1)[..., 0], *ground.view.depth_range)
    assert found == pytest.approx(ground_distance(ground.view), rel=1e-4)


def test_it_shows_in_front_of_the_near_plane(alone: MakeAlone) -> None:
    camera = Camera((0.3, 0.01, 0.2), (0.3, 0.0, -0.8), 1.2)
    ground = alone(GroundPass(), View(camera, (48, 32), near=0.05, far=50.0))
    ground.targets.polygons.clear(depth=1.0)
    draw(ground)
    expected = ground_distance(ground.view)
    found = view_distance(ground.read("depth", np.float32, 1)[..., 0], *ground.view.depth_range)
    assert (expected < 0.05).sum() > 400
    inside = expected < 15
    assert found[inside] == pytest.approx(np.maximum(expected[inside], 0.05), rel=2e-3)


def test_it_has_its_colour_and_is_no_object(alone: MakeAlone) -> None:
    ground = alone(GroundPass())
    ground.targets.polygons.clear(depth=1.0)
    draw(ground, colour=(0.5, 0.25, 1.0))
    surface = unpacked_surfaces(ground.read("surface", np.uint32, 2)[0, 6:7])
    number = ground.read("visibility_texture", np.uint32, 2)[0, 6]
    expected = np.sqrt(linear_from_srgb(np.array([0.5, 0.25, 1.0])))
    assert np.sqrt(surface.albedo[0]) == pytest.approx(expected, abs=1 / 255)
    assert surface.normal[0] == pytest.approx([0, 1, 0], abs=1e-6)
    assert number[0] == 0  # no depth image
    assert number[1] & 15 == 0 and number[1] != 0  # covered whole, and yet no mesh, which is 0


def test_what_is_nearer_hides_it(alone: MakeAlone) -> None:
    ground = alone(GroundPass())
    ground.targets.polygons.clear(depth=0.0)
    draw(ground)
    assert (ground.read("depth", np.float32, 1) == 0).all()


def test_without_ground_there_is_nothing_to_draw(alone: MakeAlone) -> None:
    ground = alone(GroundPass())
    assert not ground.pass_.enabled(ground.frame(environment=Environment()), ground.pass_.params)
