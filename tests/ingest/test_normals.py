"""Vertex normals, smooth and split."""

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.ingest.normals import split_at_creases


def fold(angle: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Two triangles that share an edge, folded by `angle` degrees."""
    turn = np.radians(angle)
    positions = np.array([[0, 0, 0], [0, 0, 1], [-1, 0, 0], [np.cos(turn), np.sin(turn), 0]], float)
    return positions, np.array([[0, 2, 1], [0, 1, 3]])


@pytest.mark.parametrize(("angle", "vertices"), [(0, 4), (59, 4), (61, 6), (120, 6)])
def test_vertices_are_split_from_sixty_degrees(angle: float, vertices: int) -> None:
    positions, faces = fold(angle)
    source, split, normals = split_at_creases(positions, faces)
    assert len(source) == len(normals) == vertices
    np.testing.assert_array_equal(source[split], faces)  # the same triangles
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)


def test_the_crease_is_a_parameter() -> None:
    positions, faces = fold(30)
    assert len(split_at_creases(positions, faces, crease=np.radians(20))[0]) == 6


def test_the_smooth_normal_lies_between() -> None:
    positions, faces = fold(50)
    source, _, normals = split_at_creases(positions, faces)
    flat = np.array([0, 1, 0])
    turned = np.array([-np.sin(np.radians(50)), np.cos(np.radians(50)), 0])
    between = (flat + turned) / np.linalg.norm(flat + turned)
    shared = normals[source == 0][0]
    np.testing.assert_allclose(np.abs(shared @ between), 1, atol=1e-9)


def test_back_to_back_faces_have_normals_all_the_same() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    _, _, normals = split_at_creases(positions, np.array([[0, 1, 2], [0, 2, 1]]), crease=np.pi)
    np.testing.assert_allclose(np.abs(normals[:, 2]), 1)
