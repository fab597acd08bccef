"""The lens as geometry: its points, its views and its circles of confusion. The blur itself is in test_dof.py."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyglm import glm

from depthwalk.render.view.lens import (
    DISC,
    circle_radius,
    gaussian,
    largest_radius,
    lens_points,
    lens_radius,
    lens_views,
)
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.effect_settings import DofParams
from depthwalk.types import Array

VIEW = View(Camera((3.0, 2.0, 5.0), (0.0, 1.0, 0.0), 0.8), (300, 200), 0.1, 100.0)
focus = st.floats(0.5, 100)
screen = st.floats(-1, 1)


def accumulated(focus_distance: float, samples: int = 9) -> DofParams:
    return DofParams.model_validate(
        {
            "mode": "accumulate",
            "focal_length": 400,
            "f_number": 1.4,
            "focus_distance": focus_distance,
            "samples": samples,
        }
    )


def on_screen(view: View, point: glm.dvec3) -> Array:
    clip = view.clip_from_view * view.view_from_world * glm.dvec4(*point, 1)
    return np.array([clip.x, clip.y]) / clip.w


@given(focus, screen, screen)
def test_what_is_in_focus_stays_in_its_place(focus_distance: float, x: float, y: float) -> None:
    seen = VIEW.unproject((1 + x) / 2, (1 - y) / 2, focus_distance)
    for view in lens_views(VIEW, accumulated(focus_distance)):
        np.testing.assert_allclose(on_screen(view, seen), (x, y), atol=1e-9)


@given(focus, st.floats(0.5, 100))
def test_what_is_out_of_focus_is_spread_over_its_circle_of_confusion(focus_distance: float, distance: float) -> None:
    lens = accumulated(focus_distance)
    seen = VIEW.unproject(0.5, 0.5, distance)
    places = np.array([on_screen(view, seen) for view in lens_views(VIEW, lens)]) * VIEW.size / 2
    radius = abs(circle_radius(lens, VIEW, np.array(distance)))
    assert np.hypot(*places.T).max() == pytest.approx(radius, abs=1e-6)  # one is on the rim


@pytest.mark.gl
@given(focus)
def test_views_keep_their_direction_and_end_in_the_middle(focus_distance: float) -> None:
    lens = accumulated(focus_distance)
    *aside, middle = lens_views(VIEW, lens)
    assert middle == VIEW and len(aside) == 8
    for view in aside:
        assert view.camera.look.to_tuple() == pytest.approx(VIEW.camera.look.to_tuple(), abs=1e-12)
        offset = view.position - VIEW.position
        assert np.linalg.norm(offset) <= lens_radius(lens) * (1 + 1e-9)
        assert offset @ VIEW.axes[2] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("mode", ["none", "paper", "gather"])
def test_other_modes_have_one_view(mode: str) -> None:
    assert list(lens_views(VIEW, DofParams.model_validate({"mode": mode}))) == [VIEW]


@given(st.integers(2, 500))
def test_points_cover_the_unit_disc_evenly(count: int) -> None:
    radius = np.hypot(*lens_points(count).T)
    assert radius[0] == pytest.approx(1) and radius[-1] == 0
    np.testing.assert_allclose(radius**2, np.linspace(1, 0, count), atol=1e-12)  # as many per area


def test_points_of_the_disc_keep_apart() -> None:
    points = np.array(DISC)
    apart = np.linalg.norm(points[:, None] - points, axis=-1) + 9 * np.eye(len(points))
    assert apart.min() > 0.44 and np.hypot(*points.T).max() <= 1.001


def test_blur_is_none_in_focus_negative_before_it_and_bounded_behind() -> None:
    lens = DofParams.model_validate({"focus_distance": 5.0})
    near, sharp, far, infinite = circle_radius(lens, VIEW, np.array([1.0, 5.0, 50.0, np.inf]))
    assert near < 0 == sharp < far < infinite == pytest.approx(lens_radius(lens) * VIEW.focal_pixels / 5)
    assert largest_radius(DofParams.model_validate({"max_blur": 10.0}), VIEW) == pytest.approx(
        10
    )  # half of a tenth of 200 pixels


def test_a_gaussian_blurs_without_darkening() -> None:
    weights = gaussian()
    assert weights[0] + 2 * weights[1:].sum() == pytest.approx(1)
    assert (np.diff(weights) < 0).all() and weights[3] / weights[0] == pytest.approx(np.exp(-0.5))
