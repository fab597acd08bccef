"""Normals of simplified triangles: fitted to those that they replace, and counted in the errors of groups."""

from dataclasses import replace

import numpy as np
import pytest

from cluster_cuts import bumpy, grid, normals_off, wavy
from depthwalk.bake.level_looks import LOOKS_WRONG
from depthwalk.cook.cluster_builder import build_clusters
from depthwalk.cook.cluster_normals import fit_normals, normal_errors
from depthwalk.geometry.triangles import row_ids
from depthwalk.ingest.mesh import Mesh
from depthwalk.types import Array
from shapes import mesh_of


def fitted(fixed: np.ndarray, side: int = 4) -> tuple[Array, Array, Array]:
    """Normals of a coarse square before and after they are fitted to a fine one, and those of least squares."""
    point, triangles = grid(side)
    fine, small = grid(4 * side)
    shown = wavy(fine)[small]
    before = wavy(point + np.array([0.1, 0, 0]))  # somewhat off
    corners = point[triangles]
    after = fit_normals(before, np.arange(len(point)), fixed, corners, triangles, fine[small], shown)
    middle = fine[small].mean(1)
    at = np.zeros((len(middle), len(point)))
    cell = np.minimum((middle[:, :2] * side).astype(int), side - 1)
    inside = middle[:, :2] * side - cell
    upper = inside[:, 1] > inside[:, 0]
    chosen = triangles[2 * (cell[:, 1] * side + cell[:, 0]) + upper]
    u, v = inside.T
    shares = np.where(upper[:, None], np.stack([1 - v, u, v - u], 1), np.stack([1 - u, u - v, v], 1))
    at[np.arange(len(middle))[:, None], chosen] = shares
    best = before.copy()
    rest = shown.mean(1) - at[:, fixed] @ before[fixed]
    best[~fixed] = np.linalg.lstsq(at[:, ~fixed], rest, rcond=None)[0]
    return before, after, best / np.linalg.norm(best, axis=1, keepdims=True)


@pytest.mark.parametrize("held", [0, 5])
def test_they_are_those_of_least_squares(held: int) -> None:
    fixed = np.arange(25) < held
    before, after, best = fitted(fixed)
    np.testing.assert_array_equal(after[fixed], before[fixed])
    np.testing.assert_allclose(np.linalg.norm(after, axis=1), 1, atol=1e-6)
    off, was = (np.linalg.norm(normal - best, axis=1)[~fixed] for normal in (after, before))
    assert np.sqrt(np.mean(off**2)) < 0.15 * np.sqrt(np.mean(was**2))


def test_vertices_that_look_alike_at_a_place_stay_alike() -> None:
    """Two halves of a square, whose vertices along the seam differ in texture coordinates only."""
    point, triangles = grid(4)
    fine, small = grid(16)
    left = point[triangles].mean(1)[:, 0] < 0.5
    own = np.where(left[:, None], triangles, triangles + 25)
    place, normal = np.tile(np.arange(25), 2), np.tile(wavy(point + np.array([0.1, 0, 0])), (2, 1))
    after = fit_normals(normal, place, np.zeros(50, bool), point[triangles], own, fine[small], wavy(fine)[small])
    seam = np.flatnonzero(point[:, 0] == 0.5)
    np.testing.assert_array_equal(after[seam], after[25 + seam])
    assert (after[seam] != normal[seam]).any(1).all()


def test_the_other_side_of_a_leaf_does_not_count() -> None:
    point, triangles = grid(4)
    before = np.tile([0.6, 0.0, 0.8], (25, 1))
    corners, shown = point[triangles], np.tile([0.0, 0.0, -1.0], (len(triangles), 3, 1))
    fixed = np.zeros(25, bool)
    after = fit_normals(before, np.arange(25), fixed, corners, triangles, corners[:, ::-1], shown)
    np.testing.assert_array_equal(after, before)
    centre = corners.mean(1)
    group = np.zeros(len(centre), int)
    assert normal_errors(centre, shown[:, 0], group, corners, before[triangles], 1) == 0


def test_errors_are_in_proportion_to_edges() -> None:
    point, triangles = grid(4)
    corners, normals = point[triangles], np.tile([0.0, 0.0, 1.0], (len(triangles), 3, 1))
    tilted = np.tile([0.28, 0.0, 0.96], (len(triangles), 1))
    group = np.zeros(len(corners), int)
    (error,) = normal_errors(corners.mean(1), tilted, group, corners, normals, 1)
    assert error == pytest.approx(LOOKS_WRONG * np.hypot(0.28, 0.04) * np.sqrt(2 * 0.5 / 16))
    (half,) = normal_errors(corners.mean(1) / 2, tilted, group, corners / 2, normals, 1)
    assert half == pytest.approx(error / 2)


def rough(ball: Mesh) -> Mesh:
    """A mesh with normals as noisy as those of a scan, one at each place."""
    place = row_ids(ball.positions)[0]
    noise = np.random.default_rng(0).normal(0, 0.3, (len(ball.positions), 3))[place]
    normals = ball.normals + noise
    return replace(ball, normals=(normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32))


def test_clusters_show_the_mean_of_rough_normals() -> None:
    ball = bumpy(48, 24)
    clusters = build_clusters(rough(ball))
    found, count = normals_off(ball, clusters, 1.01 * clusters.error[: clusters.level_first[4]].max())
    assert count < 0.1 * len(ball.faces)
    assert found < 0.115  # 0.135 if a collapse takes a normal between those of two vertices


def test_a_flat_surface_is_as_fine_as_its_normals_need() -> None:
    """Its shape alone would leave two triangles."""
    point, triangles = grid(32)
    flat = mesh_of(point, triangles, np.tile([0.0, 0, 1], (len(point), 1)))
    waves = replace(flat, normals=wavy(point).astype(np.float32))
    even, uneven = build_clusters(flat), build_clusters(waves)
    for allowed in (0.1, 0.2, 0.4):
        found, count = normals_off(waves, uneven, allowed)
        assert found * np.sqrt(2 / count) * LOOKS_WRONG < 1.2 * allowed
    assert normals_off(flat, even, 0.1)[1] < 0.05 * len(triangles)
    assert normals_off(waves, uneven, 0.4)[1] < normals_off(waves, uneven, 0.1)[1] < len(triangles)
