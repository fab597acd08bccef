"""Transforms that turn about +Y, scale and move."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.scene.similarity import Similarity, compose, identities, quaternions


def random_transforms(count: int, seed: int) -> Similarity:
    rng = np.random.default_rng(seed)
    return Similarity(rng.normal(size=(count, 3)), rng.uniform(-7, 7, count), rng.uniform(0.1, 3, count))


def applied(transforms: Similarity, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each transform applied to the point of its row, by matrices."""
    cos, sin, zero, one = np.cos(transforms.yaw), np.sin(transforms.yaw), 0 * transforms.yaw, 0 * transforms.yaw + 1
    turn = np.array([[cos, zero, sin], [zero, one, zero], [-sin, zero, cos]]).transpose(2, 0, 1)
    moved = transforms.scale[:, None] * np.einsum("nij,nj->ni", turn, points) + transforms.position
    return np.asarray(moved)


def test_composition_is_one_after_the_other() -> None:
    outer, inner = random_transforms(50, 1), random_transforms(50, 2)
    points = np.random.default_rng(3).normal(size=(50, 3))
    np.testing.assert_allclose(applied(compose(outer, inner), points), applied(outer, applied(inner, points)))


def test_the_identity_changes_nothing() -> None:
    transforms = random_transforms(5, 4)
    for composed in (compose(identities(5), transforms), compose(transforms, identities(5))):
        np.testing.assert_allclose(composed.position, transforms.position)
        np.testing.assert_allclose(composed.yaw, transforms.yaw)
        np.testing.assert_allclose(composed.scale, transforms.scale)


def test_quaternions_turn_x_towards_minus_z() -> None:
    assert quaternions(np.zeros(1)).tolist() == [[0, 0, 0, 1]]
    x, y, z, w = quaternions(np.array([np.pi / 2]))[0]
    along_x = (1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w))  # the rotated x axis
    np.testing.assert_allclose(along_x, (0, 0, -1), atol=1e-6)


def test_rows_are_written_in_place() -> None:
    transforms = identities(3)
    transforms[1:2] = Similarity(np.ones((1, 3)), np.ones(1), np.full(1, 2.0))
    assert transforms.scale.tolist() == [1, 2, 1] and len(transforms[np.array([0, 2])]) == 2
