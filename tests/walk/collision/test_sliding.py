"""A circle stops at segments or slides along them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthwalk.walk.collision.outlines import Outlines, from_segments
from depthwalk.walk.collision.sliding import nearest_motion, slide

SEAMS = [(-3 + k, -2 + k) for k in range(6)]  # of a wall along x at z = 1


def segments(*ends: tuple[complex, complex]) -> Outlines:
    start, end = np.array(ends, complex).reshape(-1, 2).T
    box = [f(g(start), g(end)) for g in (np.real, np.imag) for f in (np.minimum, np.maximum)]
    return Outlines(start=start, along=end - start, box=np.array(box))


WALL = segments(*((a + 1j, b + 1j) for a, b in SEAMS))


def test_nothing_stops_where_nothing_is() -> None:
    assert slide(segments(), 0j, 5 + 3j, 0.25) == 5 + 3j
    assert slide(WALL, 0j, 1 - 1j, 0.25) == 1 - 1j


@pytest.mark.parametrize("wanted", [2j, 0.8 + 3j, -0.3 + 1j])
def test_seams_of_a_wall_are_not_felt(wanted: complex) -> None:
    motion = slide(WALL, 0j, wanted, 0.25)
    assert motion.imag == pytest.approx(0.75) and motion.real == pytest.approx(wanted.real)
    along = slide(WALL, 0.75j, wanted, 0.25)
    assert along.imag == pytest.approx(0, abs=1e-8) and along.real == pytest.approx(wanted.real)


def test_two_lines_meet_where_both_are_kept() -> None:
    assert nearest_motion(2 + 3j, [(-1 + 0j, -0.5), (-1j, -0.25)]) == pytest.approx(0.5 + 0.25j)
    assert nearest_motion(2 + 0j, [(-1 + 0j, -0.5)]) == pytest.approx(0.5)
    assert nearest_motion(1 + 0j, [((-1 + 1j) / 2**0.5, 0.0), ((-1 - 1j) / 2**0.5, 0.0)]) == pytest.approx(0)


ENDS = st.tuples(*[st.floats(-2, 2)] * 4).map(lambda e: (complex(*e[:2]), complex(*e[2:])))


@pytest.mark.slow
@settings(deadline=None, max_examples=200)
@given(ends=st.lists(ENDS, min_size=1, max_size=12), wanted=st.complex_numbers(max_magnitude=3))
def test_no_motion_comes_closer_than_allowed_or_goes_farther_than_wanted(
    ends: list[tuple[complex, complex]], wanted: complex
) -> None:
    outlines = segments(*ends)
    rows = np.arange(len(outlines))
    before = np.abs(from_segments(0j, outlines.start, outlines.along))
    motion = slide(outlines, 0j, wanted, 0.25)
    assert abs(motion) <= abs(wanted) + 1e-9
    if before.min() > 1e-6:
        assert outlines.clearance(rows, 0j, motion).min() >= min(0.25, before.min()) - 1e-7


def test_a_crossed_segment_leaves_no_clearance() -> None:
    cross = segments((-1 + 0j, 1 + 0j), (-1 + 2j, 1 + 2j))
    assert cross.clearance(np.arange(2), -1j, 2j).tolist() == [0, 1]
