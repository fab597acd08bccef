"""Edges of meshes: their faces, folds, and how much silhouette to expect."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from depthwalk.geometry.adjacency import build_adjacency, connected_groups
from shapes import box


def test_a_box_has_eighteen_edges_six_of_them_flat() -> None:
    mesh = box(1, 2, 3)
    edges = build_adjacency(mesh.positions, mesh.faces)
    assert len(edges.ends) == 18 and not edges.open.any()
    assert sorted(np.round(edges.folds, 6).tolist()) == [0] * 12 + [1] * 6


def test_the_rim_of_a_square_is_open() -> None:
    edges = build_adjacency(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    assert len(edges.ends) == 5 and edges.open.sum() == 4
    assert (edges.planes[-1] == 0).all() and (edges.planes[:-1, :3] == [0, 0, 1]).all()


def test_vertices_in_one_place_are_one_and_slivers_between_them_vanish() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)
    edges = build_adjacency(points, np.array([[0, 1, 2], [4, 3, 5], [1, 3, 2]]))
    assert len(edges.points) == 4 and len(edges.planes) == 3 and edges.open.sum() == 4


def test_the_silhouette_of_a_box_is_as_long_as_expected() -> None:
    """By Cauchy, a convex body's silhouette is π times its mean width on average, half the sum of a box's sides,
    and it covers a quarter of its surface."""
    mesh = box(2, 2, 2)
    assert build_adjacency(mesh.positions, mesh.faces).density == pytest.approx(np.pi * (2 + 2 + 2) / 2 / (24 / 4))


@pytest.mark.parametrize(("count", "links"), [(1, 0), (5, 3), (100, 40), (100, 120), (3000, 2900), (3000, 6000)])
def test_groups_are_those_of_scipy(count: int, links: int) -> None:
    one, other = np.random.default_rng(count + links).integers(0, count, (2, links))
    graph = coo_array((np.ones(links, bool), (one, other)), shape=(count, count))
    expected = connected_components(graph, directed=False)[1]
    np.testing.assert_array_equal(connected_groups(count, one, other), expected)


def test_long_chains_are_one_group() -> None:
    """However their members are numbered: a vertex may have thousands of faces."""
    for order in (np.arange(5000), np.random.default_rng(0).permutation(5000)):
        assert not connected_groups(5000, order[1:], order[:-1]).any()
