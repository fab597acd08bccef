"""Edges of meshes, and which of them a viewer sees as outlines."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.geometry.adjacency import build_adjacency
from depthwalk.quality.edges import SHAPES
from depthwalk.render.antialiasing.silhouette_lines import MAX_DENSITY, silhouette_lines
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from shapes import box, sphere

SIZE = (200, 150)


def placed(*positions: tuple[float, float, float]) -> NDArray[Any]:
    records = np.zeros(len(positions), PLACED_RECORD)
    records["rotation"], records["scale"] = (0, 0, 0, 1), 1
    records["origin"] = positions
    return records


def view_along(direction: tuple[float, float, float], near: float = 0.1, size: tuple[int, int] = SIZE) -> View:
    """From the origin; objects are placed relative to the viewer."""
    return View(Camera((0, 0, 0), direction, 1.0), size, near=near, far=50)


def test_a_box_has_twelve_edges_and_six_diagonals() -> None:
    mesh = box(1, 2, 3)
    edges = build_adjacency(mesh.positions, mesh.faces)
    assert (len(edges.points), len(edges.ends), edges.open.sum()) == (8, 18, 0)
    assert np.sort(edges.folds) == pytest.approx([0] * 12 + [1] * 6, abs=1e-6)
    middle = edges.points[edges.ends].mean(1)
    for face in edges.faces.T:  # both faces hold the edge
        assert np.einsum("ei,ei->e", edges.planes[face, :3], middle) == pytest.approx(edges.planes[face, 3], abs=1e-6)


@pytest.mark.parametrize(("count", "shape"), [*zip((8, 10, 44, 102), SHAPES.values(), strict=True)])
def test_optimised_edges_are_a_part_that_closes_the_outline(count: int, shape: Callable[..., Any]) -> None:
    positions, triangles = shape()
    edges = build_adjacency(positions, triangles)
    assert len(edges.points) == count and not edges.open.any()
    assert len(edges.points) - len(edges.ends) + len(triangles) == 2  # Euler
    view, place = view_along((0.2, -0.3, -1), size=(4000, 3000)), placed((1.6, -2.4, -8))
    every, some = (silhouette_lines(edges, view, place, fold, solid=True) for fold in (None, np.pi))
    assert len(some) < len(every) <= len(edges.ends)
    starts, stops = (np.round(some["ends"][:, part], 2).tolist() for part in (slice(0, 2), slice(2, 4)))
    assert sorted(starts) == sorted(stops)  # one line goes on where another ends


def test_a_surface_that_ends_has_open_edges() -> None:
    mesh = box(1, 1, 1)
    edges = build_adjacency(mesh.positions, mesh.faces[:-2])
    assert edges.open.sum() == 4
    assert (edges.folds[edges.open] == 1).all()


def test_three_faces_on_an_edge_are_paired_as_they_come() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], float)
    edges = build_adjacency(positions, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]))
    shared = (edges.points[edges.ends][:, :, 1:] == 0).all((1, 2))
    assert (shared.sum(), edges.open[shared].sum()) == (2, 1)


def test_triangles_that_collapse_bring_no_edges() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]], float)
    edges = build_adjacency(positions, np.array([[0, 1, 2], [1, 2, 3]]))
    assert len(edges.ends) == 3


@pytest.mark.parametrize(("least_fold", "count"), [(np.pi, 6), (0.5, 9), (None, 18)])
def test_a_box_seen_from_its_corner(least_fold: float, count: int) -> None:
    """Six edges are its outline, three more fold between visible faces, the rest is hidden or flat."""
    mesh = box(1, 1, 1)
    edges = build_adjacency(mesh.positions, mesh.faces)
    lines = silhouette_lines(edges, view_along((1, 0.8, 0.9)), placed((3, 2.4, 2.7)), least_fold, solid=True)
    assert (len(lines), lines["silhouette"].sum()) == (count, 6)
    outline = lines[lines["silhouette"] > 0]
    low, high = outline["ends"][:, :2], outline["ends"][:, 2:]
    inward = outline["ends"].reshape(-1, 2).mean(0) - low
    assert ((high - low)[:, 0] * inward[:, 1] > (high - low)[:, 1] * inward[:, 0]).all()  # the box is on the left


def test_a_sphere_has_a_ring_of_outlines_wherever_it_stands() -> None:
    mesh = sphere(1.0, 64, 32)
    edges = build_adjacency(np.round(mesh.positions - [0, 1, 0], 6), mesh.faces)
    view = view_along((0, 0, -1))
    places = [(0, 0, -6), (1, -0.5, -6)]
    lines = silhouette_lines(edges, view, placed(*places), np.pi, solid=True)
    middle = lines["ends"].reshape(-1, 2, 2).mean(1)
    at = (np.array(places)[:, :2] * view.focal_pixels / 6 + np.array(SIZE) / 2)[:, None]
    radius = view.focal_pixels / np.sqrt(6**2 - 1)
    off = np.abs(np.linalg.norm(middle - at, axis=2) - radius).min(0)
    assert off.max() < 0.06 * radius  # the second stands off the axis, its outline is slightly oval
    assert (lines["silhouette"] == 1).all()


def test_a_sphere_has_its_outline_by_its_area() -> None:
    """2πr by πr², from everywhere."""
    for radius in (0.5, 2.0):
        mesh = sphere(radius, 64, 32)
        edges = build_adjacency(np.round(mesh.positions, 6), mesh.faces)
        assert edges.density == pytest.approx(2 / radius, rel=0.02)


def test_a_surface_that_ends_has_more_outline() -> None:
    """Of a square, whose front half of all directions see: its border, which is foreshortened less than itself."""
    corners = np.array([[0, 0, 0], [3, 0, 0], [3, 3, 0], [0, 3, 0]], float)
    edges = build_adjacency(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    assert edges.density == pytest.approx(np.pi * 12 / 9)


def test_what_is_all_outlines_has_none() -> None:
    """A ball of eight pixels across and more, and a smaller one."""
    mesh = sphere(1.0, 64, 32)
    edges = build_adjacency(np.round(mesh.positions - [0, 1, 0], 6), mesh.faces)
    view = view_along((0, 0, -1), near=1)
    distance = MAX_DENSITY * view.focal_pixels / 2
    counts = [
        len(silhouette_lines(edges, view, placed((0, 0, -far * distance)), np.pi, solid=True)) for far in (0.95, 1.05)
    ]
    assert counts[0] > 0 == counts[1]


def test_lines_are_cut_at_the_near_plane() -> None:
    corners = np.array([[-1, -1, 1], [-1, 1, 1], [-1, 1, -5], [-1, -1, -5]], float)
    edges = build_adjacency(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    lines = silhouette_lines(edges, view_along((0, 0, -1), near=0.5), placed((0, 0, 0)), np.pi, solid=False)
    assert len(lines) > 0
    assert (lines["depths"] >= -1e-6).all() and (lines["depths"] <= 1).all()
    beyond = silhouette_lines(edges, view_along((0, 0, 1), near=2.0), placed((0, 0, 0)), np.pi, solid=False)
    assert len(beyond) == 0


def test_only_open_surfaces_show_their_backs() -> None:
    corners = np.array([[-1, -1, -5], [1, -1, -5], [1, 1, -5], [-1, 1, -5]], float)
    for turn, solid, count in ((1, True, 4), (-1, True, 0), (-1, False, 4)):
        edges = build_adjacency(corners, np.array([[0, 1, 2], [0, 2, 3]])[:, ::turn])
        lines = silhouette_lines(edges, view_along((0, 0, -1)), placed((0, 0, 0)), np.pi, solid)
        assert len(lines) == count
        low, high = lines["ends"][:, :2], lines["ends"][:, 2:]
        inward = np.array(SIZE) / 2 - low
        assert ((high - low)[:, 0] * inward[:, 1] > (high - low)[:, 1] * inward[:, 0]).all()
