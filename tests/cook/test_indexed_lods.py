"""Levels as vertices and indices: the same triangles, each with its image on its last vertex, vertices shared."""

import numpy as np
import pytest

from depthwalk.cook import indexed_lods
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.indexed_lods import index_levels
from depthwalk.cook.lod_geometry import POSITION_STEPS, LodGeometry
from depthwalk.cook.view_selection import NOWHERE
from depthwalk.types import Array, Ints, Rows
from shapes import bake, sphere


@pytest.fixture(scope="module")
def grid() -> LodGeometry:
    return build_grid_lods(bake(sphere(columns=32, rows=16), 32, 1))


@pytest.fixture
def level(grid: LodGeometry) -> tuple[Array, Ints]:
    """A strip of triangles on the lattice of positions; neighbours look into different images in two halves."""
    steps = np.stack([np.arange(42) // 2 * 3000, np.arange(42) % 2 * 3000, 0 * np.arange(42)], -1)
    corners = np.stack([steps[:-2], steps[1:-1], steps[2:]], 1)
    views = np.where(np.arange(40) < 20, 8, 9)
    return grid.box_low + corners * (grid.box_size / POSITION_STEPS).astype(np.float64), views


def rows(corners: Rows) -> list[tuple[tuple[int, ...], ...]]:
    """Triangles as sorted rows of whole steps, in an order of their own."""
    return sorted(tuple(sorted(map(tuple, corner))) for corner in corners.tolist())


@pytest.mark.parametrize("most_vertices", [1 << 16, 12])
def test_triangles_stay_and_know_their_images(
    grid: LodGeometry, level: tuple[Array, Ints], most_vertices: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(indexed_lods, "MOST_VERTICES", most_vertices)
    corners, views = level
    found = index_levels(grid, [corners, corners[:5]], np.concatenate([views, views[:5]]), np.array([0.0, 0.1]))
    drawn = found.drawn(0)
    place = np.round((corners - grid.box_low) / grid.box_size * POSITION_STEPS).astype(int)
    assert rows(found.vertices[drawn][..., :3]) == rows(place)
    for image in 8, 9:
        chosen = found.vertices[drawn[:, 2], 3] == image
        assert rows(found.vertices[drawn[chosen]][..., :3]) == rows(place[views == image])
    assert len(found.drawn(1)) == 5 and found.error.tolist() == [0.0, 0.1]
    assert (len(found.chunks) > 2) == (most_vertices == 12)


def test_vertices_are_shared(grid: LodGeometry, level: tuple[Array, Ints]) -> None:
    found = index_levels(grid, [level[0]], level[1], np.zeros(1))
    assert len(found.vertices) <= 42 + 3


def test_triangles_that_look_nowhere_are_left_out(grid: LodGeometry, level: tuple[Array, Ints]) -> None:
    corners, views = level
    found = index_levels(grid, [corners], np.where(views == 9, NOWHERE, views), np.zeros(1))
    assert len(found.drawn(0)) == 20
