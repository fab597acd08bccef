"""Curves: what an object costs by triangles, number and pixels, where two cross, and how they are drawn."""

import re
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.bench import plots
from depthwalk.bench.object_cost import crossings, frame_costs, row_of
from depthwalk.bench.tables import curves
from depthwalk.bench.tables.table import Curves, Table, to_text
from depthwalk.geometry.triangles import face_normals
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from shapes import sphere


def silent(name: str, step: str) -> None:
    """Report nothing."""


def test_curves_cross_where_their_powers_meet() -> None:
    at = [1.0, 10.0, 100.0, 1000.0]
    x = np.array(at)
    assert crossings(at, x, np.full(4, 30.0)) == pytest.approx([30.0])
    assert crossings(at, x**2, 50 * x) == pytest.approx([50.0])
    assert crossings(at, x, 2 * x) == []
    assert crossings(at, np.array([1, 10, np.nan, 1]), np.full(4, 2.0)) == pytest.approx([2.0])
    assert crossings(at, np.array([1, 10, -0.1, 1]), np.full(4, 2.0)) == pytest.approx([2.0])


@pytest.mark.parametrize("parts", [2, 3, 5])
def test_a_divided_mesh_has_the_same_surface(parts: int) -> None:
    mesh = sphere(0.5, columns=8, rows=4)
    finer = curves.subdivided(mesh, parts)
    count = parts**2
    assert len(finer.faces) == count * len(mesh.faces)
    (normals, areas), (_, finer_areas) = (face_normals(each.positions[each.faces]) for each in (mesh, finer))
    assert finer_areas.reshape(-1, count) == pytest.approx(np.repeat(areas[:, None] / count, count, 1), rel=1e-3)
    turned, _ = face_normals(finer.positions[finer.faces])
    assert np.einsum("fd,fkd->fk", normals, turned.reshape(-1, count, 3))[areas > 0] == pytest.approx(1, abs=1e-4)
    assert sum(part.face_count for part in finer.parts) == len(finer.faces)
    assert np.linalg.norm(finer.normals, axis=1) == pytest.approx(1, abs=1e-5)
    assert finer.colours.shape == finer.positions.shape and finer.uv.shape == (len(finer.positions), 2)


def test_no_timed_frame_waits_for_the_warm_up_of_others() -> None:
    unfinished: list[str] = []
    begun_with: list[int] = []

    def renderer(name: str) -> Any:
        def finish() -> None:  # of a GPU that all contexts share
            unfinished.clear()

        def draw(view: View) -> None:
            begun_with.append(len(unfinished))
            unfinished.append(name)

        return SimpleNamespace(draw=draw, finish=finish, size=(8, 8), device=SimpleNamespace(software=False))

    camera = Camera((0, 1, 2), (0, 0, 0), 1.0)
    times = frame_costs({name: renderer(name) for name in ("mesh", "dpci")}, [camera] * 3)
    assert [len(each) for each in times.values()] == [3, 3] and begun_with[-6:] == [0] * 6


def test_a_divided_mesh_is_as_closed_as_it_was() -> None:
    mesh = sphere(0.5, columns=8, rows=4)
    open_edges = []
    for each in (mesh, curves.subdivided(mesh, 3)):
        sides = np.sort(each.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        open_edges.append(int((np.unique(sides, axis=0, return_counts=True)[1] == 1).sum()))
    assert open_edges[1] == 3 * open_edges[0]


def test_edges_are_divided_into_as_many_parts_as_the_triangles_allow() -> None:
    assert [curves._parts(most) for most in (0, 1, 3, 4, 12)] == [[], [], [2, 3], [2, 4], [2, 4, 8, 12]]


def test_curves_are_drawn_with_logarithmic_axes() -> None:
    shown = Curves(label="triangles", x=(10.0, 100.0, 1000.0), columns={"a": (1.0, 10.0, 100.0), "b": (5.0, None, 5.0)})
    plot = plots.curves("A title", shown)
    places = [[tuple(map(float, point.split(","))) for point in line.points.split()] for line in plot.lines]
    (x0, y0), (x1, y1), (x2, y2) = places[0]
    assert (x1 - x0, y1 - y0) == pytest.approx((x2 - x1, y2 - y1)) and y0 > y1
    assert (x0, x2) == (plots.LEFT, plots.RIGHT) and (y0, y2) == (plots.BOTTOM, plots.TOP)
    assert len(places[1]) == 2
    assert [label for _, label in plot.marks] == ["10", "100", "1,000"]
    assert [label for _, label in plot.ticks] == ["1", "10", "100"]


@pytest.fixture
def tiny(tiny_scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let curves be measured of the tiny scene's ball, in small pictures of few frames."""
    scene = load_scene(tiny_scene)
    monkeypatch.setattr(curves, "load_scene", lambda _: scene)
    monkeypatch.setattr(curves, "SIZE", (64, 48))
    monkeypatch.setattr(curves, "FRAMES", 2)
    monkeypatch.setattr(curves, "MIDDLE", 20)


def is_whole(table: Table, rows: int) -> None:
    assert len(table.rows) == rows and all(len(row) == len(table.columns) for row in table.rows)
    assert table.curves is not None and len(table.curves.x) == rows
    assert all(len(column) == rows for column in table.curves.columns.values())
    assert len(re.findall(r"dpci and \S+ (?:never cost the same|cost the same at [\d, ]+)", to_text(table))) == 3


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.usefixtures("tiny")
def test_the_curves_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """More triangles, objects and pixels in every row; what got too slow is not measured with more."""
    table = curves.over_pixels(silent, (32, 16))
    is_whole(table, 2)
    assert table.curves is not None and table.curves.x[0] < table.curves.x[1]
    flips: list[Any] = list(table.rows[1][5:])
    assert len(flips) == 4 and all(0 <= flip < 0.5 for flip in flips)
    monkeypatch.setattr(curves, "SLOW", -np.inf)  # costs are differences, which may be negative
    table = curves.over_objects(silent, (1, 4))
    is_whole(table, 2)
    assert [row[0] for row in table.rows] == ["1", "4"]
    assert all(cell is not None for cell in table.rows[0]) and all(cell is None for cell in table.rows[1][1:])


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.usefixtures("tiny")
def test_the_curve_over_triangles_is_that_of_the_meshes(monkeypatch: pytest.MonkeyPatch) -> None:
    meshes = [sphere(1.0, columns=8 * n, rows=4 * n) for n in (1, 2)]
    monkeypatch.setattr(curves, "_series", lambda library, most: meshes)
    table = curves.over_triangles(silent)
    is_whole(table, 2)
    assert [row[0] for row in table.rows] == [f"{len(mesh.faces)}" for mesh in meshes]


def test_the_meshes_have_four_times_as_many_triangles_each(tiny_scene: Path) -> None:
    scene = load_scene(tiny_scene)
    counts = [len(mesh.faces) for mesh in curves._series(SceneLibrary(scene.assets), 70_000)]
    assert counts[0] >= 1000 and counts[-1] <= 70_000 < 4 * counts[-1]
    assert all(3.5 < more / fewer < 4.5 for fewer, more in pairwise(counts)) and len(counts) == 3


def test_a_row_stands_about_the_origin(tiny_scene: Path) -> None:
    scene = row_of(load_scene(tiny_scene), 0, 3, 2.0)
    assert scene.objects.position.tolist() == [[-2, 0, 0], [0, 0, 0], [2, 0, 0]]
    assert scene.environment.ground is None
