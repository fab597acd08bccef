"""Vectors and quaternions over arrays."""

import numpy as np
import pytest

from depthwalk.geometry.quaternions import conjugate, cross, from_matrices, matrices, multiply, rotate
from depthwalk.types import Array


@pytest.mark.parametrize("shapes", [((3,), (3,)), ((7, 3), (3,)), ((7, 3), (7, 3)), ((2, 1, 3), (7, 3))])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_cross_is_that_of_numpy(shapes: tuple[tuple[int, ...], tuple[int, ...]], dtype: type[np.float32]) -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=shapes[0]).astype(dtype), rng.normal(size=shapes[1])
    found = cross(a, b)
    np.testing.assert_array_equal(found, np.cross(a, b))
    assert found.dtype == np.float64 and cross(a, b.astype(dtype)).dtype == dtype


@pytest.fixture
def quaternion() -> Array:
    values = np.random.default_rng(2).normal(size=(9, 4))
    return values / np.linalg.norm(values, axis=1, keepdims=True)


def test_a_quarter_turn_about_y_takes_z_to_x() -> None:
    half = np.sqrt(0.5)
    np.testing.assert_allclose(rotate(np.array([0, half, 0, half]), np.array([0.0, 0, 1])), [1, 0, 0], atol=1e-12)


def test_matrices_rotate_as_their_quaternions(quaternion: Array) -> None:
    vector = np.random.default_rng(3).normal(size=(9, 3))
    np.testing.assert_allclose(np.einsum("nij,nj->ni", matrices(quaternion), vector), rotate(quaternion, vector))


def test_quaternions_of_matrices_are_those_that_made_them(quaternion: Array) -> None:
    turned = np.concatenate([quaternion, np.eye(4), np.eye(4)[:, [1, 2, 3, 0]] * 0.6 + np.eye(4) * 0.8])
    found = from_matrices(matrices(turned))
    np.testing.assert_allclose(np.abs((found * turned).sum(axis=1)), 1)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1)


def test_the_inner_rotation_is_applied_first(quaternion: Array) -> None:
    vector, other = np.array([1.0, 2, 3]), quaternion[::-1]
    np.testing.assert_allclose(rotate(multiply(quaternion, other), vector), rotate(quaternion, rotate(other, vector)))
    np.testing.assert_allclose(rotate(conjugate(quaternion), rotate(quaternion, vector)), np.tile(vector, (9, 1)))
