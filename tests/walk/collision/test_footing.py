"""On what a viewer stands."""

import numpy as np
import pytest

from depthwalk.walk.collision.footing import footing, stand

FLOOR = np.array([[[-1.0, 0.5, -1], [1, 0.5, -1], [1, 0.5, 1]], [[-1, 0.5, -1], [1, 0.5, 1], [-1, 0.5, 1]]])
WALL = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 3, 0]]])


def test_floors_are_stood_on_and_walls_are_not() -> None:
    assert footing(FLOOR).heights(0j).tolist().count(0.5) >= 5
    assert len(footing(FLOOR).heights(2 + 0j)) == len(footing(WALL).heights(0.1 + 0j)) == 0
    assert len(footing(FLOOR).heights(1.05 + 0j)) == 1  # one foot is on it still


def test_a_slope_has_a_height_everywhere() -> None:
    slope = np.array([[[0.0, 0, 0], [0, 0, 4], [4, 2, 0]]])
    assert footing(slope).heights(1 + 1j).min() == pytest.approx(0.5 - 0.04)


@pytest.mark.parametrize(("degrees", "carries"), [(75, True), (82, False)])
def test_what_is_nearly_upright_carries_nobody(degrees: float, carries: bool) -> None:
    """Else who walks past a kerb is lifted and dropped by its side, by what one foot happens to be above."""
    rise = np.tan(np.radians(degrees))
    side = np.array([[[0.0, 0, -1], [0, 0, 1], [1, rise, 0]]])
    assert (len(footing(side).heights(0.3 + 0j)) > 0) is carries


@pytest.mark.parametrize(
    ("heights", "stands"),
    [([], None), ([0.0, 0.3], 0.3), ([0.0, 0.4], 0.0), ([-2.0], -2.0), ([0.5], None), ([0.0, 0.3, 1.9], 0.0)],
)
def test_the_highest_surface_within_a_step_carries(heights: list[float], stands: float | None) -> None:
    assert stand(np.array(heights), 0.0, 0.35, 1.8) == stands
