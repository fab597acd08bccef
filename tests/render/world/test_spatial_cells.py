"""Cells find what looking at every object finds, also after some moved; what is too small is left out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.render.world.spatial_cells import boxes_about, nearest, nearest_first, sort_into_cells
from depthwalk.scene.arrays import Camera
from depthwalk.types import Array, Rows


def spheres(count: int, extent: Array | Rows, seed: int) -> Bounds:
    random = np.random.default_rng(seed)
    centre = random.uniform(-1, 1, (count, 3)) * extent
    return Bounds(centre.astype(np.float32), random.uniform(0.01, 3, count).astype(np.float32))


def view_from(eye: Array, seed: int, fov: float = 1.0) -> View:
    direction = np.random.default_rng(seed).normal(size=3)
    return View(Camera(tuple(eye), tuple(eye + direction), fov), (160, 90))


def visible(bounds: Bounds, view: View, min_pixels: float) -> tuple[Rows, Array]:
    """Rows of the objects in sight, and how far ahead they are, nearest first."""
    cells = sort_into_cells(bounds)
    rows, forward = cells.visible(view, bounds, min_pixels, *cells.batches(view, min_pixels, 1 << 30))
    return nearest_first(rows, forward), np.sort(forward)


@pytest.mark.parametrize("size", [256, 1000, 30_000])
def test_batches_hold_each_cell_once_and_the_nearest_first(size: int) -> None:
    bounds = spheres(20_000, np.array([100, 5, 100]), 1)
    cells, view = sort_into_cells(bounds), view_from(np.array([0.0, 0, 0]), 3)
    batches = cells.batches(view, 0.0, size)
    every = np.concatenate(batches)
    assert sorted(every) == sorted(*cells.batches(view, 0.0, 1 << 30))
    assert (len(batches) > 1) == (cells.count_objects(every) > size)
    counts = np.array([cells.count_objects(batch) for batch in batches[:-1]])
    assert (np.abs(counts - size * 4 ** np.arange(len(counts))) <= 256).all()
    forward, bounding_radius = cells.along(view, every)
    assert (np.diff(forward - bounding_radius) >= 0).all()


@given(st.integers(0, 2000), st.sampled_from([(0, 0, 0), (1, 0, 0), (100, 5, 100), (1e5, 1, 1e5)]), st.integers(0, 99))
def test_cells_lose_and_add_nothing(count: int, extent: tuple[float, float, float], seed: int) -> None:
    bounds = spheres(count, np.array(extent, float), seed)
    view = view_from(np.random.default_rng(seed).uniform(-1, 1, 3) * extent, seed)
    rows, forward = visible(bounds, view, 0.0)
    expected, distances = bounds.visible(view)
    assert set(rows) == set(expected) and len(rows) == len(expected)
    np.testing.assert_allclose(forward, distances, atol=1e-6)  # nearest first
    np.testing.assert_allclose((bounds.centre[rows] - view.position) @ view.axes[2], forward, atol=1e-6)


@pytest.mark.parametrize("min_pixels", [0.5, 4.0, 40.0])
def test_objects_under_the_size_are_left_out(min_pixels: float) -> None:
    bounds = spheres(5000, np.array([400, 20, 400]), 3)
    view = View(Camera((300, 0, 300), (0, 0, 0), 1.0), (160, 90))
    rows, _ = visible(bounds, view, min_pixels)
    expected, _ = bounds.visible(view)
    across = 2 * view.focal_pixels * bounds.bounding_radius / np.linalg.norm(bounds.centre - view.position, axis=1)
    large = expected[across[expected] >= min_pixels]
    assert set(rows) == set(large) and 0 < len(large) < len(expected)


@pytest.mark.parametrize("rows", [slice(0, 1), slice(100, 1300), slice(1999, 2000)])
def test_moved_objects_are_found_where_they_went(rows: slice) -> None:
    bounds = spheres(2000, np.array([100, 5, 100]), 4)
    cells = sort_into_cells(bounds)
    view = view_from(np.array([500.0, 0, 0]), 2)
    bounds.centre[rows] = view.position + 30 * view.axes[2]
    cells.refit(bounds, np.arange(2000)[rows])
    assert (
        set(cells.visible(view, bounds, 0.0, *cells.batches(view, 0.0, 1 << 30))[0])
        == set(bounds.visible(view)[0])
        >= set(range(*rows.indices(2000)))
    )


def test_few_cells_are_asked_where_little_is_seen() -> None:
    x, z = np.meshgrid(np.arange(300.0), np.arange(300.0))
    bounds = Bounds(np.stack([x, 0 * x, z], -1).reshape(-1, 3), np.full(x.size, 0.5))
    cells = sort_into_cells(bounds)
    away = View(Camera((150, 1, 290), (150, 1, 400), 1.0), (160, 90))
    assert cells._may_show(away, 0.0).mean() < 0.05


@given(st.lists(st.integers(0, 6), max_size=40), st.integers(1, 12))
def test_the_nearest_are_those_that_sorting_all_puts_first(forward: list[int], count: int) -> None:
    """Also among many that are equally distant."""
    distance = np.array(forward, float)
    found = nearest(distance, count)
    assert found.tolist() == nearest_first(np.arange(len(distance)), distance)[:count].tolist() or len(forward) <= count
    assert sorted(found) == sorted(nearest_first(np.arange(len(distance)), distance)[:count])


def test_boxes_hold_the_spheres_that_follow_one_another() -> None:
    bounds = spheres(50, np.array([9.0, 9.0, 9.0]), 2)
    rows = np.random.default_rng(1).permutation(50)[:37]
    low, high = boxes_about(bounds, rows, 16)
    assert len(low) == len(high) == 3
    for k, row in enumerate(rows):
        assert (low[k // 16] < bounds.centre[row] - bounds.bounding_radius[row]).all()
        assert (high[k // 16] > bounds.centre[row] + bounds.bounding_radius[row]).all()
    assert (high - low < 26).all()
