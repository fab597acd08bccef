"""Vectors and quaternions over arrays."""

import numpy as np
import pytest

from depthwalk.geometry.quaternions import cross


@pytest.mark.parametrize("shapes", [((3,), (3,)), ((7, 3), (3,)), ((7, 3), (7, 3)), ((2, 1, 3), (7, 3))])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_cross_is_that_of_numpy(shapes, dtype):
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=shapes[0]).astype(dtype), rng.normal(size=shapes[1])
    found = cross(a, b)
    np.testing.assert_array_equal(found, np.cross(a, b))
    assert found.dtype == np.float64 and cross(a, b.astype(dtype)).dtype == dtype
