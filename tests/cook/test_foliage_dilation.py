"""Foliage that was simplified is made as large as it was."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from depthwalk.cook import foliage_dilation
from depthwalk.cook.foliage_dilation import FoliageCover, count_silhouette, count_voxels, dilate_foliage
from depthwalk.cook.quadrics import ClusteredSurface, clustered_surface
from depthwalk.cook.vertex_clustering import cluster_vertices
from depthwalk.ingest.mesh import Mesh
from shapes import leaves, sphere

SIDE = 0.05


def welded(mesh: Mesh) -> ClusteredSurface:
    return clustered_surface(
        *cluster_vertices(mesh.positions, mesh.faces.astype(np.int64), np.zeros(len(mesh.positions), int), 1e-5)
    )


def test_cubes_are_those_that_a_square_meets() -> None:
    """1 m wide, and once more in the same place."""
    square = np.array([[[0, 0, 0.01], [1, 0, 0.01], [1, 1, 0.01]], [[0, 0, 0.01], [1, 1, 0.01], [0, 1, 0.01]]])
    assert count_voxels(square, SIDE) == pytest.approx(20**2, rel=0.03)
    assert count_voxels(np.concatenate([square, square]), SIDE) == pytest.approx(20**2, rel=0.03)


def test_large_boxes_are_counted_without_a_map(monkeypatch: pytest.MonkeyPatch) -> None:
    """The map of the last two, 17 km apart, would take petabytes; each leaf meets what it meets alone."""
    mesh = leaves(40, 0.2)
    corners = mesh.positions[mesh.faces].astype(np.float64)
    expected = count_voxels(corners, SIDE / 4)
    monkeypatch.setattr(foliage_dilation, "_MIN_MERGED", 100)
    monkeypatch.setattr(foliage_dilation, "_MAX_MAP", 1000)
    monkeypatch.setattr(foliage_dilation, "_MAP_SHARE", 0)
    assert count_voxels(corners, SIDE / 4) == expected > 1_000
    monkeypatch.undo()
    near, far = corners[:2], corners[:2] + 10_000.0
    tracemalloc.start()
    together = count_voxels(np.concatenate([near, far]), SIDE / 8)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert together == pytest.approx(2 * count_voxels(near, SIDE / 8), rel=0.05) and peak < 10e6


def test_leaves_that_shrank_are_spread_to_their_size() -> None:
    mesh = leaves(200, 0.2)
    leaf = mesh.positions.reshape(-1, 4, 3)
    shrunk = (leaf - 0.15 * (leaf - leaf.mean(1, keepdims=True))).reshape(-1, 3)
    whole, surface = welded(mesh), welded(replace(mesh, positions=shrunk))
    wanted = count_voxels(whole.point[whole.triangles], SIDE)
    moved = np.linalg.norm(dilate_foliage(surface, wanted, SIDE, 1.0) - surface.point, axis=1)
    assert count_voxels(surface.point[surface.triangles], SIDE) < 0.9 * wanted
    assert moved == pytest.approx(moved[0])  # all are on a rim, from which a leaf's corner went by this
    assert moved[0] == pytest.approx(0.15 * 0.1 * 1.25**0.5, rel=0.3)
    assert np.linalg.norm(dilate_foliage(surface, wanted, SIDE, 0.01) - surface.point, axis=1).max() == pytest.approx(
        0.01
    )


def test_what_is_large_enough_or_has_no_rims_is_not_spread() -> None:
    for surface, wanted in (welded(leaves(200, 0.2)), 100), (welded(sphere()), 100_000):
        assert np.array_equal(dilate_foliage(surface, wanted, SIDE, 1.0), surface.point)


def test_silhouettes_of_a_ball_are_discs_however_many_surfaces_lie_behind() -> None:
    ball = sphere(0.5, 96, 48)
    corners = ball.positions[ball.faces].astype(np.float64)
    disc = np.pi * 0.5**2 / 0.02**2
    assert count_silhouette(corners, 0.02) == pytest.approx(6 * disc, rel=0.06)  # from six sides
    inner = 0.8 * (corners - [0, 0.5, 0]) + [0, 0.5, 0]
    assert count_silhouette(np.concatenate([corners, inner]), 0.02) == pytest.approx(6 * disc, rel=0.06)


def test_a_surface_without_what_lies_inside_looks_restored_but_is_not() -> None:
    ball = sphere(0.5, 96, 48)
    outer = welded(ball)
    middle = np.array([0, 0.5, 0], np.float32)
    shells = welded(replace(ball, positions=0.5 * (ball.positions + middle)))
    point = np.concatenate([outer.point, shells.point])
    cover = FoliageCover(point, np.concatenate([outer.triangles, shells.triangles + len(outer.point)]), SIDE)
    assert cover.is_restored(point[np.concatenate([outer.triangles, shells.triangles + len(outer.point)])])
    assert not cover.is_restored(outer.point[outer.triangles]) and cover.looks_restored(outer.point[outer.triangles])
    assert not cover.looks_restored(shells.point[shells.triangles])
