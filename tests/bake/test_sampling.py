"""Points spread over a surface; what footprints of a bake are is tested in test_axis.py."""

import numpy as np
import pytest

from depthwalk.bake.sampling import sample_surface, squared_texels
from depthwalk.geometry.triangles import face_normals, sample_triangles
from shapes import box, sphere


def test_points_lie_on_the_surface_by_area() -> None:
    mesh = box(2.0, 1.0, 1.0, (0, 0.5, 0))
    point, normal = sample_surface(mesh, 5000)
    assert (np.abs(np.abs((point - [0, 0.5, 0]) / [1, 0.5, 0.5]).max(1) - 1) < 1e-6).all()
    share = np.abs(normal).mean(0)  # of faces across x, y and z, whose areas are as 1 : 2 : 2
    np.testing.assert_allclose(share, [0.2, 0.4, 0.4], atol=0.01)


def test_points_are_the_same_each_time() -> None:
    mesh = sphere(columns=16, rows=8)
    for once, again in zip(sample_surface(mesh, 100), sample_surface(mesh, 100), strict=True):
        np.testing.assert_array_equal(once, again)


def test_points_are_spread_evenly_over_one_triangle() -> None:
    corners = np.array([[[0, 0, 0], [1.0, 0, 0], [0, 1.0, 0]]])
    point, normal = sample_triangles(corners, 4000)
    assert (point >= 0).all() and (point.sum(1) <= 1 + 1e-12).all()
    np.testing.assert_allclose(point.mean(0), [1 / 3, 1 / 3, 0], atol=0.02)
    assert ((point[:, 0] + point[:, 1] > 0.5**0.5).mean()) == pytest.approx(0.5, abs=0.03)
    np.testing.assert_array_equal(normal, np.tile([0, 0, 1.0], (4000, 1)))


def test_normals_and_areas_of_triangles() -> None:
    corners = np.array([[[0, 0, 0], [2.0, 0, 0], [0, 0, -3.0]], [[1.0, 1, 1]] * 3])
    normal, area = face_normals(corners)
    np.testing.assert_allclose(normal, [[0, 1, 0], [0, 0, 0]])  # one has no area, so none
    np.testing.assert_allclose(area, [3, 0])


def test_what_no_image_holds_counts_as_a_large_footprint() -> None:
    np.testing.assert_allclose(squared_texels(np.array([0.1, 0.4, np.inf]), 0.2), [0.25, 4, 256])
