"""Vertices that are nearly in one place become one."""

import numpy as np

from depthwalk.cook.vertex_clustering import cluster_vertices

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def test_what_is_farther_apart_than_a_voxel_stays() -> None:
    point, triangles = cluster_vertices(SQUARE, TRIANGLES, np.zeros(4, int), 0.1)
    assert sorted(map(tuple, point)) == sorted(map(tuple, SQUARE))
    assert sorted(map(tuple, np.sort(triangles, 1))) == [(0, 1, 3), (0, 2, 3)]


def test_of_copies_that_of_the_lowest_rank_is_kept() -> None:
    copies = np.concatenate([SQUARE, SQUARE + 1e-6])
    rank = np.repeat([1, 0], 4)
    point, triangles = cluster_vertices(copies, np.concatenate([TRIANGLES, TRIANGLES + 4]), rank, 0.1)
    assert len(triangles) == 2 and (point[:, 2] == 1e-6).all()


def test_the_two_sides_of_a_leaf_stay_apart() -> None:
    both = np.concatenate([SQUARE, SQUARE - (0, 0, 1e-6)])
    triangles = np.concatenate([TRIANGLES, TRIANGLES[:, ::-1] + 4])
    point, left = cluster_vertices(both, triangles, np.zeros(8, int), 0.1)
    assert len(point) == 8 and len(left) == 4


def test_triangles_within_a_voxel_vanish() -> None:
    point, triangles = cluster_vertices(0.01 * SQUARE, TRIANGLES, np.zeros(4, int), 0.1)
    assert len(point) == 0 and len(triangles) == 0
