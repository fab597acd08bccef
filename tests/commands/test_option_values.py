"""How the window draws what it is asked to open."""

from pathlib import Path

import pytest

from depthwalk.commands.option_values import open_files, open_scene, show_light_meshes
from depthwalk.scene.arrays import Representation

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def drawn_as(file: Path, settings: list[str] | None = None) -> Representation:
    scene = show_light_meshes(open_files([file], None, settings), settings)
    (kind,) = scene.objects.representation.tolist()
    return Representation(kind)


def test_a_light_mesh_by_itself_is_drawn_as_polygons(tmp_path: Path) -> None:
    (file := tmp_path / "light.obj").write_text(TRIANGLE)
    assert drawn_as(file) is Representation.MESH
    (kind,) = open_scene(file, None, None).objects.representation.tolist()
    assert kind != Representation.MESH


@pytest.mark.parametrize("setting", ["assets.model.dpci.layers=2", "objects.0.representation=auto"])
def test_depth_images_that_are_asked_for_are_drawn(tmp_path: Path, setting: str) -> None:
    (file := tmp_path / "light.obj").write_text(TRIANGLE)
    assert drawn_as(file, [setting]) is not Representation.MESH


def test_a_heavy_mesh_keeps_its_depth_images(tmp_path: Path) -> None:
    (file := tmp_path / "heavy.obj").write_text(TRIANGLE + "#" * (1 << 20))
    assert drawn_as(file) is not Representation.MESH


def test_a_scene_file_decides_by_itself(tmp_path: Path) -> None:
    (tmp_path / "light.obj").write_text(TRIANGLE)
    file = tmp_path / "scene.yaml"
    file.write_text("version: 1\nassets: {light: {mesh: light.obj, dpci: {}}}\nobjects: [{asset: light}]\n")
    assert drawn_as(file) is not Representation.MESH
