"""Orders that keep near points together, and the runs that they are divided into."""

import numpy as np
import pytest

from depthwalk.geometry.spatial_order import cell_members, kd_tree_order, morton_codes, stable_order, within_runs
from depthwalk.types import Array, Rows


def mean_extent(points: Array, order: Rows, size: int) -> float:
    return np.mean([np.ptp(points[order[start : start + size]], 0).max() for start in range(0, len(points), size)])


@pytest.mark.parametrize("dtype", [np.int64, np.uint32])
def test_members_are_counted_within_their_runs(dtype: type[int]) -> None:
    counted = within_runs(np.array([2, 0, 3], dtype))
    assert counted.tolist() == [0, 1, 0, 1, 2] and counted.dtype == dtype


def test_runs_hold_the_members_of_cells() -> None:
    assert cell_members(np.array([0, 2, 2, 5]), np.array([2, 0, 1])).tolist() == [2, 3, 4, 0, 1]


def test_both_orders_keep_neighbours_together() -> None:
    points = np.random.default_rng(1).random((512, 3))
    tree, curve = kd_tree_order(points, 8), np.argsort(morton_codes(points), kind="stable")
    for order in tree, curve:
        assert sorted(order.tolist()) == list(range(512))
        assert mean_extent(points, order, 8) < 0.6 * mean_extent(points, np.arange(512), 8)
    assert mean_extent(points, tree, 8) < mean_extent(points, curve, 8)


def test_morton_codes_rise_from_corner_to_corner_octant_by_octant() -> None:
    codes = morton_codes(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1.0], [1, 1, 1]]))
    assert (np.diff(codes.astype(np.int64)) > 0).all() and codes[0] == 0 and codes[-1] == (1 << 30) - 1


def test_no_points_have_no_codes() -> None:
    assert len(morton_codes(np.zeros((0, 3)))) == 0


@pytest.mark.parametrize("most", [3, 1000, 2**62])
@pytest.mark.parametrize("count", [0, 1, 5000])
def test_whole_numbers_are_ordered_and_equal_ones_stay(count: int, most: int) -> None:
    """Also numbers beside which no place fits into 64 bits."""
    key = np.random.default_rng(0).integers(0, most, count)
    np.testing.assert_array_equal(stable_order(key), np.argsort(key, kind="stable"))
