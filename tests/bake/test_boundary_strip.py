"""Boundary strips: the surface between the last samples and its edge. Areas are tested in test_baker.py."""

from collections.abc import Sequence

import numpy as np
import pytest

from depthwalk.bake.baker import cast_face, connect_face, trace_boundary_strips
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import BoundaryStrip, DepthImage, Face, enclosing_cylinder
from depthwalk.bake.params import BakeParams
from depthwalk.bake.raycast import RayCaster
from shapes import box

SIZE, STEPS = 32, 3


@pytest.fixture(scope="module")
def lid() -> tuple[FaceGrid, list[DepthImage], list[BoundaryStrip]]:
    """Grid, layers and strips of the top cap above a box that covers no whole number of texels."""
    mesh = box(1.0, 0.3, 0.7, (0, 0.15, 0))
    caster = RayCaster(mesh)
    grid = FaceGrid(cylinder=enclosing_cylinder(mesh.positions), face=Face.TOP, height=SIZE, width=SIZE)
    seen = cast_face(mesh, caster, grid, BakeParams(resolution=SIZE, layers=1))
    images = connect_face(caster, grid, seen, STEPS)
    return grid, images, trace_boundary_strips(caster, {Face.TOP: grid}, {Face.TOP: seen}, images)


def test_there_is_a_strip_for_every_level(lid: tuple[FaceGrid, Sequence[DepthImage], Sequence[BoundaryStrip]]) -> None:
    _, _, borders = lid
    assert [border.level for border in borders] == list(range(STEPS))
    assert all(len(border.triangles) for border in borders)


def test_vertices_lie_on_the_surface_within_a_cell_of_their_samples(
    lid: tuple[FaceGrid, Sequence[DepthImage], Sequence[BoundaryStrip]],
) -> None:
    grid, images, borders = lid
    for border in borders:
        points, _ = grid.border_points(images, border)
        np.testing.assert_allclose(points[:, 1], 0.3, atol=1e-3)
        assert (np.abs(points[:, 0]) < 0.5 + 1e-3).all() and (np.abs(points[:, 2]) < 0.35 + 1e-3).all()
        assert (np.abs(border.offset) <= 1 << border.level).all()


def test_the_finest_strip_reaches_the_edge(lid: tuple[FaceGrid, Sequence[DepthImage], Sequence[BoundaryStrip]]) -> None:
    grid, images, borders = lid
    points, _ = grid.border_points(images, borders[0])
    reach = 2 * grid.longest_texel / 64  # rounded to that
    assert np.abs(points[:, 0]).max() == pytest.approx(0.5, abs=reach)
    assert np.abs(points[:, 2]).max() == pytest.approx(0.35, abs=reach)


def test_triangles_begin_at_samples_and_all_vertices_are_used(
    lid: tuple[FaceGrid, Sequence[DepthImage], Sequence[BoundaryStrip]],
) -> None:
    _, images, borders = lid
    samples = sum(image.depth.size for image in images)
    solid = np.isfinite(np.concatenate([image.depth.ravel() for image in images]))
    for border in borders:
        assert (border.triangles[:, 0] < samples).all() and (np.diff(border.triangles[:, 0]) >= 0).all()
        ends = border.triangles[border.triangles >= samples] - samples
        np.testing.assert_array_equal(np.unique(ends), np.arange(len(border.start)))
        assert solid[border.triangles[border.triangles < samples]].all() and solid[border.start].all()


def test_what_another_face_owns_has_no_strip() -> None:
    mesh = box(1.0, 0.3, 0.7, (0, 0.15, 0))
    caster = RayCaster(mesh)
    grid = FaceGrid(cylinder=enclosing_cylinder(mesh.positions), face=Face.TOP, height=SIZE, width=SIZE)
    seen = cast_face(mesh, caster, grid, BakeParams(resolution=SIZE, layers=1))
    images = connect_face(caster, grid, seen, 1)
    for image in images:
        image.owner[:] = Face.SIDE
    (border,) = trace_boundary_strips(caster, {Face.TOP: grid}, {Face.TOP: seen}, images)
    assert len(border.triangles) == len(border.start) == 0
