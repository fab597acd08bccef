"""Triangles that share vertices: copies, unused vertices, boundary edges."""

from collections.abc import Sequence

import numpy as np
import pytest

from depthwalk.geometry.indexed_triangles import (
    any_corner,
    distinct_triangles,
    drop_unused,
    normals_and_areas,
    open_edges,
    opposite_edges,
    vertex_directions,
)

SQUARE = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], float)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def test_normals_and_areas() -> None:
    normal, area = normals_and_areas(SQUARE, TRIANGLES)
    assert (normal == [0, 0, 1]).all() and area.tolist() == [2, 2]


def test_a_vertex_faces_as_its_triangles_do() -> None:
    assert vertex_directions(SQUARE, TRIANGLES)[:, 2].tolist() == [8, 4, 8, 4]


def test_the_diagonal_is_no_boundary() -> None:
    start, end, outward = open_edges(SQUARE, TRIANGLES, normals_and_areas(SQUARE, TRIANGLES)[0])
    assert sorted(zip(start.tolist(), end.tolist(), strict=True)) == [(0, 1), (1, 2), (2, 3), (3, 0)]
    middle = (SQUARE[start] + SQUARE[end]) / 2
    np.testing.assert_allclose(outward, 2 * (middle - [1, 1, 0]))


def test_both_sides_of_a_leaf_have_one_boundary_less() -> None:
    """An edge is no boundary where some triangle runs the other way."""
    both = np.concatenate([TRIANGLES, TRIANGLES[:, ::-1]])
    assert len(open_edges(SQUARE, both, normals_and_areas(SQUARE, both)[0])[0]) == 0


def test_random_boundaries_are_those_that_sets_find() -> None:
    rng = np.random.default_rng(1)
    triangles = distinct_triangles(rng.integers(0, 12, (60, 3)))
    point = rng.normal(size=(12, 3))
    directed = [(a, b) for row in triangles.tolist() for a, b in zip(row, row[1:] + row[:1], strict=True)]
    expected = [(a, b) for a, b in directed if (b, a) not in set(directed)]
    start, end, _ = open_edges(point, triangles, normals_and_areas(point, triangles)[0])
    assert list(zip(start.tolist(), end.tolist(), strict=True)) == expected and expected


def test_copies_however_turned_are_one_and_mirrored_ones_are_not() -> None:
    triangles = np.array([[5, 2, 9], [9, 5, 2], [2, 9, 5], [2, 5, 9], [1, 1, 3], [4, 7, 4]])
    assert distinct_triangles(triangles).tolist() == [[2, 5, 9], [2, 9, 5]]


def test_copies_are_found_among_more_vertices_than_a_key_holds() -> None:
    """Three numbers of more than 21 bits do not fit into 64: the triangles of a large tree connected anything."""
    triangles = np.random.default_rng(3).integers(0, 9, (200, 3))
    many = 1 << 21
    assert np.array_equal(distinct_triangles(triangles + many), distinct_triangles(triangles) + many)
    mixed = np.where(triangles == 4, 4, triangles + many)  # 4 stays the smallest in its place or becomes it
    expected = {tuple(np.roll(row, -int(np.argmin(row)))) for row in mixed.tolist() if len(set(row)) == 3}
    assert list(map(tuple, distinct_triangles(mixed).tolist())) == sorted(expected)


@pytest.mark.parametrize(("vertices", "expected"), [([0], [True, True]), ([1], [True, False]), ([], [False, False])])
def test_triangles_with_any_of_some_vertices(vertices: Sequence[int], expected: Sequence[bool]) -> None:
    assert any_corner(np.isin(np.arange(4), vertices), TRIANGLES).tolist() == expected


def test_unused_vertices_are_dropped() -> None:
    used, triangles = drop_unused(np.array([[7, 3, 5]]), 9)
    assert used.tolist() == [3, 5, 7] and triangles.tolist() == [[2, 0, 1]]


@pytest.mark.parametrize("vertices", [4, 12, 40])
def test_opposite_edges_run_between_the_same_vertices(vertices: int) -> None:
    """Also where several triangles share an edge: of these it is the first."""
    triangles = distinct_triangles(np.random.default_rng(2).integers(0, vertices, (60, 3)))
    directed = [(a, b) for row in triangles.tolist() for a, b in zip(row, row[1:] + row[:1], strict=True)]
    expected = [directed.index((b, a)) if (b, a) in directed else -1 for a, b in directed]
    assert opposite_edges(triangles).tolist() == expected


def test_nothing_has_no_opposite_edges() -> None:
    assert opposite_edges(np.zeros((0, 3), np.int64)).shape == (0,)
