"""Fog in cases that can be computed by hand."""

import math

import numpy as np
import pytest

from depthwalk.reference.fog import fog_before_sky, fog_density, fog_through


def test_density_is_constant_up_to_the_height_and_falls_to_one_over_e_above() -> None:
    assert fog_density(np.array([-50.0, 2.0, 5.0, 8.0]), 0.4, 2.0, 3.0) == pytest.approx(
        [0.4, 0.4, 0.4 / math.e, 0.4 / math.e**2]
    )


def test_below_its_height_fog_is_beer_and_lambert() -> None:
    way = np.array([[3.0, 0, 4.0], [0, -7.0, 0], [0, 1e-9, 10.0]])
    assert fog_through(0.0, way, 0.1, 5.0, 2.0) == pytest.approx(np.exp(-0.1 * np.array([5.0, 7.0, 10.0])))


def test_straight_up_from_the_height_falloff_metres_of_fog_remain() -> None:
    """The integral of e^(−y/falloff) over all heights is the falloff."""
    assert fog_through(1.0, np.array([[0.0, 1e5, 0]]), 0.1, 1.0, 6.0) == pytest.approx(np.exp(-0.6))
    assert fog_before_sky(1.0, np.array([1.0, 0.5]), 0.1, 1.0, 6.0) == pytest.approx(np.exp([-0.6, -1.2]))


def test_fog_is_the_same_both_ways() -> None:
    way = np.array([[4.0, 3.0, 1.0], [2.0, -5.0, 7.0]])
    there = fog_through(1.5, way, 0.05, 2.0, 3.0)
    back = np.concatenate([fog_through(1.5 + y, -way[k : k + 1], 0.05, 2.0, 3.0) for k, y in enumerate(way[:, 1])])
    assert there == pytest.approx(back)


def test_fog_never_ends_where_a_ray_does_not_rise() -> None:
    assert (fog_before_sky(1.0, np.array([0.0, -0.3]), 0.01, 0.0, 5.0) == 0).all()
