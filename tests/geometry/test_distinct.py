"""Distinct whole numbers, their first places and their ranks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from depthwalk.geometry.distinct import distinct_numbers, sorted_distinct
from depthwalk.types import Ints


@given(arrays(np.int32, st.integers(0, 40), elements=st.integers(0, 2**31 - 1) | st.integers(0, 30)))
def test_the_same_as_numpy_finds(numbers: Ints) -> None:
    expected = np.unique(numbers, return_index=True, return_inverse=True)
    for found, wanted in zip(distinct_numbers(numbers), expected, strict=True):
        np.testing.assert_array_equal(found, wanted)
        assert found.dtype == np.int64
    np.testing.assert_array_equal(sorted_distinct(numbers), expected[0])
    np.testing.assert_array_equal(sorted_distinct(-numbers.reshape(1, -1)), -expected[0][::-1])


@pytest.mark.parametrize("most", [10, 30_000, 2**40])
def test_many_numbers_small_and_large(most: int) -> None:
    numbers = np.random.default_rng(0).integers(0, most, 10_000)
    for found, wanted in zip(distinct_numbers(numbers), np.unique(numbers, True, True), strict=True):
        np.testing.assert_array_equal(found, wanted)
