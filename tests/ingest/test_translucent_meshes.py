"""Meshes with parts that let light through: what is kept apart, drawn opaque, and not baked."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.loader import check_height, check_mesh, load_mesh
from files import written

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


def half_of_glass(folder: Path, dissolve: float = 0.5) -> Path:
    written(folder / "m.mtl", f"newmtl glass\nd {dissolve}\nnewmtl stone\nKd 1 1 1\nnewmtl lamp\nKe 1 1 0\n")
    faces = "usemtl glass\nf 1 2 3\nusemtl stone\nf 1 2 4\nf 1 3 4\nusemtl lamp\nf 2 3 4\n"
    return written(folder / "half.obj", f"mtllib m.mtl\n{TETRAHEDRON}{faces}")


def test_what_lets_light_through_is_kept_apart(tmp_path: Path) -> None:
    mesh = load_mesh(half_of_glass(tmp_path))
    (part,) = mesh.translucent_parts
    assert (len(mesh.faces), len(mesh.translucent_faces), part.face_count) == (3, 1, 1)
    assert mesh.materials[part.material].opacity == 0.5 and mesh.is_translucent
    assert sorted(mesh.materials[each.material].emission for each in mesh.parts) == [(0, 0, 0), (1, 1, 0)]
    assert sum(each.face_count for each in mesh.parts) == 3


def test_too_much_that_lets_light_through_is_drawn_opaque(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("depthwalk.ingest.loader.MAX_TRANSLUCENT_TRIANGLES", 0)
    path = half_of_glass(tmp_path)
    mesh = load_mesh(path)
    assert (len(mesh.faces), len(mesh.translucent_faces)) == (4, 0)
    assert caplog.messages == [f"{path}: 1 triangles are see-through, more than 0; they are drawn opaque"]


def test_a_mesh_of_nothing_but_glass_is_drawn_and_not_baked(tmp_path: Path) -> None:
    written(tmp_path / "m.mtl", "newmtl glass\nd 0.5\n")
    path = written(tmp_path / "pane.obj", f"mtllib m.mtl\n{TETRAHEDRON}usemtl glass\nf 1 2 3\n")
    mesh = load_mesh(path)
    assert len(mesh.faces) == 0 and np.ptp(mesh.bounds, axis=0).tolist() == [1, 1, 0]
    check_mesh(path)
    refused = pytest.raises(
        InputError, match=r"pane\.obj: nothing of it is opaque; draw it as polygons, without 'dpci'"
    )
    with refused:
        check_height(mesh, path)
    with refused:
        check_mesh(path, upright=True)


def test_glass_that_is_drawn_opaque_can_be_baked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What checks a mesh says so too."""
    monkeypatch.setattr("depthwalk.ingest.loader.MAX_TRANSLUCENT_TRIANGLES", 0)
    written(tmp_path / "m.mtl", "newmtl glass\nd 0.5\n")
    path = written(tmp_path / "pane.obj", f"mtllib m.mtl\n{TETRAHEDRON}usemtl glass\nf 1 2 3\n")
    check_height(load_mesh(path), path)
    check_mesh(path, upright=True)
