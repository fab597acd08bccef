"""Views that see more, or in fewer pixels, and what lies within them."""

import numpy as np
import pytest

from depthwalk.render.view.field_of_view import reduced, shows, spread_rays, widened
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera

VIEW = View(Camera((1.0, 2.0, 3.0), (4.0, 1.0, -2.0), 0.9), (160, 120))


def test_rays_are_spread_over_the_picture_and_one_metre_long_along_its_axis() -> None:
    seen = spread_rays(VIEW, 4, 3) @ VIEW.axes.T
    assert np.allclose(seen[:, 2], 1) and shows(VIEW, seen).all()
    places = (seen[:, :2] / VIEW.half_extent).reshape(3, 4, 2)
    assert np.allclose(places[0, :, 0], [-0.75, -0.25, 0.25, 0.75])
    assert np.allclose(places[:, 0, 1], [-2 / 3, 0, 2 / 3])


def test_what_is_beyond_the_edges_or_behind_is_not_shown() -> None:
    right, up = VIEW.half_extent
    points = np.array([[0.99 * right, 0, 1], [1.05 * right, 0, 1], [0, -1.05 * up, 1], [0, 0, -1]])
    assert shows(VIEW, points).tolist() == [True, False, False, False]
    assert shows(VIEW, points, 1.1).tolist() == [True, True, True, False]


def test_fewer_pixels_show_as_much_in_as_fine_objects() -> None:
    small = reduced(VIEW, 0.5)
    assert small.size == (80, 60) and small.half_extent == pytest.approx(VIEW.half_extent)
    assert small.detail_pixels == pytest.approx(VIEW.detail_pixels)
    assert reduced(VIEW, 1e-9).size == (1, 1)


def test_a_wider_picture_has_the_same_pixels_in_its_middle() -> None:
    wide = widened(VIEW, 0.1)
    assert wide.size == (192, 128) and wide.focal_pixels == pytest.approx(VIEW.focal_pixels)
    assert widened(VIEW, 0.0).size == VIEW.size
