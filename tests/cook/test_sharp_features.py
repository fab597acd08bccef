"""Facets: the planes of samples, which triangles across a ridge do not tell."""

import numpy as np
import pytest
import trimesh

from depthwalk.cook.edge_collapse import collapse_edges
from depthwalk.cook.quadrics import clustered_surface
from depthwalk.cook.sharp_features import find_sharp_features
from depthwalk.types import Array, Ints

SLOPE = 0.2


def roof(columns: int = 20, rows: int = 40) -> tuple[Array, Ints, Ints]:
    """A roof along y, its ridge, x = z = 0, between two columns of samples, and those within it by a row and more."""
    x, y = np.meshgrid(np.arange(columns) - columns / 2 + 1 / 3, np.arange(rows))
    number = np.arange(columns * rows).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return np.stack([x.ravel(), y.ravel(), -SLOPE * np.abs(x.ravel())], -1), triangles, number[1:-1].ravel()


def test_samples_beside_a_ridge_know_their_side_of_the_roof() -> None:
    point, triangles, within = roof()
    side = np.column_stack([SLOPE * np.sign(point[:, 0]), 0 * point[:, 0], 1 + 0 * point[:, 0]])
    normal = find_sharp_features(point, triangles).normal
    assert normal[within] == pytest.approx(side[within] / np.hypot(SLOPE, 1), abs=1e-9)


def test_vertices_are_drawn_into_the_ridge() -> None:
    point, triangles, _ = roof()
    cut_off = -point[:, 2].max()
    without, known = (
        -collapse_edges(clustered_surface(point, triangles, facets), 0.35).point[:, 2].max()
        for facets in (None, find_sharp_features(point, triangles))
    )
    assert without > 0.9 * cut_off and 0 <= known < 0.4 * cut_off


def test_facets_of_a_ball_are_nearly_its_tangents() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4)
    point = np.asarray(ball.vertices)
    facets = find_sharp_features(point, np.asarray(ball.faces, np.int64))
    assert np.einsum("ij,ij->i", facets.normal, point).min() > np.cos(np.radians(4))
