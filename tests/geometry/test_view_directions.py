"""The octahedral map and the axes of captured views."""

import numpy as np
import pytest

from depthwalk.geometry.triangles import spread_directions
from depthwalk.geometry.view_directions import (
    azimuth_directions,
    direction_from_square,
    octahedral_directions,
    square_from_direction,
    view_axes,
)


@pytest.mark.parametrize("hemisphere", [False, True])
def test_the_square_and_its_inverse(hemisphere: bool) -> None:
    direction = spread_directions(500)
    kept = direction[direction[:, 1] > 0] if hemisphere else direction
    square = square_from_direction(kept, hemisphere)
    assert np.abs(square).max() <= 1
    np.testing.assert_allclose(direction_from_square(square, hemisphere), kept, atol=1e-6)


def test_directions_below_the_horizon_are_raised_to_it() -> None:
    below, level = np.array([[0.6, -0.7, 0.2]]), np.array([[0.6, 0.0, 0.2]])
    np.testing.assert_allclose(square_from_direction(below, True), square_from_direction(level, True))


@pytest.mark.parametrize("hemisphere", [False, True])
def test_a_grid_leaves_no_gap(hemisphere: bool) -> None:
    """Of 144 views the nearest is never farther than that."""
    views, asked = octahedral_directions(12, hemisphere), spread_directions(2000)
    asked = asked[asked[:, 1] > 0] if hemisphere else asked
    widest = np.degrees(np.arccos((asked @ views.T).max(1).min()))
    assert widest < (12 if hemisphere else 14)


def test_axes_are_those_of_a_right_handed_picture() -> None:
    direction = np.concatenate([spread_directions(50), [[0, 1, 0], [0, -1, 0]], azimuth_directions(8)])
    axes = view_axes(direction)
    np.testing.assert_allclose(axes @ axes.swapaxes(1, 2), np.broadcast_to(np.eye(3), axes.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(axes), 1)
    assert (axes[:, 0, 1] == 0).all() and (axes[:-10, 1, 1] > 0).all()
    np.testing.assert_allclose(axes[:, 2], direction)


def test_azimuths_begin_in_front() -> None:
    np.testing.assert_allclose(azimuth_directions(4), [[0, 0, 1], [1, 0, 0], [0, 0, -1], [-1, 0, 0]], atol=1e-12)
