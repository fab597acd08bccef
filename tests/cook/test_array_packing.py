"""Packed arrays come back as they were, and compress better."""

import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra.numpy import array_shapes, arrays

from depthwalk.cook.array_packing import pack_picture, pack_words, unpack_picture, unpack_words


@given(arrays(np.uint16, array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=20)))
def test_words_come_back(values: np.ndarray) -> None:
    again = unpack_words(pack_words(values))
    assert again.dtype == values.dtype and np.array_equal(again, values)


@given(arrays(np.uint8, array_shapes(min_dims=3, max_dims=3, min_side=1, max_side=8)))
def test_pictures_come_back(texels: np.ndarray) -> None:
    again = unpack_picture(pack_picture(texels))
    assert again.dtype == texels.dtype and np.array_equal(again, texels)


def test_no_rows_come_back() -> None:
    assert unpack_words(pack_words(np.zeros((0, 4), np.uint16))).shape == (0, 4)


def test_what_changes_little_from_row_to_row_compresses_better() -> None:
    rng = np.random.default_rng(1)
    walk = (30_000 + rng.integers(-40, 40, (5000, 3)).cumsum(axis=0)).astype(np.uint16)
    assert len(zlib.compress(pack_words(walk).tobytes())) < 0.7 * len(zlib.compress(walk.tobytes()))


@pytest.mark.parametrize(("unpack", "shape"), [(unpack_words, (3, 5)), (unpack_words, (4,)), (unpack_picture, (4, 4))])
def test_other_shapes_are_refused(unpack: Callable[[Any], Any], shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="and shape"):
        unpack(np.zeros(shape, np.uint8))


@pytest.mark.parametrize(("unpack", "shape"), [(unpack_words, (4, 5)), (unpack_picture, (4, 4, 3))])
def test_other_types_are_refused(unpack: Callable[[Any], Any], shape: tuple[int, ...]) -> None:
    unpack(np.zeros(shape, np.uint8))
    with pytest.raises(ValueError, match="of type complex128"):
        unpack(np.zeros(shape, complex))
