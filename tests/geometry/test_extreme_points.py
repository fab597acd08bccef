"""The few points that say how far a set reaches."""

import numpy as np

from depthwalk.geometry.extreme_points import extreme_points


def test_few_points_reach_as_far_as_all() -> None:
    """In any direction, of a blob that leans, far from the origin; none of them is invented."""
    rng = np.random.default_rng(3)
    points = (rng.normal(size=(20_000, 3)) * [3.0, 1.0, 0.5] + [100.0, -20.0, 7.0]).astype(np.float32)
    found = extreme_points(points)
    assert len(found) <= 512
    assert {tuple(row) for row in found.tolist()} <= {tuple(row) for row in points.astype(float).tolist()}
    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    reach, reached = ((some @ directions.T).max(0) for some in (points.astype(float), found))
    size = np.linalg.norm(np.ptp(points, axis=0))
    assert (reached <= reach + 1e-9).all() and (reach - reached).max() < 0.005 * size


def test_where_there_are_few_all_are_kept() -> None:
    np.testing.assert_array_equal(extreme_points(np.eye(3, dtype=np.float32)), np.eye(3))
