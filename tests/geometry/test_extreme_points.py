"""The few points that say how far a set reaches."""

import time
from statistics import median

import numpy as np
import pytest

from depthwalk.geometry.extreme_points import extreme_points, farthest, spread_directions
from depthwalk.types import Array


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


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("count", [0, 1, 7, 512])
def test_the_farthest_are_found_across_blocks(kind: type[np.float32 | np.float64], count: int) -> None:
    """Of several that are equally far the first, wherever blocks begin and end."""
    points: Array = np.random.default_rng(5).integers(-9, 9, (70_001, 3)).astype(kind)
    directions = spread_directions(count) if count else np.zeros((0, 3))
    found, reach = farthest(points, directions)
    along = points @ directions.T
    np.testing.assert_array_equal(found, along.argmax(0))
    np.testing.assert_array_equal(reach, along.max(0))


def test_the_farthest_are_found_quickly() -> None:
    """The keys that show all objects wait for this, for each of many models."""
    points = np.random.default_rng(5).normal(size=(8192, 3)).astype(np.float32)
    directions = spread_directions(512)
    seconds = []
    for find in (lambda: farthest(points, directions), lambda: (points @ directions.T).argmax(0)):
        takes = []
        for _ in range(3):
            start = time.process_time()
            find()
            takes.append(time.process_time() - start)
        seconds.append(median(takes))
    assert seconds[0] < 0.4 * seconds[1]
