"""Normals, areas and samples of triangles, and rows that are equal."""

import numpy as np
import pytest

from depthwalk.geometry.triangles import (
    doubled_areas,
    face_normals,
    row_ids,
    sample_batches,
    sample_triangles,
    spread_directions,
)
from depthwalk.types import Array, Rows


@pytest.fixture
def corners() -> Array:
    return np.random.default_rng(2).normal(size=(50, 3, 3))


def joined(corners: Array, areas: Array, count: int) -> tuple[Array, Rows]:
    points, triangle = zip(*sample_batches(corners, areas, count), strict=True)
    return np.concatenate(points), np.concatenate(triangle)


def test_doubled_areas_are_areas_along_normals(corners: Array) -> None:
    normal, area = face_normals(corners)
    flat, triangles = corners.reshape(-1, 3), np.arange(150).reshape(-1, 3)
    np.testing.assert_allclose(doubled_areas(flat, triangles), 2 * area[:, None] * normal)


def test_a_triangle_without_area_has_no_normal() -> None:
    normal, area = face_normals(np.zeros((1, 3, 3)))
    assert not normal.any() and not area.any()


def test_samples_lie_within_their_triangles_by_area(corners: Array) -> None:
    area = face_normals(corners)[1]
    points, triangle = joined(corners, area, 20_000)
    a, b, c = corners[triangle].transpose(1, 0, 2)
    parts = np.linalg.solve(np.stack([b - a, c - a, np.cross(b - a, c - a)], -1), (points - a)[..., None])[..., 0]
    assert (parts[:, :2] >= -1e-9).all() and (parts[:, :2].sum(1) <= 1 + 1e-9).all()
    assert np.abs(parts[:, 2]).max() < 1e-9
    share = np.bincount(triangle, minlength=len(corners)) / len(points)
    assert share == pytest.approx(area / area.sum(), abs=1.5 / len(points))
    again, normals = sample_triangles(corners, 20_000)
    np.testing.assert_array_equal(again, points)
    np.testing.assert_array_equal(normals, face_normals(corners)[0][triangle])


def test_triangles_without_area_get_no_samples(corners: Array) -> None:
    corners[[0, 7, 49]] = corners[[0, 7, 49], :1]
    assert not np.isin(joined(corners, face_normals(corners)[1], 500)[1], [0, 7, 49]).any()


def test_directions_are_spread_evenly() -> None:
    directions = spread_directions(400)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1)
    assert np.abs(directions.mean(0)).max() < 0.01
    assert np.abs(directions.T @ directions / 400 - np.eye(3) / 3).max() < 0.01


@pytest.mark.parametrize("columns", [1, 3])
def test_equal_rows_have_one_number(columns: int) -> None:
    rows = np.random.default_rng(3).integers(0, 4, (200, columns))
    number, first = row_ids(rows)
    np.testing.assert_array_equal(rows[first][number], rows)
    assert len(first) == len(np.unique(rows, axis=0))
    assert (first[number] <= np.arange(len(rows))).all()


def test_rows_that_are_all_equal_are_one() -> None:
    number, first = row_ids(np.ones((5, 2)))
    assert not number.any() and first.tolist() == [0]


@pytest.mark.parametrize(
    "values",
    [
        [0.0, 1.0, 2.0],
        [-0.0, 0.0, np.nan, 1.0],
        [-5, 0, 3],
        np.array([0, 200, 255], np.uint8),
        np.array([-(1 << 62), 0, 1 << 62]),  # three of these are more than one number of 64 bits holds
        np.array([0, 1, (1 << 64) - 1], np.uint64),
    ],
)
def test_rows_are_numbered_in_the_order_of_their_columns_the_last_one_first(values: Rows) -> None:
    columns = np.random.default_rng(1).choice(values, (60, 3))
    ids, first = row_ids(columns)
    order = np.lexsort(columns.T)
    np.testing.assert_array_equal(np.argsort(ids, kind="stable"), order)
    np.testing.assert_array_equal(ids[first], np.arange(len(first)))
    np.testing.assert_array_equal(columns[first][ids], columns)
