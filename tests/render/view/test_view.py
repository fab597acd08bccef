"""What a view's matrices, rays and distances say of points in the world."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyglm import glm

from depthwalk.render.view.view import View, matrix_array, view_distance
from depthwalk.scene.arrays import Camera

coordinate = st.floats(-1000, 1000)
point = st.tuples(coordinate, coordinate, coordinate)
part = st.floats(0, 1)


@st.composite
def views(draw: Callable[..., Any]) -> View:
    """A view from anywhere, sheared or not, in any direction that is not vertical."""
    yaw, pitch, distance = draw(st.floats(-7, 7)), draw(st.floats(-1.5, 1.5)), draw(st.floats(0.01, 100))
    position = draw(point)
    target = glm.dvec3(*position) - glm.euclidean(glm.dvec2(pitch, yaw)) * distance
    shear = draw(st.one_of(st.just((0.0, 0.0)), st.tuples(st.floats(-1, 1), st.floats(-1, 1))))
    size = draw(st.tuples(st.integers(1, 4000), st.integers(1, 4000)))
    return View(Camera(position, target.to_tuple(), draw(st.floats(0.1, 2.5))), size, 0.1, 500.0, shear)


def project(view: View, seen: glm.dvec3) -> tuple[float, float, float]:
    """Where the picture shows a point: parts of its width and height from the upper left corner, and the distance."""
    clip = view.clip_from_view * view.view_from_world * glm.dvec4(*seen, 1)
    return (1 + clip.x / clip.w) / 2, (1 - clip.y / clip.w) / 2, clip.w


@given(views(), part, part, st.floats(0.1, 500))
def test_a_point_is_shown_where_it_was_unprojected_from(
    view: View, across: float, down: float, distance: float
) -> None:
    assert project(view, view.unproject(across, down, distance)) == pytest.approx((across, down, distance), abs=1e-7)


@given(views(), part, part, st.floats(0.1, 500))
def test_unprojecting_undoes_projecting(view: View, across: float, down: float, distance: float) -> None:
    seen = view.unproject(across, down, distance)
    assert glm.distance(view.unproject(*project(view, seen)), seen) < 1e-6


@given(views(), part, part, st.floats(0.2, 400))
def test_the_window_of_opengl_shows_the_same_point(view: View, across: float, down: float, distance: float) -> None:
    seen = view.unproject(across, down, distance)
    window = glm.project(seen, view.view_from_world, view.clip_from_view, glm.dvec4(0, 0, *view.size))
    assert window.xy.to_tuple() == pytest.approx((across * view.size[0], (1 - down) * view.size[1]), abs=1e-3)
    along = view_distance(np.array([window.z], np.float64), *view.depth_range)
    assert along[0] == pytest.approx(distance, rel=1e-5)


@given(views(), point)
def test_world_vectors_from_the_viewer_project_as_points_do(view: View, seen: tuple[float, float, float]) -> None:
    whole = view.clip_from_view * view.view_from_world * glm.dvec4(*seen, 1)
    from_eye = view.clip_from_eye * glm.dvec4(*np.subtract(seen, view.position), 1)
    np.testing.assert_allclose(from_eye, whole, atol=1e-7)


@given(views(), point)
def test_axes_give_view_coordinates_with_the_distance_positive(view: View, seen: tuple[float, float, float]) -> None:
    x, y, z, _ = view.view_from_world * glm.dvec4(*seen, 1)
    np.testing.assert_allclose(view.axes @ np.subtract(seen, view.position), (x, y, -z), atol=1e-8)


@given(views())
def test_without_shear_the_axes_are_orthonormal_and_the_target_is_ahead(view: View) -> None:
    view = replace(view, shear=(0.0, 0.0))
    np.testing.assert_allclose(view.axes @ view.axes.T, np.eye(3), atol=1e-12)
    ahead = glm.length(view.camera.look)
    np.testing.assert_allclose(view.axes @ view.camera.look, (0, 0, ahead), atol=1e-9 * (1 + ahead))
    assert view.axes[1, 1] > 0  # up is up


@given(views(), st.floats(0.1, 500))
def test_shear_moves_what_is_ahead_by_its_distance(view: View, distance: float) -> None:
    straight = replace(view, shear=(0.0, 0.0))
    ahead = view.position + distance * straight.axes[2]
    right, up = view.shear
    np.testing.assert_allclose(
        view.axes @ (ahead - view.position), (right * distance, up * distance, distance), atol=1e-7
    )


def test_a_camera_keeps_double_precision() -> None:
    """PyGLM would round tuples to single precision, 4 cm at this distance from the origin."""
    camera = Camera((600_000.01, 0.1, -600_000.02), (600_000.11, 0.1, -600_000.02), 1.0)
    view = View(camera, (100, 100))
    assert camera.look.x == 600_000.11 - 600_000.01
    assert camera.moved(glm.dvec3(0.1, 0, 0)).position == (600_000.01 + 0.1, 0.1, -600_000.02)
    np.testing.assert_allclose(view.view_from_world * glm.dvec4(*camera.position, 1), (0, 0, 0, 1), atol=1e-9)
    assert view.unproject(0.5, 0.5, 0.1).to_tuple() == pytest.approx(camera.target, rel=1e-15)


def test_a_metre_at_a_metre_covers_the_focal_length() -> None:
    view = View(Camera((0, 0, 0), (0, 0, -1), math.radians(90)), (400, 200))
    assert view.half_extent == pytest.approx((2, 1)) and view.focal_pixels == pytest.approx(100)


def test_a_view_without_planes_says_so() -> None:
    with pytest.raises(ValueError, match="not fitted"):
        _ = View(Camera((0, 0, 0), (0, 0, -1), 1.0), (4, 2), near=0.1).clip_from_eye


def test_fitting_planes_keeps_what_is_computed_and_changes_nothing_else() -> None:
    camera = Camera((1.0, 2.0, 3.0), (0.0, 1.0, -9.0), 1.0)
    plain = View(camera, (320, 200), shear=(0.1, 0.2), scale=0.5)
    axes = plain.axes
    fitted = plain.fitted(0.5, 80.0)
    assert fitted.axes is axes
    assert fitted == View(camera, (320, 200), 0.5, 80.0, (0.1, 0.2), 0.5) != plain
    assert fitted.clip_from_eye == replace(plain, near=0.5, far=80.0).clip_from_eye
    assert (plain.near, plain.far) == (None, None)


@pytest.mark.parametrize("size", [3, 4])
def test_a_matrix_becomes_an_array(size: int) -> None:
    matrix = {3: glm.dmat3, 4: glm.dmat4}[size](*range(size**2))  # column by column
    array = matrix_array(matrix)
    np.testing.assert_array_equal(array, np.arange(size**2).reshape(size, size).T)
    assert type(matrix)(array) == matrix


def test_nothing_is_infinitely_far() -> None:
    found = view_distance(np.array([0, 1], np.float32), 0.5, 20.0)
    assert found.dtype == np.float32 and found.tolist() == [0.5, math.inf]
