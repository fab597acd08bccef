"""The area that a line cuts off a pixel, against polygons and counted points."""

import numpy as np
import pytest

from depthwalk.reference.gpaa import part_beyond


def test_lines_along_the_axes_cut_what_is_left_of_half_a_pixel() -> None:
    ends = np.array([[-5.0, 0.2, 5.0, 0.2], [0.3, -5.0, 0.3, 5.0], [-5.0, 0.8, 5.0, 0.8]])
    assert part_beyond(ends, np.zeros((3, 2))) == pytest.approx([0.3, 0.2, 0.0])


def test_a_diagonal_through_the_middle_halves_the_pixel_and_one_past_it_cuts_a_corner() -> None:
    ends = np.array([[-5.0, -5, 5, 5], [-5.0, -4.5, 5, 5.5], [-5.0, -4.0, 5, 6.0]])
    assert part_beyond(ends, np.zeros((3, 2))) == pytest.approx([0.5, 1 / 8, 0.0])


def test_areas_are_what_points_within_the_pixel_count() -> None:
    rng = np.random.default_rng(4)
    angle, offset = rng.uniform(0, 2 * np.pi, 200), rng.uniform(-0.7, 0.7, 200)
    middle = rng.uniform(-20, 20, (200, 2))
    along = np.stack([np.cos(angle), np.sin(angle)], -1)
    across = np.stack([-along[:, 1], along[:, 0]], -1)
    foot = middle + offset[:, None] * across
    found = part_beyond(np.hstack([foot - 9 * along, foot + 9 * along]), middle)
    steps = (np.arange(200) + 0.5) / 200 - 0.5
    points = np.stack(np.meshgrid(steps, steps), -1).reshape(-1, 2)
    beyond = (points @ across.T) * np.sign(offset) > np.abs(offset)
    assert found == pytest.approx(beyond.mean(0), abs=6e-3)


def test_the_order_of_the_ends_does_not_matter() -> None:
    ends, middle = np.array([[1.0, 2.0, 8.0, 4.0]]), np.array([[4.5, 3.3]])
    assert part_beyond(ends, middle) == pytest.approx(part_beyond(ends[:, [2, 3, 0, 1]], middle))
    assert part_beyond(ends, middle) == pytest.approx(part_beyond(ends[:, [1, 0, 3, 2]], middle[:, ::-1]))


def test_lines_shorter_than_a_pixel_have_no_slope() -> None:
    assert part_beyond(np.array([[0.0, 0.1, 0.5, 0.5]]), np.array([[0.0, 0.0]])) == pytest.approx([0.4])
