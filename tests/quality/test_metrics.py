"""The measures of two pictures: exact values for pictures whose difference is known."""

import math

import numpy as np
import pytest

from depthwalk.quality import metrics
from depthwalk.types import Mask, Picture


def square(side: int, first: int, last: int, left: int | None = None) -> Mask:
    """A mask (side, side) with rows first to last − 1 and as many columns, from `left`."""
    mask = np.zeros((side, side), bool)
    left = first if left is None else left
    mask[first:last, left : left + last - first] = True
    return mask


def noise(height: int, width: int, seed: int = 0) -> Picture:
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), np.uint8)


def test_equal_pictures_differ_by_nothing() -> None:
    picture, mask = noise(40, 50), np.ones((40, 50), bool)
    distance = np.where(square(40, 5, 30), np.float32(2.5), np.float32(np.inf))
    assert metrics.psnr(picture, picture, mask) == math.inf
    assert metrics.silhouette_iou(mask, mask) == 1
    assert metrics.mean_flip(picture, picture, mask) == 0
    assert metrics.hole_percent(mask, mask) == 0
    assert metrics.depth_errors(distance, distance) == (0, 0)


def test_psnr_counts_the_pixels_asked_for_alone() -> None:
    reference = np.full((10, 10, 3), 100, np.uint8)
    test = reference.copy()
    test[:5, :, 0] = 90  # below the reference: unsigned arithmetic would wrap
    test[9] = 0
    where = np.zeros((10, 10), bool)
    where[:8] = True
    error = 10**2 * (5 / 8) / 3
    assert metrics.psnr(reference, test, where) == pytest.approx(10 * math.log10(255**2 / error))


def test_a_shifted_square_has_a_known_iou() -> None:
    assert metrics.silhouette_iou(square(40, 10, 30), square(40, 10, 30, left=15)) == pytest.approx(15 / 25)
    assert metrics.silhouette_iou(square(40, 0, 10), square(40, 0, 10, left=20)) == 0
    assert metrics.silhouette_iou(np.zeros((4, 4), bool), np.zeros((4, 4), bool)) == 1


def test_a_hole_is_found_with_its_size_and_a_thin_rim_is_none() -> None:
    mesh = square(60, 10, 50)
    holed = mesh & ~square(60, 20, 26)
    assert metrics.hole_map(mesh, holed).sum() == 36
    assert metrics.hole_percent(mesh, holed) == pytest.approx(100 * 36 / 1600)
    assert metrics.hole_percent(mesh, square(60, 12, 48)) == 0
    assert metrics.hole_map(mesh, square(60, 13, 47)).sum() == 36**2 - 34**2
    assert metrics.hole_percent(np.zeros((9, 9), bool), np.ones((9, 9), bool)) == 0


def test_the_edge_of_the_picture_is_not_the_silhouette() -> None:
    whole = np.ones((20, 20), bool)
    assert metrics.hole_map(whole, ~square(20, 0, 3)).sum() == 9


def test_depth_errors_are_of_common_pixels_and_in_the_unit() -> None:
    reference, test = np.full((2, 10, 10), np.inf, np.float32)
    reference[:8], test[2:] = 4, 4.5
    test[2, :2] = 8
    assert metrics.depth_errors(reference, test, 2.0) == pytest.approx((0.25, 2.0))
    assert all(math.isnan(value) for value in metrics.depth_errors(reference[:2], test[:2]))


def test_flip_over_the_window_is_flip_over_the_picture() -> None:
    reference, test = np.full((2, 120, 120, 3), 128, np.uint8)
    where = square(120, 50, 70)
    reference[where], test[where] = noise(20, 20).reshape(-1, 3), noise(20, 20, 1).reshape(-1, 3)
    window = metrics.bounding_window(where, metrics.FLIP_REACH)
    assert window == (slice(34, 86), slice(34, 86))
    whole = metrics.mean_flip(reference, test, where)
    assert 0.1 < whole < 1
    assert metrics.mean_flip(reference[window], test[window], where[window]) == pytest.approx(whole, abs=1e-5)


def test_flip_grows_with_the_difference() -> None:
    reference, where = np.full((30, 30, 3), 128, np.uint8), np.ones((30, 30), bool)
    values = [metrics.mean_flip(reference, np.full_like(reference, 128 + step), where) for step in (0, 4, 16, 64)]
    assert values[0] == 0 and values == sorted(set(values))


def test_the_window_stays_within_the_picture() -> None:
    picture = noise(20, 30)
    where = np.zeros((20, 30), bool)
    where[1, 28] = True
    assert picture[metrics.bounding_window(where, 4)].shape == (6, 6, 3)
