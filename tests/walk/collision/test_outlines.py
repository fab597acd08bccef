"""What of triangles lies at the height of a body, seen from above."""

import numpy as np
import pytest

from depthwalk.walk.collision.outlines import outlines

UPRIGHT = np.array([[[0.0, 0, 0], [4, 0, 0], [0, 4, 0]]])


def test_an_upright_triangle_is_cut_to_the_body() -> None:
    cut = outlines(UPRIGHT, 1.0, 2.0)
    ends = np.concatenate([cut.start, cut.start + cut.along])
    assert ends.real.min() == 0 and ends.real.max() == pytest.approx(3) and np.abs(ends.imag).max() == 0


def test_what_is_above_or_below_is_left_out() -> None:
    assert (
        len(outlines(UPRIGHT, 4.0, 5.0)) == len(outlines(UPRIGHT, -2.0, 0.0)) == len(outlines(UPRIGHT[:0], 0, 1)) == 0
    )
    floor = np.array([[[0.0, 1, 0], [1, 1, 0], [0, 1, 1]]])
    assert len(outlines(floor, 1.0, 2.0)) == 0 and len(outlines(floor, 0.5, 2.0)) == 3


def test_a_slope_that_reaches_through_the_body_has_two_sections() -> None:
    slope = np.array([[[0.0, 0, 0], [3, 3, 0], [0, 0, 5]]])
    cut = outlines(slope, 1.0, 2.0)
    level = sorted(round(x, 6) for x in cut.start.real[-2:])
    assert level == pytest.approx([1, 2]) and len(cut) == 4


def test_near_finds_what_is_within_reach() -> None:
    cut = outlines(UPRIGHT, 1.0, 2.0)
    rows, away, distance = cut.near(1 + 0.5j, 0.6)
    assert len(rows) == 2 < len(cut.near(1 + 0.5j, 9.0)[0])
    assert distance.min() == 0.5 and away[distance.argmin()] == 0.5j
    assert len(cut.near(1 + 5j, 0.6)[0]) == 0
