"""Arithmetic over long lists of 3-D vectors."""

import numpy as np
import pytest

from depthwalk.geometry.vectors import lengths


@pytest.mark.parametrize("shape", [(7,), (2, 5), (0,)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_lengths_are_norms(shape: tuple[int, ...], dtype: type[np.float32]) -> None:
    vectors = np.random.default_rng(0).normal(size=(*shape, 3)).astype(dtype)
    found = lengths(vectors)
    assert found.shape == shape and found.dtype == dtype
    np.testing.assert_allclose(found, np.linalg.norm(vectors, axis=-1), rtol=1e-6)
