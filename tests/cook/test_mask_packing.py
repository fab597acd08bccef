"""Masks in one picture: none overlap, and they fill each other's bays."""

import numpy as np
import pytest

from depthwalk.cook.mask_packing import pack_masks
from depthwalk.types import Mask, Rows


def painted(masks: list[Mask]) -> Rows:
    """How many masks cover each cell of the picture, and the picture's fill."""
    places, (height, width) = pack_masks(masks)
    count = np.zeros((height, width), int)
    for mask, (row, column) in zip(masks, places, strict=True):
        count[row : row + mask.shape[0], column : column + mask.shape[1]] += mask
    return count


def test_random_masks_do_not_overlap() -> None:
    rng = np.random.default_rng(1)
    masks = [rng.random(tuple(rng.integers(1, 12, 2))) < 0.6 for _ in range(60)]
    masks = [mask | (np.arange(mask.size).reshape(mask.shape) == 0) for mask in masks]
    count = painted(masks)
    assert count.max() == 1 and count.sum() == sum(mask.sum() for mask in masks)
    assert count.mean() > 0.6


def test_a_small_mask_goes_into_the_hole_of_a_large_one() -> None:
    ring = np.ones((5, 5), bool)
    ring[1:4, 1:4] = False
    count = painted([np.ones((3, 3), bool), ring])
    assert count.shape == (5, 5) and (count == 1).all()


@pytest.mark.parametrize("shape", [(1, 1), (3, 7)])
def test_one_mask_is_the_picture(shape: tuple[int, int]) -> None:
    assert pack_masks([np.ones(shape, bool)])[0] == [(0, 0)]
