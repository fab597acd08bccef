"""Where the sun's maps lie: they hold what is seen, keep still, and are cut where the paper says."""

import numpy as np
import pytest

from depthwalk.render.shadows.cascades import DEPTH, Cascade, fit_cascades, light_axes, split_distances
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View, matrix_array
from depthwalk.scene.arrays import Camera
from depthwalk.scene.effect_settings import ShadowParams

TO_SUN = np.array([0.4, 0.8, -0.3])
PARAMS = ShadowParams(enabled=True)


def seen_from(
    position: tuple[float, float, float] = (1.0, 2.0, 3.0),
    target: tuple[float, float, float] = (4.0, 1.0, -2.0),
    far: float = 60.0,
) -> View:
    return View(Camera(position, target, 1.0), (320, 200), near=0.2, far=far)


def test_slices_are_even_or_each_as_many_times_as_far() -> None:
    assert split_distances(1.0, 16.0, 3, 0.0) == pytest.approx([6.0, 11.0, 16.0])
    assert split_distances(1.0, 16.0, 4, 1.0) == pytest.approx([2.0, 4.0, 8.0, 16.0])
    assert split_distances(1.0, 16.0, 4, 0.5) == pytest.approx([3.375, 6.25, 10.125, 16.0])


@pytest.mark.parametrize("direction", [(0.0, 5.0, 0.0), (1.0, 0.0, 0.0), (0.4, 0.8, -0.3)])
def test_axes_are_a_turn_whose_last_points_to_the_light(direction: tuple[float, float, float]) -> None:
    axes = light_axes(np.array(direction))
    assert axes @ axes.T == pytest.approx(np.eye(3)) and np.linalg.det(axes) == pytest.approx(1)
    assert axes[2] == pytest.approx(np.array(direction) / np.linalg.norm(direction))


def test_every_point_in_sight_is_in_the_map_of_its_slice() -> None:
    view = seen_from()
    rng = np.random.default_rng(3)
    cascades = fit_cascades(view, TO_SUN, PARAMS)
    assert len(cascades) == PARAMS.cascades
    distance = rng.uniform(0.2, PARAMS.distance, 4000)
    rays = np.column_stack([rng.uniform(-1, 1, (4000, 2)), np.ones(4000)]) @ view.ray_from_screen.T
    points = view.position + distance[:, None] * rays / np.linalg.norm(rays, axis=1)[:, None]
    ends = split_distances(PARAMS.distance / 64, PARAMS.distance, PARAMS.cascades, PARAMS.split)
    for number, cascade in enumerate(cascades):
        inside = points[(distance <= ends[number]) & (distance > (ends[number - 1] if number else 0))]
        clip = matrix_array(cascade.clip_from_centre)[:3, :3] @ (inside - cascade.centre).T
        assert len(inside) > 20 and np.abs(clip).max() <= 1


def places(cascades: tuple[Cascade, ...]) -> list[tuple[tuple[float, float, float], float]]:
    return [(map_.centre, map_.half) for map_ in cascades]


@pytest.mark.parametrize("target", [(-4.0, 1.0, 2.0), (1.0, 2.0, 9.0), (1.1, -5.0, 3.0)])
@pytest.mark.parametrize("fov", [0.3, 1.7])
def test_who_turns_or_zooms_changes_no_map(target: tuple[float, float, float], fov: float) -> None:
    turned = View(Camera((1.0, 2.0, 3.0), target, fov), (320, 200), near=0.7, far=9.0)
    assert places(fit_cascades(turned, TO_SUN, PARAMS)) == places(fit_cascades(seen_from(), TO_SUN, PARAMS))


def test_maps_move_by_whole_texels_and_keep_their_size_while_the_viewer_walks() -> None:
    first = fit_cascades(seen_from(), TO_SUN, PARAMS)
    for walked in (seen_from(position=(1.7, 2.1, 3.4), target=(4.7, 1.1, -1.6)), seen_from((90.0, 1.0, -40.0))):
        for before, after in zip(first, fit_cascades(walked, TO_SUN, PARAMS), strict=True):
            assert after.half == pytest.approx(before.half)
            moved = (np.subtract(after.centre, before.centre) @ before.axes.T)[:2] / before.texel
            assert moved == pytest.approx(np.round(moved), abs=1e-4)


def test_a_small_step_moves_no_map() -> None:
    cascades = fit_cascades(seen_from(), TO_SUN, PARAMS)
    still = 0
    for k in range(10):
        moved = fit_cascades(seen_from((1 + 1e-4 * k, 2.0, 3.0), (4 + 1e-4 * k, 1.0, -2.0)), TO_SUN, PARAMS)
        still += [map_.centre for map_ in moved] == [map_.centre for map_ in cascades]
    assert still >= 9


def test_the_last_map_holds_a_small_scene_and_never_moves() -> None:
    """So far as no map about the viewer is smaller: from far off it is the only one."""
    extent = np.array([2.0, 1.0, 3.0]), 5.0
    for x, count in ((0.0, 3), (2.0, 3), (40.0, 1)):
        cascades = fit_cascades(seen_from(position=(x, 1.0, 3.0)), TO_SUN, PARAMS, extent)
        assert len(cascades) == count and places(cascades[-1:]) == [((2.0, 1.0, 3.0), 5.0)]
        assert all(map_.half < 5.0 for map_ in cascades[:-1])


def test_what_is_larger_than_the_distance_is_held_only_as_far() -> None:
    extent = np.array([2.0, 1.0, 3.0]), 500.0
    without = fit_cascades(seen_from(), TO_SUN, PARAMS)
    assert places(fit_cascades(seen_from(), TO_SUN, PARAMS, extent)) == places(without)


def test_there_are_no_maps_where_all_is_beyond_the_distance() -> None:
    view = View(Camera((0, 1, 0), (0, 1, 1), 1.0), (320, 200), near=90.0, far=200.0)
    assert fit_cascades(view, TO_SUN, PARAMS) == ()


def test_casters_reach_to_the_sun_and_beside_the_map_there_are_none() -> None:
    view = Cascade(centre=(0.0, 0.0, 0.0), half=10.0, axes=light_axes(np.array([0.0, 1, 0])), resolution=100)
    centre = np.array([[0, 5000.0, 0], [0, -DEPTH * 10 - 2, 0], [12, 0, 0], [10.5, 0, 0], [0, 0, -10.5]], np.float32)
    assert view.meets(Bounds(centre, np.ones(5, np.float32))).tolist() == [True, False, False, True, True]
    assert view.texel == pytest.approx(0.2) and view.light == pytest.approx((0, 1, 0, 0))
    nearest, middle = view.texels(Bounds(centre, np.ones(5, np.float32)))
    assert nearest == pytest.approx([0.2] * 5) and middle == pytest.approx([0.2] * 5)
