"""Levels of detail by error and by triangles."""

import numpy as np
import pytest

from depthwalk.render.lod.selection import affordable_level, error_at_a_metre, error_level, levels_within
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


def test_the_last_objects_become_coarser_first_until_there_are_few_enough_triangles() -> None:
    triangles = np.array([[900, 300, 100, 30], [400, 200, 100, 0], [50, 0, 0, 0]])
    level, coarsest = np.array([0, 1, 0]), np.array([3, 2, 0])
    assert levels_within(triangles, level, coarsest, 2000).tolist() == [0, 1, 0]
    assert levels_within(triangles, level, coarsest, 1100).tolist() == [0, 2, 0]
    assert levels_within(triangles, level, coarsest, 500).tolist() == [1, 2, 0]
    assert levels_within(triangles, level, coarsest, 250).tolist() == [2, 2, 0]
    assert levels_within(triangles, level, coarsest, 1).tolist() == [3, 2, 0]
