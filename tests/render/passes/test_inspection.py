"""Normals, distances and colours in the place of light: a ball, whose truth is known, by mesh and by depth images."""

import numpy as np
import pytest

from depthwalk.reference.inspection import distance_grey, normal_colour
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.effect_settings import InspectionParams
from depthwalk.types import Array
from shapes import ShapeLibrary, scene_of, sphere

SIZE = (96, 72)
CAMERA = Camera((1.0, 2.0, 4.0), (0.0, 1.0, 0.0), 0.7)
COLOUR = (200, 120, 80)


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([sphere(1.0, 64, 32, colour=COLOUR)], resolution=64)


def pictures(library: ShapeLibrary, how: Representation, show: str, background: bool = True) -> tuple[Array, Array]:
    """(H, W, 4) sRGB and alpha, 0 to 1, and (H, W) metres along the view axis."""
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=how)
    scene.render.aa = "none"
    scene.render.inspection = InspectionParams.model_validate({"show": show, "half_distance": 3.0})
    with HeadlessRenderer(scene, library, SIZE) as headless:
        headless.draw(View(CAMERA, SIZE), transparent=not background)
        pixels = headless.pixels() / 255.0
        headless.draw(View(CAMERA, SIZE), linear=True)
        return pixels, headless.linear_image().distance


def ball() -> tuple[Array, Array]:
    """(H, W, 3) normals of the ball as pixels show it, and (H, W) distances; NaN and infinite where it is not."""
    view = View(CAMERA, SIZE)
    x, y = np.meshgrid((np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1, 1 - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2)
    rays = np.stack([x, y, np.ones_like(x)], -1) @ view.ray_from_screen.T
    start = np.array(CAMERA.position) - (0, 1, 0)
    a, b, c = (rays**2).sum(-1), (rays * start).sum(-1), (start**2).sum() - 1
    with np.errstate(invalid="ignore"):
        away = (-b - np.sqrt(b * b - a * c)) / a
    return start + away[..., None] * rays, np.where(np.isnan(away), np.inf, away)


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.parametrize("how", [Representation.MESH, Representation.DPCI])
def test_a_ball_shows_its_normals_distances_and_colour(library: ShapeLibrary, how: Representation) -> None:
    normals, distance = ball()
    inside = np.isfinite(distance)
    inside[1:-1, 1:-1] &= inside[:-2, 1:-1] & inside[2:, 1:-1] & inside[1:-1, :-2] & inside[1:-1, 2:]
    assert inside.sum() > 800
    shown, _ = pictures(library, how, "normals")
    assert np.abs(shown[..., :3] - normal_colour(normals))[inside].max() < 0.05
    shown, found = pictures(library, how, "distance")
    assert np.abs(shown[..., 0] - distance_grey(distance, 3.0))[inside].max() < 0.02
    assert np.abs(shown[..., 1] - distance_grey(found, 3.0)).max() < 0.005  # the twin, where nothing is too
    shown, _ = pictures(library, how, "albedo")
    assert np.abs(shown[..., :3] - np.array(COLOUR) / 255)[inside].max() < 0.01


@pytest.mark.gl
def test_what_is_no_surface_is_black_or_empty(library: ShapeLibrary) -> None:
    for background, alpha in ((True, 1.0), (False, 0.0)):
        shown, distance = pictures(library, Representation.MESH, "normals", background)
        nothing = np.isinf(distance)
        assert nothing.any() and (shown[nothing] == (0, 0, 0, alpha)).all() and (shown[~nothing, 3] == 1).all()
