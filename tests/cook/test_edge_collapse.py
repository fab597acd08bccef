"""Contracted surfaces: fewer triangles, near what they stand for, whatever the surface is like."""

import numpy as np
import pytest

from depthwalk.cook.edge_collapse import _cheapest, _collapse_once, _Known, collapse_edges
from depthwalk.cook.quadrics import ClusteredSurface, clustered_surface
from depthwalk.cook.vertex_clustering import cluster_vertices
from depthwalk.geometry.indexed_triangles import open_edges
from depthwalk.ingest.mesh import Mesh
from depthwalk.types import Array, Ints, Mask
from shapes import box, sphere

CELL = 0.01


def welded(mesh: Mesh, cell: float = CELL) -> ClusteredSurface:
    return clustered_surface(
        *cluster_vertices(mesh.positions, mesh.faces.astype(np.int64), np.zeros(len(mesh.positions), int), cell)
    )


@pytest.fixture(scope="module")
def ball() -> ClusteredSurface:
    return welded(sphere())


def plane(count: int = 24) -> tuple[Array, Ints]:
    """A square in z = 0, open all round."""
    x, y = np.meshgrid(np.linspace(-1, 1, count + 1), np.linspace(-1, 1, count + 1))
    number = np.arange((count + 1) ** 2).reshape(count + 1, -1)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], -1), triangles


def areas(surface: ClusteredSurface) -> Array:
    a, b, c = surface.point[surface.triangles].transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def test_a_box_is_twelve_triangles() -> None:
    mesh = box(2, 1, 3)
    surface = collapse_edges(welded(mesh), 0.05)
    assert len(surface.point) == 8 and len(surface.triangles) == 12


def test_a_plane_keeps_its_outline() -> None:
    point, triangles = plane()
    surface = collapse_edges(
        clustered_surface(*cluster_vertices(point, triangles, np.zeros(len(point), int), CELL)), 0.05
    )
    assert len(surface.triangles) < 0.1 * len(triangles)
    assert np.abs(surface.point[:, 2]).max() < 1e-6
    assert areas(surface).sum() == pytest.approx(4, rel=0.02)


@pytest.mark.parametrize(("tolerance", "most", "off"), [(0.1, 250, 0.035), (0.2, 100, 0.08), (0.4, 40, 0.16)])
def test_a_ball_stays_round(ball: ClusteredSurface, tolerance: float, most: int, off: float) -> None:
    surface = collapse_edges(ball, tolerance)
    assert 20 < len(surface.triangles) < most
    middles = surface.point[surface.triangles].mean(1) - [0, 1, 0]
    assert np.abs(np.linalg.norm(middles, axis=1) - 1).max() < off
    start, end = surface.triangles.ravel(), np.roll(surface.triangles, -1, axis=1).ravel()
    assert set(zip(start, end, strict=True)) == set(zip(end, start, strict=True))  # nothing is open


def test_copies_that_overlap_become_one_surface() -> None:
    point, triangles = plane()
    twice = np.concatenate([point, point + 1e-6])
    rank = np.repeat([0, 1], len(point))
    kept, left = cluster_vertices(twice, np.concatenate([triangles, triangles + len(point)]), rank, CELL)
    assert len(left) == len(triangles)
    assert (kept[:, 2] == 0).all()  # those of the lower rank


def test_what_a_round_knows_of_cheap_edges_is_what_looking_at_all_of_them_tells(ball: ClusteredSurface) -> None:
    random, surface, known = np.random.default_rng(0), ball, _Known(np.ones(len(ball.point), bool), None)
    for _ in range(4):
        surface, known = _collapse_once(surface, known, 0.1, random, map)
        assert known.cheap is not None and len(known.cheap.start) and not known.new.all()
        unknown = _Known(np.ones(len(surface.point), bool), None)
        for kept, anew in zip(
            _cheapest(surface, known, 0.1, np.random.default_rng(1), map),
            _cheapest(surface, unknown, 0.1, np.random.default_rng(1), map),
            strict=True,
        ):
            for column in "start", "end", "target", "quadric", "weight", "cost":
                np.testing.assert_array_equal(getattr(kept, column), getattr(anew, column))


def test_a_curved_boundary_is_followed_more_closely_where_the_surface_ends() -> None:
    """Of a disc, as the top of a round table whose rim another image shows: chords across its outline open gaps."""
    square, triangles = plane(32)
    reach = (
        np.abs(square[:, :2]).max(1, keepdims=True) / np.maximum(np.linalg.norm(square[:, :2], axis=1), 1e-9)[:, None]
    )
    point = square * reach  # squares about the middle become circles
    at_end = np.linalg.norm(point, axis=1) > 1 - 1e-6

    def lost(ends: Mask | None) -> float:
        surface = collapse_edges(clustered_surface(point, triangles, at_end=ends), 0.06)
        assert len(surface.triangles) < 0.2 * len(triangles)
        start, end, _ = open_edges(surface.point, surface.triangles, np.tile([0.0, 0, 1], (len(surface.triangles), 1)))
        return float(np.mean(1 - np.linalg.norm((surface.point[start] + surface.point[end])[:, :2] / 2, axis=1)))

    assert lost(at_end) < 0.6 * lost(None)
