"""Simplified meshes: what they look like, how far off they say they are, and which of them is drawn."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.bake.levels import mesh_levels
from depthwalk.bake.params import FEWEST, RATIOS
from depthwalk.geometry.triangles import face_normals
from depthwalk.ingest.mesh import Mesh, MeshLevel, Part
from depthwalk.ingest.solid import is_solid
from depthwalk.render.lod.mesh_lod import mesh_level
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Objects, Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset
from depthwalk.types import Array
from shapes import ShapeLibrary, box, joined, mesh_of, scene_of, sphere
from studio import Studio


def seamless(mesh: Mesh) -> Mesh:
    """With the two ends of the seam at exactly the same places."""
    return replace(mesh, positions=np.round(mesh.positions, 5))


@pytest.fixture(scope="module")
def ball() -> Mesh:
    return seamless(sphere(1.0, columns=256, rows=128))


@pytest.fixture(scope="module")
def levels(ball: Mesh) -> tuple[MeshLevel, ...]:
    return mesh_levels(ball)


@pytest.mark.slow
def test_levels_are_ever_coarser(ball: Mesh, levels: tuple[MeshLevel, ...]) -> None:
    assert levels[0].mesh is ball and levels[0].error == 0
    assert len(levels) == len(RATIOS) + 1
    for level, ratio in zip(levels[1:], RATIOS, strict=True):
        assert 0.9 * FEWEST <= len(level.mesh.faces) <= max(1.05 * len(ball.faces) / ratio, FEWEST)
    errors = [level.error for level in levels]
    assert errors == sorted(errors) and errors[1] > 0


@pytest.mark.slow
def test_the_error_is_how_far_a_sphere_bulges_out_of_its_facets(levels: tuple[MeshLevel, ...]) -> None:
    for level in levels[2:]:
        corners = level.mesh.positions[level.mesh.faces].astype(float) - [0, 1, 0]
        normals, _ = face_normals(corners)
        bulge = 1 - np.einsum("ij,ij->i", corners[:, 0], normals)
        assert 0.9 * np.percentile(bulge, 99) < level.error < 1.1 * bulge.max()


@pytest.mark.slow
def test_looks_come_from_the_surface_nearby() -> None:
    red, blue = sphere(1.0, 64, 32, colour=(255, 0, 0)), sphere(1.0, 64, 32, colour=(0, 0, 255))
    red, blue = seamless(red), seamless(replace(blue, positions=blue.positions + np.array([3, 0, 0], np.float32)))
    both = joined(red, blue)
    half = len(red.faces)
    other = replace(both.materials[0], shininess=5.0)
    both = replace(both, parts=(Part(0, half, 1), Part(half, len(blue.faces), 0)), materials=(*both.materials, other))
    coarse = mesh_levels(both)[2].mesh
    right = coarse.positions[:, 0] > 1.5
    assert (coarse.colours[right] == (0, 0, 255)).all() and (coarse.colours[~right] == (255, 0, 0)).all()
    centre = np.where(right[:, None], [3, 1, 0], [0, 1, 0])
    assert (np.einsum("ij,ij->i", coarse.normals, coarse.positions - centre) > 0.9).all()
    assert sum(part.face_count for part in coarse.parts) == len(coarse.faces)
    for part in coarse.parts:
        faces = coarse.faces[part.first_face : part.first_face + part.face_count]
        assert (right[faces] == (part.material == 0)).all()


@pytest.mark.slow
def test_texture_coordinates_keep_their_side_of_a_seam(ball: Mesh) -> None:
    columns = 257
    u = np.tile(np.arange(columns) / 256, len(ball.positions) // columns).astype(np.float32)
    fine = mesh_levels(replace(ball, uv=np.stack([u, u], -1)))[1].mesh
    across = np.ptp(fine.uv[fine.faces, 0], axis=1) > 0.5
    away = np.abs(fine.positions[:, 1] - 1) < 0.9  # at a pole all meridians meet
    assert across[away[fine.faces].all(1)].mean() < 0.012  # those that lie across the seam themselves


def test_few_triangles_have_no_levels() -> None:
    assert len(mesh_levels(box(1, 1, 1))) == 1


def objects_at(distance: Sequence[float] | Array, representation: Representation = Representation.MESH_LOD) -> Objects:
    count = len(distance)
    position = np.zeros((count, 3), np.float32)
    position[:, 2] = -np.asarray(distance)
    rotation = np.tile(np.array([0, 0, 0, 1], np.float32), (count, 1))
    scale = np.linspace(0.5, 2, count, dtype=np.float32)
    return Objects(
        asset=np.zeros(count, np.int32),
        position=position,
        rotation=rotation,
        scale=scale,
        representation=np.full(count, representation, np.uint8),
    )


def test_the_level_is_the_coarsest_within_the_error() -> None:
    errors = np.array([[0, 0.001, 0.004, 0.02, 0.1, np.inf]])
    view = View(Camera((0, 0, 0), (0, 0, -1), 1.0), (640, 480))
    objects = objects_at(np.geomspace(0.2, 3000, 200))
    nearest = np.maximum(-objects.position[:, 2] / objects.scale - 0.8, 0)
    level = mesh_level(view, objects, nearest, errors, 1.5)
    pixels = errors[0] * view.focal_pixels / np.maximum(nearest, 1e-9)[:, None]
    drawn = np.take_along_axis(pixels, level[:, None], 1)[:, 0]
    coarser = np.take_along_axis(pixels, level[:, None] + 1, 1)[:, 0]
    outside = nearest > 0
    assert (drawn[outside] <= 1.5).all() and (coarser[outside] > 1.5).all()
    assert (level[~outside] == 0).all() and (~outside).any()  # the viewer may be at the surface
    assert set(level) == {0, 1, 2, 3, 4}
    plain = objects_at([3000.0], Representation.MESH)
    assert mesh_level(view, plain, np.array([3000.0]), errors, 1.5) == [0]


def test_without_error_the_picture_is_that_of_the_mesh(studio: Studio, ball: Mesh) -> None:
    library, camera = ShapeLibrary([ball], [None]), Camera((0, 1.5, 12), (0, 1, 0), 0.5)
    pictures, triangles = [], []
    for representation, error in ((Representation.MESH, 1), (Representation.MESH_LOD, 0), (Representation.MESH_LOD, 1)):
        scene = scene_of((0, (0, 0, 0), 0.3, 1.0), (0, (2.5, 0, -60), 0.0, 1.0), representation=representation)
        scene.render.mesh.error = error
        pixels, _, plan = studio.measured(scene, library, camera)
        pictures.append(pixels)
        triangles.append(plan.counts["mesh_triangles"])
        assert plan.counts["mesh"] == 2
    assert triangles[0] == triangles[1] == 2 * len(ball.faces)
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert triangles[2] < 0.1 * triangles[0]
    assert 0 < np.abs(pictures[2] - pictures[0]).mean() < 2e-3


def test_what_is_out_of_sight_is_not_drawn(studio: Studio, ball: Mesh) -> None:
    placed = [(0, (40.0 * k, 0, 0), 0.0, 1.0) for k in range(-3, 4)]
    scene = scene_of(*placed, representation=Representation.MESH)
    _, _, plan = studio.measured(scene, ShapeLibrary([ball], [None]), Camera((0, 1, 10), (0, 1, 0), 0.5))
    assert plan.counts["mesh"] == 1


def turned_inside_out(mesh: Mesh) -> Mesh:
    return replace(mesh, faces=mesh.faces[:, ::-1].copy())


@pytest.mark.parametrize(
    ("mesh", "solid"),
    [
        (box(1, 2, 3), True),
        (joined(box(1, 2, 3), box(1, 1, 1, centre=(5, 0, 0))), True),
        (turned_inside_out(box(1, 2, 3)), False),
        (replace(box(1, 2, 3), faces=box(1, 2, 3).faces[:-1]), False),
        (replace(box(1, 2, 3), faces=np.vstack([box(1, 2, 3).faces[:-1], box(1, 2, 3).faces[-1:, ::-1]])), False),
    ],
    ids=["box", "two", "inside out", "a face missing", "a face turned"],
)
def test_only_solids_hide_their_back_faces(mesh: Mesh, solid: bool) -> None:
    assert is_solid(mesh) is solid


def test_back_faces_of_a_solid_do_not_matter(studio: Studio) -> None:
    block = box(1.0, 1.0, 1.0, centre=(0, 0.5, 0))
    speck = mesh_of([[0, 0.5, 0], [0.1, 0.5, 0], [0, 0.6, 0]], [[0, 1, 2]], np.tile([0.0, 0, 1], (3, 1)))
    scene, camera = (
        scene_of((0, (0, 0, 0), 0.4, 1.0), representation=Representation.MESH),
        Camera((1, 2, 3), (0, 0.5, 0), 0.6),
    )
    pictures = [studio.picture(scene, ShapeLibrary([mesh], [None]), camera) for mesh in (block, joined(block, speck))]
    np.testing.assert_array_equal(pictures[0], pictures[1])


@pytest.mark.slow
def test_levels_are_kept_and_found_again(tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assets = load_scene(tiny_scene).assets
    stages: list[str] = []
    made = SceneLibrary(assets, lambda name, stage: stages.append(stage)).mesh_levels(0)
    assert stages == ["reading", "simplifying"]
    found = SceneLibrary(assets, lambda name, stage: stages.append(stage)).mesh_levels(0)
    assert stages[2:] == ["reading"]
    assert [level.error for level in found] == [level.error for level in made]
    for one, other in zip(made[1:], found[1:], strict=True):
        assert one.mesh.parts == other.mesh.parts
        for name in ("positions", "normals", "colours", "uv", "faces"):
            np.testing.assert_array_equal(getattr(one.mesh, name), getattr(other.mesh, name))
    (file,) = (tmp_path / "cache").rglob("*.levels.npz")
    file.write_bytes(file.read_bytes()[:-200])
    SceneLibrary(assets, lambda name, stage: stages.append(stage)).mesh_levels(0)
    assert stages[3:] == ["reading", "simplifying"]


def test_a_full_disk_costs_nothing_but_time(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def two_levels(mesh: Mesh) -> tuple[MeshLevel, ...]:
        return MeshLevel(mesh, 0.0), MeshLevel(mesh, 0.1)

    def full(*arguments: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr("depthwalk.cache.write_arrays", full)
    monkeypatch.setattr("depthwalk.bake.levels.mesh_levels", two_levels)
    assert len(SceneLibrary(load_scene(tiny_scene).assets).mesh_levels(0)) == 2
    assert "cannot store the simplified meshes of ball in the cache: no space left" in caplog.text


def test_relief_has_no_levels(monkeypatch: pytest.MonkeyPatch) -> None:
    library = SceneLibrary((cast(MeshAsset, SimpleNamespace()),))  # neither kind of asset has to be read
    monkeypatch.setattr(library, "mesh", lambda asset: None)
    assert library.mesh_levels(0) == ()


def test_a_scene_file_may_ask_for_it(tiny_scene: Path) -> None:
    tiny_scene.write_text(tiny_scene.read_text().replace("{asset: ball}", "{asset: ball, representation: mesh-lod}"))
    assert load_scene(tiny_scene).objects.representation.tolist() == [Representation.MESH_LOD]
