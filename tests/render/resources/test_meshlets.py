"""Patches of a mesh: nothing that can be seen is left out, much of the rest is."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy import void

from depthwalk.geometry.quaternions import rotate
from depthwalk.ingest.mesh import Material, Mesh, Part
from depthwalk.render.passes import mesh as mesh_pass
from depthwalk.render.resources.meshlets import SIZE, Meshlets, build_meshlets
from depthwalk.render.resources.placed_records import placed_records
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.types import Rows
from shapes import ShapeLibrary, joined, scene_of, sphere
from stage import OnScreen, view_of
from studio import Studio

PLACED = (0, (1.0, 2.0, -3.0), 0.7, 1.5)


def bumpy(columns: int = 200, rows: int = 100) -> Mesh:
    """A ball with knobs that hide each other."""
    ball = sphere(1.0, columns, rows)
    out = ball.normals.astype(float)
    height = 1 + 0.1 * np.sin(9 * out[:, :1]) * np.cos(7 * out[:, 1:2] + 3 * out[:, 2:])
    return replace(ball, positions=(out * height + [0, 1, 0]).astype(np.float32))


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return bumpy()


@pytest.fixture(scope="module")
def meshlets(mesh: Mesh) -> Meshlets:
    meshlets = build_meshlets(mesh)
    assert meshlets is not None
    return meshlets


def views(count: int = 40) -> Iterator[View]:
    """Random ones of what is placed, from within it to far off."""
    rng = np.random.default_rng(5)
    middle = np.add(PLACED[1], (0, PLACED[3], 0))
    for _ in range(count):
        away = rng.normal(size=3)
        away *= PLACED[3] * rng.uniform(0.2, 4) / np.linalg.norm(away)
        target = middle + rng.normal(size=3) * PLACED[3]
        yield View(Camera(tuple(middle + away), tuple(target), rng.uniform(0.2, 1.5)), (320, 240))


def seen_triangles(mesh: Mesh, view: View, placed: void, solid: bool) -> Rows:
    """Rows of triangles with a corner in the frustum, where `solid` seen from the front."""
    corners = placed["scale"] * rotate(placed["rotation"][None].astype(float), mesh.positions.astype(float))
    corners = (corners + placed["origin"])[mesh.faces]  # from the viewer
    right, up, forward = np.moveaxis(corners @ view.axes.T, -1, 0)
    inside = (forward > 0) & (np.abs(right) < forward * view.half_extent[0])
    seen = (inside & (np.abs(up) < forward * view.half_extent[1])).any(1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front = np.einsum("ij,ij->i", normals, corners[:, 0]) < -1e-9
    return np.flatnonzero(seen & (front | (not solid)))


@pytest.mark.slow
def test_each_triangle_is_in_one_patch_of_its_part(mesh: Mesh) -> None:
    two = joined(mesh, bumpy(120, 60))
    parts = Part(0, len(mesh.faces), 0), Part(len(mesh.faces), len(two.faces) - len(mesh.faces), 0)
    meshlets = build_meshlets(replace(two, parts=parts))
    for number, part in enumerate(parts):
        of_part = slice(part.first_face, part.first_face + part.face_count)
        assert meshlets is not None
        faces = meshlets.vertices[meshlets.of_parts(parts)[of_part]]
        assert sorted(map(tuple, faces)) == sorted(map(tuple, two.faces[of_part]))
        seen = meshlets.vertices[meshlets.faces[meshlets.part == number].reshape(-1, 3)]
        assert {*map(tuple, seen)} - {(meshlets.vertices[0],) * 3} == {*map(tuple, faces)}  # less what fills them up
    assert meshlets is not None
    assert (np.diff(meshlets.part) >= 0).all()


def test_vertices_lie_in_the_order_of_their_use(mesh: Mesh, meshlets: Meshlets) -> None:
    _, first = np.unique(meshlets.of_parts(mesh.parts), return_index=True)
    assert (np.diff(first) > 0).all() and len(first) == len(meshlets.vertices)


@pytest.mark.slow
@pytest.mark.parametrize("solid", [True, False])
def test_what_can_be_seen_is_drawn(mesh: Mesh, meshlets: Meshlets, solid: bool) -> None:
    kept, needed = 0, 0
    of_mesh = meshlets.vertices[meshlets.faces]
    patch = {tuple(face): row for row, faces in enumerate(of_mesh) for face in faces}
    for view in views():
        placed = placed_records(view.position, scene_of(PLACED).objects)[0]
        rows = meshlets.seen(view, placed, solid)
        seen = seen_triangles(mesh, view, placed, solid)
        assert {patch[tuple(mesh.faces[row])] for row in seen} <= set(rows.tolist())
        kept, needed = kept + SIZE * len(rows), needed + len(seen)
    assert needed < kept < (2.2 if solid else 1.7) * needed


def test_small_meshes_are_not_divided() -> None:
    assert build_meshlets(sphere(1.0, 32, 16)) is None


def test_pictures_do_not_change(studio: Studio, mesh: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two solids and an open shell, of two materials, one of them textured; from near, from within and from afar."""
    half = len(mesh.faces) // 2
    texture = np.random.default_rng(1).integers(0, 255, (16, 16, 4), np.uint8)
    uv = mesh.normals[:, :2] * 3
    parts = Part(0, half, 0), Part(half, len(mesh.faces) - half, 1)
    painted = replace(mesh, uv=uv, parts=parts, materials=(Material((1, 1, 1)), Material((1, 1, 1), texture=texture)))
    shell = replace(mesh, faces=mesh.faces[half:], parts=(Part(0, len(mesh.faces) - half, 0),))
    plain = replace(mesh, colours=np.full_like(mesh.colours, 255), materials=(Material((0.2, 0.5, 0.8)),))
    library = ShapeLibrary([painted, shell, plain], [None] * 3)
    scene = scene_of(PLACED, (1, (-2, 0, 0), 1.0, 1.0), (2, (0, 0, -6), 2.0, 1.2), representation=Representation.MESH)
    drawn = []
    for most in (mesh_pass._CULLED_OBJECTS, 0):
        monkeypatch.setattr(mesh_pass, "_CULLED_OBJECTS", most)
        with OnScreen(studio.device, scene, library) as stage:
            for position in ((0, 1.6, 5), (-1, 1, 0.9), (-2, 1, 0), (0, 9, -3.1), (0, 1.6, 40)):
                stage.draw(view_of(position, (-0.5, 1.0, -2.0)))
                drawn.append(np.frombuffer(stage.screen.read(components=4), np.uint8))
    for with_meshlets, whole in zip(drawn[:5], drawn[5:], strict=True):
        assert np.ptp(whole) > 50
        np.testing.assert_array_equal(with_meshlets, whole)


def test_more_than_the_buffer_holds_is_drawn_whole(studio: Studio, mesh: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH)
    pictures = []
    for room in (mesh_pass._MAX_CULLED_TRIANGLES, 100):
        monkeypatch.setattr(mesh_pass, "_MAX_CULLED_TRIANGLES", room)
        pictures.append(studio.picture(scene, ShapeLibrary([mesh], [None]), Camera((0, 1, 4), (0, 1, 0), 0.7)))
    np.testing.assert_array_equal(pictures[0], pictures[1])
