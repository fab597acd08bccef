"""Arithmetic over long lists of 3-D vectors."""

import tracemalloc

import numpy as np
import pytest
from pyglm import glm

from depthwalk.geometry.vectors import components, lengths


@pytest.mark.parametrize("shape", [(7,), (2, 5), (0,)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_lengths_are_norms(shape: tuple[int, ...], dtype: type[np.float32]) -> None:
    vectors = np.random.default_rng(0).normal(size=(*shape, 3)).astype(dtype)
    found = lengths(vectors)
    assert found.shape == shape and found.dtype == dtype
    np.testing.assert_allclose(found, np.linalg.norm(vectors, axis=-1), rtol=1e-6)


def test_components_of_a_vector_are_exact_and_are_freed() -> None:
    vector = glm.dvec3(0.1, -2.5, 1e-17)
    assert components(vector) == (0.1, -2.5, 1e-17)
    tracemalloc.start()
    try:
        for _ in range(1000):
            components(vector)
        assert tracemalloc.get_traced_memory()[0] < 20_000  # 72 bytes for each would be 72,000
    finally:
        tracemalloc.stop()
