"""Far clusters hold every object once, in boxes that follow the objects."""

import numpy as np
import pytest

from depthwalk.geometry.spatial_order import kd_tree_order
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.render.world.far_clusters import MEMBERS, make_far_clusters
from depthwalk.render.world.spatial_cells import sort_into_cells
from depthwalk.scene.arrays import Camera


def spheres(count: int, seed: int) -> Bounds:
    random = np.random.default_rng(seed)
    return Bounds(
        random.uniform(-50, 50, (count, 3)).astype(np.float32), random.uniform(0.1, 2, count).astype(np.float32)
    )


@pytest.mark.parametrize("count", [0, 1, 63, 64, 65, 256, 257, 5000])
def test_clusters_hold_every_object_once_within_cells(count: int) -> None:
    bounds = spheres(count, count)
    cells = sort_into_cells(bounds)
    clusters = make_far_clusters(cells, bounds, np.ones(count, bool))
    numbers = np.arange(len(clusters))
    rows, members = clusters.members(numbers)
    assert sorted(rows) == list(range(count)) and members.sum() == count
    assert not count or (members.min() > 0 and members.max() <= MEMBERS)
    assert set(cells.first) <= set(clusters.first)
    cluster = np.repeat(numbers, members)
    bounding_radius = bounds.bounding_radius[rows, None]
    assert (bounds.centre[rows] - bounding_radius >= clusters.low[cluster]).all()
    assert (bounds.centre[rows] + bounding_radius <= clusters.high[cluster]).all()


def test_one_that_may_not_share_keeps_its_cell_from_it() -> None:
    bounds = spheres(1000, 1)
    shareable = np.ones(1000, bool)
    shareable[17] = False
    cells = sort_into_cells(bounds)
    able = make_far_clusters(cells, bounds, shareable).able
    assert (~able).sum() == 1
    cell = int(np.flatnonzero(~able)[0])
    assert 17 in cells.order[cells.first[cell] : cells.first[cell + 1]]


@pytest.mark.parametrize("count", [0, 1, 64, 1000, 4096])
def test_neighbours_lie_in_boxes_that_hardly_overlap(count: int) -> None:
    points = np.random.default_rng(count).uniform(0, 1, (count, 3)) * (1, 0, 1)
    order = kd_tree_order(points, 64)
    assert sorted(order) == list(range(count))
    if count:
        starts = np.arange(0, count, 64)
        low, high = (gather.reduceat(points[order], starts) for gather in (np.minimum, np.maximum))
        assert ((high - low)[:, 0] * (high - low)[:, 2]).sum() <= 1 + 1e-9


def test_boxes_follow_objects_that_moved() -> None:
    """Only the clusters of their cells are refitted, and count it."""
    bounds = spheres(1000, 2)
    cells = sort_into_cells(bounds)
    clusters = make_far_clusters(cells, bounds, np.ones(1000, bool))
    clusters.follow(cells, bounds)
    assert not clusters.version.any()
    bounds.centre[500] += (0, 200, 0)
    cells.refit(bounds, np.array([500]))
    for _ in range(2):
        clusters.follow(cells, bounds)
    rows, count = clusters.members(np.arange(len(clusters)))
    holding = np.repeat(np.arange(len(clusters)), count)[rows == 500]
    assert clusters.high[holding, 1] >= bounds.centre[500, 1] + bounds.bounding_radius[500]
    assert clusters.version[holding] == 1 and 0 < clusters.version.sum() < len(clusters)


def test_a_cluster_is_resident_if_all_its_members_are() -> None:
    bounds = spheres(600, 3)
    clusters = make_far_clusters(sort_into_cells(bounds), bounds, np.ones(600, bool))
    numbers = np.arange(len(clusters))
    missing = int(clusters.first_members(numbers[1:2])[0])
    assert clusters.resident(numbers, lambda rows: rows != missing).tolist() == (numbers != 1).tolist()
    assert not len(clusters.resident(numbers[:0], lambda rows: rows != missing))


@pytest.mark.parametrize(("height", "shared"), [(-3.0, True), (0.0, False), (3.0, True)])
def test_cells_beside_the_viewer_are_not_shared(height: float, shared: bool) -> None:
    """At eye level objects hide each other; just above their heads, or below the ground, few do."""
    centre = np.random.default_rng(4).uniform(-400, 400, (20_000, 3)) * (1, 0, 1)
    bounds = Bounds(centre, np.ones(len(centre)))
    cells = sort_into_cells(bounds)
    clusters = make_far_clusters(cells, bounds, np.ones(len(centre), bool))
    view = View(Camera((0.0, height, 400.0), (0.0, height, 0.0), 1.0), (640, 480))
    far = clusters.far(view, cells, np.arange(len(cells.low)), 16.0)
    assert (far.mean() > 0.5) if shared else not far.any()
