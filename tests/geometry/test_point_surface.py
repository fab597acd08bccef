"""The surface through the points of a scan, compared with surfaces that are known."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from depthwalk.geometry.point_surface import point_surface

RANDOM = np.random.default_rng(5)


def found(point: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    return point_surface(point, np.full_like(point, np.nan))


def sphere(count: int) -> NDArray[np.float64]:
    """Return points (count, 3) spread evenly over the unit sphere (a Fibonacci lattice)."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (1 + np.sqrt(5)) * np.arange(count)
    return np.column_stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z])


def edge_uses(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many triangles each edge has."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0, return_counts=True)[1]


def areas(point: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    a, b, c = (point[corner] for corner in triangles.T)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def test_a_sphere_is_closed_and_faces_outward() -> None:
    point = sphere(1000)
    triangles, normal = found(point)
    assert len(triangles) == 2 * len(point) - 4 and (edge_uses(triangles) == 2).all()  # Euler
    a, b, c = (point[corner] for corner in triangles.T)
    assert (np.einsum("td,td->t", np.cross(b - a, c - a), a) > 0).all()
    assert (np.einsum("nd,nd->n", normal, point) > 0.98).all()
    assert areas(point, triangles).sum() == pytest.approx(4 * np.pi, rel=0.01)


def test_each_of_several_pieces_faces_outward() -> None:
    ball = sphere(300)
    point = np.concatenate([ball, 0.4 * ball + [3, 0, 0], ball + np.array([0, 9, 0])])
    middle = np.repeat([[0, 0, 0], [3, 0, 0], [0, 9, 0]], 300, axis=0)
    normal = found(point)[1]
    assert (np.einsum("nd,nd->n", normal, point - middle) > 0).all()


def test_a_plane_has_the_triangles_of_delaunay() -> None:
    flat = RANDOM.random((600, 2))
    triangles, normal = found(np.column_stack([flat, np.zeros(600)]))
    wanted = np.sort(Delaunay(flat).simplices, axis=1)
    middle = flat[wanted].mean(axis=1)
    inner = wanted[((middle > 0.15) & (middle < 0.85)).all(axis=1)]  # the rim of the hull has long triangles
    got = set(map(tuple, np.sort(triangles, axis=1).tolist()))
    share = np.mean([tuple(triangle) in got for triangle in inner.tolist()])
    assert share > 0.99
    assert (np.abs(normal[:, 2]) > 0.999).all()


@pytest.mark.parametrize(("height", "most"), [(0.0, 0), (0.2, 20)])
def test_a_grid_is_covered_once(height: float, most: int) -> None:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(20.0), np.arange(15.0)))
    triangles, _ = found(np.column_stack([x, y, height * np.sin(x / 3)]))
    assert 0 <= len(triangles) - 2 * 19 * 14 <= most
    assert (edge_uses(triangles) > 2).sum() <= most


def test_noise_leaves_hardly_any_holes() -> None:
    flat = 10 * RANDOM.random((4000, 2))
    point = np.column_stack([flat, 0.03 * RANDOM.normal(size=4000)])
    triangles, _ = found(point)
    probe = 1 + 8 * RANDOM.random((2000, 2))
    a, b, c = (flat[corner] for corner in triangles.T)
    u, v, w = b - a, c - a, probe[:, None] - a
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    s = (w[..., 0] * v[:, 1] - w[..., 1] * v[:, 0]) / area
    t = (u[:, 0] * w[..., 1] - u[:, 1] * w[..., 0]) / area
    covered = ((s >= 0) & (t >= 0) & (s + t <= 1)).any(axis=1)
    assert covered.mean() > 0.995


def test_normals_that_are_given_stay_and_turn_the_triangles() -> None:
    point = sphere(200)
    triangles, normal = point_surface(point, -point)
    np.testing.assert_array_equal(normal, -point)
    a, b, c = (point[corner] for corner in triangles.T)
    assert (np.einsum("td,td->t", np.cross(b - a, c - a), a) < 0).all()


def test_a_point_beside_the_surface_is_left_out() -> None:
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0))
    point = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    triangles, _ = found(np.concatenate([point, [[10.2, 9.6, 30.0]]]))
    assert triangles.max() < len(point)


@pytest.mark.parametrize("count", [3, 4, 7, 200])
def test_points_on_a_line_have_no_surface(count: int) -> None:
    triangles, normal = found(np.arange(count)[:, None] * np.array([1.0, 2.0, 3.0]))
    assert not areas(np.arange(count)[:, None] * np.array([1.0, 2.0, 3.0]), triangles).any()
    assert np.isfinite(normal).all()


def test_three_points_make_a_triangle() -> None:
    triangles, _ = found(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]))
    assert np.sort(triangles).tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_units_do_not_matter(scale: float) -> None:
    point = sphere(300)
    np.testing.assert_array_equal(found(point * scale)[0], found(point)[0])
