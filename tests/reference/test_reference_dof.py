"""Depth of field where every circle of confusion is known."""

import numpy as np
import pytest

from depthwalk.reference.dof import gather
from depthwalk.reference.dof_paper import paper
from depthwalk.reference.dof_tiles import ranges
from depthwalk.render.view.lens import LEAST_HALF
from depthwalk.types import Array

RNG = np.random.default_rng(8)


def picture(height: int = 24, width: int = 30) -> Array:
    return RNG.uniform(0, 1, (height, width, 4))


def test_a_tile_knows_circles_that_reach_it_and_no_others() -> None:
    circles = np.zeros((12, 40))
    circles[5, 2], circles[5, 38] = 6.0, -9.0
    low, high = ranges(circles, 4)
    assert high[5, 0] == 6 and high[5, 4] == 6 and high[5, 8] == 6  # the second tile beyond is 4 pixels away
    assert high[5, 12] == 0  # the third is 8 pixels away
    assert low[5, 39] == -9 and low[5, 28] == -9 and low[5, 20] == 0


def test_ranges_are_of_the_size_of_the_picture_when_tiles_are_cut_off() -> None:
    circles = RNG.normal(size=(10, 13))
    low, high = ranges(circles, 8)
    assert low.shape == high.shape == circles.shape
    assert (low <= circles).all() and (high >= circles).all()


@pytest.mark.parametrize("circle", [0.0, 0.4])
def test_what_is_in_focus_stays_as_it_is(circle: float) -> None:
    lit, circles = picture(), np.full((24, 30), circle)
    np.testing.assert_array_equal(gather(lit, circles, 16, tile=8), lit)


@pytest.mark.parametrize("circle", [-3.0, 5.0])
def test_an_even_picture_stays_even(circle: float) -> None:
    lit, circles = np.tile([0.3, 0.5, 0.7, 1.0], (24, 30, 1)), np.full((24, 30), circle)
    assert gather(lit, circles, 16, tile=8) == pytest.approx(lit)
    weights = np.exp(-np.arange(7) / 3)
    weights /= weights[0] + 2 * weights[1:].sum()
    disc = RNG.uniform(-0.7, 0.7, (13, 2))
    assert paper(lit, circles, weights, disc, 5.0) == pytest.approx(lit)


def test_a_blurred_point_keeps_its_light_and_spreads_over_its_circle() -> None:
    circle = LEAST_HALF - 0.2  # a wider one is gathered in a reduced picture
    lit, circles = np.zeros((41, 41, 4)), np.full((41, 41), circle)
    lit[20, 20] = 1
    out = gather(lit, circles, 64, tile=8)[..., 0]
    y, x = np.mgrid[:41, :41] - 20
    assert out.sum() == pytest.approx(1, abs=0.05)
    assert out[np.hypot(x, y) > circle + 1.5].max() == 0
    assert np.count_nonzero(out) > 0.53 * np.pi * circle**2  # pixels of the circle: 60 of one whose radius is 6


def test_paper_without_blur_is_the_sharp_picture() -> None:
    lit, circles = picture(), np.zeros((24, 30))
    assert paper(lit, circles, np.eye(7)[0], np.zeros((13, 2)), 5.0) == pytest.approx(lit)


def test_paper_at_full_blur_is_the_blurred_picture() -> None:
    """With the disc's points all in the middle, an edge becomes the sum of the weights on its other side."""
    lit, circles = np.zeros((9, 40, 4)), np.full((9, 40), 5.0)
    lit[:, 20:] = 1
    weights = np.exp(-(np.arange(7) ** 2) / 8)
    weights /= weights[0] + 2 * weights[1:].sum()
    out = paper(lit, circles, weights, np.zeros((13, 2)), 5.0)[4, :, 0]
    assert out[19] == pytest.approx(weights[1:].sum()) and out[20] == pytest.approx(1 - weights[1:].sum())
    assert out[13] == 0 and out[26] == pytest.approx(1)
