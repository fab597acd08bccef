"""Transforms that turn, scale and move, against matrices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import matrices
from depthwalk.scene.similarity import Similarity, compose, from_angles, from_yaw, identities

SEEDS = st.integers(0, 2**32 - 1)


def random_transforms(count: int, seed: int) -> Similarity:
    rng = np.random.default_rng(seed)
    rotation = from_angles(*rng.uniform(-7, 7, (3, count)))
    return Similarity(rng.normal(size=(count, 3)), rotation, rng.uniform(0.1, 3, count))


def matrices_of(transforms: Similarity) -> NDArray[np.float64]:
    """Parent from node of each, (n, 4, 4)."""
    result = np.tile(np.eye(4), (len(transforms), 1, 1))
    result[:, :3, :3] = transforms.scale[:, None, None] * matrices(transforms.rotation)
    result[:, :3, 3] = transforms.position
    return result


@given(SEEDS)
def test_composition_is_the_product_of_matrices(seed: int) -> None:
    outer, inner = random_transforms(20, seed), random_transforms(20, seed + 1)
    composed = compose(outer, inner)
    np.testing.assert_allclose(matrices_of(composed), matrices_of(outer) @ matrices_of(inner), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(composed.rotation, axis=1), 1, rtol=1e-12)


@given(SEEDS)
def test_composition_is_associative(seed: int) -> None:
    a, b, c = (random_transforms(20, seed + number) for number in range(3))
    left, right = compose(compose(a, b), c), compose(a, compose(b, c))
    for name in ("position", "rotation", "scale"):
        np.testing.assert_allclose(getattr(left, name), getattr(right, name), rtol=1e-9, atol=1e-9)


def test_the_identity_changes_nothing() -> None:
    transforms = random_transforms(5, 4)
    for composed in (compose(identities(5), transforms), compose(transforms, identities(5))):
        np.testing.assert_allclose(composed.position, transforms.position)
        np.testing.assert_allclose(composed.rotation, transforms.rotation)
        np.testing.assert_allclose(composed.scale, transforms.scale)


def test_yaws_compose_as_their_sum() -> None:
    """By sines and cosines of angles, as transforms about +Y alone are composed without quaternions."""
    rng = np.random.default_rng(5)
    outer_yaw, inner_yaw = rng.uniform(-20, 20, (2, 1000))
    outer = Similarity(rng.normal(size=(1000, 3)), from_yaw(outer_yaw), rng.uniform(0.1, 3, 1000))
    place = rng.normal(size=(1000, 3)).astype(np.float32)
    inner = Similarity(place, from_yaw(inner_yaw).astype(np.float32), np.ones(1000, np.float32))
    composed = compose(outer, inner)
    cos, sin, (x, y, z) = np.cos(outer_yaw), np.sin(outer_yaw), place.T
    turned = np.stack([cos * x + sin * z, y, cos * z - sin * x], 1)
    np.testing.assert_allclose(composed.position, outer.position + outer.scale[:, None] * turned, rtol=0, atol=1e-12)
    half = (outer_yaw + inner_yaw) / 2
    wanted = np.stack([0 * half, np.sin(half), 0 * half, np.cos(half)], 1)
    np.testing.assert_allclose(composed.rotation, wanted, rtol=0, atol=2e-7)


@pytest.mark.parametrize(
    ("angles", "image"),
    [((1, 0, 0), [[0, 0, -1], [0, 1, 0]]), ((0, 1, 0), [[1, 0, 0], [0, 0, 1]]), ((0, 0, 1), [[0, 1, 0], [-1, 0, 0]])],
    ids=["yaw", "pitch", "roll"],
)
def test_quarter_turns(angles: tuple[int, int, int], image: list[list[int]]) -> None:
    """Where the x and the y axis go."""
    turn = matrices(from_angles(*(np.array(angles)[:, None] * np.pi / 2)))[0]
    np.testing.assert_allclose(turn[:, :2].T, image, atol=1e-12)


def test_no_angle_is_the_identity() -> None:
    none = np.zeros(1, np.float32)
    for rotation in (from_yaw(none), from_angles(none, none, none)):
        assert rotation.tolist() == [[0, 0, 0, 1]] and rotation.dtype == np.float32


def test_a_yaw_alone_is_a_rotation_without_pitch_and_roll() -> None:
    yaw = np.random.default_rng(6).uniform(-20, 20, 100)
    np.testing.assert_array_equal(from_yaw(yaw), from_angles(yaw, 0 * yaw, 0 * yaw))


def test_rows_are_written_in_place() -> None:
    transforms = identities(3)
    transforms[1:2] = Similarity(np.ones((1, 3)), np.array([[0, 1.0, 0, 0]]), np.full(1, 2.0))
    assert transforms.scale.tolist() == [1, 2, 1] and len(transforms[np.array([0, 2])]) == 2
    assert transforms.rotation.tolist() == [[0, 0, 0, 1], [0, 1, 0, 0], [0, 0, 0, 1]]
