"""The paper's cases and Iter_step, by table."""

import numpy as np
import pytest

from depthwalk.cook.cases import Case
from depthwalk.render.lod.paper_lod import iter_step, paper_cases, paper_level


@pytest.mark.parametrize(
    ("height", "case"),
    [(-0.21, Case.SIDE_AND_BOTTOM), (-0.2, Case.SIDE), (1.0, Case.SIDE), (1.9, Case.SIDE), (1.91, Case.SIDE_AND_TOP)],
)
def test_the_papers_three_cases(height: float, case: Case) -> None:
    assert paper_cases(np.array([[2.0, height, 0]]), np.array([-0.2]), np.array([1.9]))[0] == case


@pytest.mark.parametrize(
    ("distance", "step", "level"),
    [(0.5, 1.0, 0), (1.0, 1.0, 0), (1.9, 1.9, 0), (2.0, 2.0, 1), (7.9, 7.9, 2), (8.0, 8.0, 3), (900.0, 900.0, 6)],
)
def test_iter_step_by_table(distance: float, step: float, level: int) -> None:
    """One pixel at 1 m is one texel: 2·1·tan(45°) / 1000 = 2 mm."""
    found = iter_step(np.array([distance]), np.array([0.002]), 1.0, 1000)
    assert found[0] == pytest.approx(step)
    assert paper_level(found, 0.0, np.array([6]))[0] == level
    assert paper_level(found, 1.0, np.array([6]))[0] == min(level + 1, 6)
