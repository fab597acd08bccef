"""Quadrics: squared distances from planes, and the points where they are least."""

import numpy as np
import pytest

from depthwalk.cook.quadrics import ClusteredSurface, clustered_surface, optimal_points, squared_distances
from depthwalk.cook.sharp_features import SharpFeatures

# The corner of a box at the origin, its three faces away from it.
CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
FACES = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 3]])


@pytest.fixture
def corner() -> ClusteredSurface:
    return clustered_surface(CORNER, FACES)


def test_the_quadric_of_a_corner_is_the_distance_from_its_faces(corner: ClusteredSurface) -> None:
    assert corner.area == pytest.approx(1.5) and corner.weight[0] == pytest.approx(1.5)
    points = np.random.default_rng(1).normal(size=(9, 3))
    expected = 0.5 * (points**2).sum(1)
    columns = np.repeat(corner.quadric[:1], 9, 0).T
    np.testing.assert_allclose(squared_distances(columns, points), expected, atol=1e-12)


def test_the_optimal_point_is_the_corner_wherever_the_spring_is(corner: ClusteredSurface) -> None:
    middle = np.array([[0.3, 0.2, 0.9]])
    found = optimal_points(corner.quadric[:1].T, np.array([1e-9]), middle)
    np.testing.assert_allclose(found, [[0, 0, 0]], atol=1e-6)
    held = optimal_points(corner.quadric[:1].T, np.array([1e9]), middle)
    np.testing.assert_allclose(held, middle, atol=1e-6)


def test_the_boundary_is_held_by_planes_perpendicular_to_it() -> None:
    """Of a square in z = 0: its corners stay where they are, though the square's plane leaves them free."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    surface = clustered_surface(square, np.array([[0, 1, 2], [0, 2, 3]]))
    found = optimal_points(surface.quadric.T, np.full(4, 1e-9), square + 0.1)
    np.testing.assert_allclose(found, square, atol=1e-6)


def test_the_boundary_counts_more_where_a_surface_ends() -> None:
    """One edge of a square is an end: moved out of it, its vertices cost four times as much."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    faces, ends = np.array([[0, 1, 2], [0, 2, 3]]), np.array([True, True, False, False])
    loose, firm = clustered_surface(square, faces), clustered_surface(square, faces, at_end=ends)
    off = square - (0, 0.1, 0)
    costs = [squared_distances(surface.quadric.T, off) for surface in (loose, firm)]
    np.testing.assert_allclose(costs[1] / costs[0], [4, 4, 1, 1], rtol=1e-6)


def test_features_count_for_one_half(corner: ClusteredSurface) -> None:
    """Here all are planes of constant z, through the four vertices: three at z = 0, one at 1."""
    mixed = clustered_surface(CORNER, FACES, SharpFeatures(CORNER, np.tile([0.0, 0, 1], (4, 1))))
    of_planes, of_both = (
        squared_distances(surface.quadric[:1].T, np.array([[0.0, 0, 2]]))[0] for surface in (corner, mixed)
    )
    level, upright = 0.5 * 2**2, 2 * 0.5 * (2 * 2**2 + 1**2) / 3
    assert of_planes == pytest.approx(level) and of_both == pytest.approx((of_planes + level + upright) / 2)
