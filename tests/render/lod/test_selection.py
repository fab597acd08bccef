"""Levels of detail by error and by triangles."""

import math

import numpy as np
import pytest

from depthwalk.render.lod.selection import (
    affordable_level,
    error_at_a_metre,
    error_level,
    greatest_stretch,
    levels_within,
    stretch,
)
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.object_settings import LodParams
from stage import view_of


def test_no_more_triangles_than_pixels_can_show() -> None:
    triangles = np.array([[1000, 300, 90, 30]])
    levels = [
        affordable_level(triangles, np.array([pixels]), 3.0)[0] for pixels in (1e9, 334.0, 333.0, 31.0, 11.0, 1.0)
    ]
    assert levels == [0, 0, 1, 2, 3, 4]


@pytest.mark.parametrize(("allowed", "level"), [(0.0, 0), (0.009, 0), (0.01, 1), (0.5, 2), (1e9, 2)])
def test_the_coarsest_level_that_is_accurate_enough(allowed: float, level: int) -> None:
    error = np.array([[0.001, 0.01, 0.1, np.inf]])
    assert error_level(error, np.array([allowed]))[0] == level


def test_allowed_errors_grow_with_the_bias_and_shrink_with_the_picture() -> None:
    view = view_of()
    plain = error_at_a_metre(view, LodParams(error=0.5))
    assert plain * view.focal_pixels == pytest.approx(0.5)
    assert error_at_a_metre(view, LodParams(error=0.5, bias=1.0)) == pytest.approx(2 * plain)


def test_wide_pictures_stretch_what_is_far_off_their_axis() -> None:
    """As two points next to each other on a ray's sphere are projected, and beyond 45° alone."""
    view = View(Camera((1.0, 2.0, 3.0), (1.0, 2.0, 0.0), math.radians(150)), (400, 300))
    angles = np.radians([0, 40, 46, 55, 65, 75])
    around = np.stack([np.sin(angles), 0 * angles, -np.cos(angles)], -1)
    further = np.stack([np.sin(angles + 1e-5), 0 * angles, -np.cos(angles + 1e-5)], -1)
    projected = [points[:, 0] / -points[:, 2] for points in (around, further)]
    expected = np.maximum((projected[1] - projected[0]) / 1e-5 * 0.71**2, 1.0)
    assert stretch(view, view.position + 5 * around) == pytest.approx(expected, rel=1e-3)
    corner = math.hypot(1.0, *view.half_extent)
    assert stretch(view, view.position + np.array([[0.0, 0.0, 4.0]])) == pytest.approx((0.71 * corner) ** 2)
    assert greatest_stretch(view) == pytest.approx((0.5 * corner) ** 2)


@pytest.mark.parametrize(("fov", "size"), [(80, (1920, 1080)), (60, (2560, 1080)), (90, (1024, 768))])
def test_usual_pictures_are_not_stretched(fov: float, size: tuple[int, int]) -> None:
    view = View(Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), math.radians(fov)), size)
    assert (stretch(view, np.array([[9.0, 5.0, -1.0], [0.0, 0.0, 1.0]])) == 1).all() and greatest_stretch(view) == 1


def test_the_last_objects_become_coarser_first_until_there_are_few_enough_triangles() -> None:
    triangles = np.array([[900, 300, 100, 30], [400, 200, 100, 0], [50, 0, 0, 0]])
    level, coarsest = np.array([0, 1, 0]), np.array([3, 2, 0])
    assert levels_within(triangles, level, coarsest, 2000).tolist() == [0, 1, 0]
    assert levels_within(triangles, level, coarsest, 1100).tolist() == [0, 2, 0]
    assert levels_within(triangles, level, coarsest, 500).tolist() == [1, 2, 0]
    assert levels_within(triangles, level, coarsest, 250).tolist() == [2, 2, 0]
    assert levels_within(triangles, level, coarsest, 1).tolist() == [3, 2, 0]
