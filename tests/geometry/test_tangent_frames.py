"""Tangent frames from positions and texture coordinates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from depthwalk.geometry.tangent_frames import tangents, turned_normals
from depthwalk.types import Array

X, Y, Z = np.eye(3)[:, None]
U, V = np.eye(2)[:, None]
MAPPED = np.array([[0.36, 0.48, 0.8]])
numbers = st.floats(-1e3, 1e3, width=32)


def unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


@pytest.mark.parametrize(
    ("steps", "expected"),
    [
        ((U, V), [0.36, 0.48, 0.8]),
        ((-U, V), [-0.36, 0.48, 0.8]),  # mirrored
        ((V, -U), [0.48, -0.36, 0.8]),  # a quarter turn: u grows downward, v to the right
        ((3 * U, 0.1 * V), [0.36, 0.48, 0.8]),  # stretched
    ],
)
def test_a_square_of_known_axes(steps: tuple[Array, Array], expected: list[float]) -> None:
    assert turned_normals(Z, tangents(X, Y, *steps), MAPPED)[0] == pytest.approx(expected)


def test_the_steps_in_the_plane_do_not_matter() -> None:
    first, second = 2 * X + Y, X - 3 * Y
    found = tangents(first, second, first[:, :2], second[:, :2])
    assert turned_normals(Z, found, MAPPED) == pytest.approx(MAPPED)
    other = tangents(second, first, second[:, :2], first[:, :2])
    assert turned_normals(Z, other, MAPPED) == pytest.approx(MAPPED)


@pytest.mark.parametrize("steps", [(0 * U, 0 * V), (U, 2 * U), (0 * U, V)])
def test_degenerate_coordinates_leave_the_normal(steps: tuple[Array, Array]) -> None:
    assert turned_normals(Z, tangents(X, Y, *steps), MAPPED).tolist() == [[0, 0, 1]]


def test_a_map_without_a_direction_leaves_the_normal() -> None:
    assert turned_normals(Z, tangents(X, Y, U, V), np.zeros((1, 3))).tolist() == [[0, 0, 1]]


def test_it_is_the_frame_of_mikkelsen_where_vertices_have_tangents() -> None:
    """Of smooth normals, too: the tangent is projected onto the plane across the normal."""
    normal = unit(np.array([[0.2, -0.3, 1.0]]))
    tangent = unit(X - normal * (normal @ X[0])[:, None])
    expected = unit(MAPPED[:, :1] * tangent + MAPPED[:, 1:2] * np.cross(normal, tangent) + MAPPED[:, 2:] * normal)
    assert turned_normals(normal, tangents(X, Y, U, V), MAPPED) == pytest.approx(expected)


@pytest.mark.slow
@given(arrays(np.float64, (4, 3), elements=numbers), arrays(np.float64, (2, 2), elements=numbers))
def test_whatever_the_numbers_normals_have_unit_length(vectors: Array, uv: Array) -> None:
    normal = unit(vectors[:1]) if np.linalg.norm(vectors[0]) > 0 else Z
    found = turned_normals(normal, tangents(vectors[1:2], vectors[2:3], uv[:1], uv[1:]), vectors[3:])
    assert np.linalg.norm(found) == pytest.approx(1, abs=1e-6)
