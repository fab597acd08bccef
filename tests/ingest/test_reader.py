"""Mesh files of every format as one list of triangles."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.sources import Sources

QUADS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def obj(folder: Path, text: str) -> Path:
    path = folder / "a.obj"
    path.write_text(text)
    return path


def test_polygons_become_fans(tmp_path: Path) -> None:
    soup = read_soup(obj(tmp_path, QUADS + "v -1 0.5 0\nf 1 2 3 4 5\n"))
    assert len(soup.faces) == 3 and len(soup.positions) == 5
    first = soup.positions[soup.faces[:, 0]]
    assert (first == first[0]).all()  # all begin at the polygon's first corner


def test_corners_that_differ_in_texture_are_different_vertices(tmp_path: Path) -> None:
    soup = read_soup(obj(tmp_path, QUADS + "vt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 3/1 4/1\n"))
    assert len(soup.positions) == 5 and np.isfinite(soup.uv).all()


def test_what_the_file_has_not_is_nan_or_white(tmp_path: Path) -> None:
    soup = read_soup(obj(tmp_path, QUADS + "f 1 2 3\n"))
    assert np.isnan(soup.normals).all() and np.isnan(soup.uv).all() and (soup.colours == 255).all()


def test_materials_are_shared_by_groups_without_one(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl red\nKd 1 0 0\n")
    text = QUADS + "mtllib a.mtl\nusemtl none\nf 1 2 3\nusemtl red\nf 1 3 4\nusemtl other\nf 1 2 4\n"
    soup = read_soup(obj(tmp_path, text))
    assert sorted(material.base_colour for material in soup.materials) == [(0.8, 0.8, 0.8), (1, 0, 0)]
    red = [material.base_colour for material in soup.materials].index((1, 0, 0))
    assert np.count_nonzero(soup.material == red) == 1


def test_files_are_read_once(tmp_path: Path) -> None:
    path, sources = obj(tmp_path, QUADS + "f 1 2 3\n"), Sources()
    first = read_soup(path, sources)
    path.write_text("f 1 2 3\n")
    assert (read_soup(path, sources).positions == first.positions).all()


@pytest.mark.parametrize(("name", "defect"), [("a.txt", "is not a mesh format"), ("a.stl", "empty file")])
def test_what_cannot_be_read(tmp_path: Path, name: str, defect: str) -> None:
    (tmp_path / name).touch()
    with pytest.raises(InputError, match=defect):
        read_soup(tmp_path / name)


def test_a_file_of_another_kind_is_no_ply(tmp_path: Path) -> None:
    path = tmp_path / "really_an_obj.ply"
    path.write_text("v 0 0 0\nf 1 1 1\n")
    with pytest.raises(InputError, match=r"really_an_obj\.ply: not a PLY file$"):
        read_soup(path)


@pytest.mark.parametrize(
    ("name", "data", "kind", "right"),
    [
        ("a.obj", b"glTF\2\0\0\0", "GLB", "a.glb"),
        ("a.GLB", b"ply\nformat ascii 1.0\n", "PLY", "a.ply"),
        ("a.b.stl", b"ply\r\n", "PLY", "a.b.ply"),
        ("a.obj", bytes(80) + b"\1\0\0\0" + bytes(50), "STL", "a.stl"),
        ("a.ply", b"solid a\nfacet normal 0 0 1\n", "STL", "a.stl"),
        ("a.obj", b"\x89PNG\r\n", "PNG", "a.png"),
        ("a.ply", b"LASF" + bytes(100) + b"\3", "LAS", "a.las"),
        ("a.glb", b"LASF" + bytes(100) + b"\x83", "LAZ", "a.laz"),
        ("a.glb", b"Kaydara FBX Binary  ", "FBX", "a.fbx"),
        ("a.glb", b"; FBX 7.4.0 project file", "FBX", "a.fbx"),
        ("a.fbx", b'<?xml version="1.0"?><COLLADA>', "DAE", "a.dae"),
        ("a.dae", b"MM\x0a\0\0\0\2\0\3\0", "3DS", "a.3ds"),
    ],
)
def test_a_file_under_a_wrong_name_is_told_its_right_one(
    tmp_path: Path, name: str, data: bytes, kind: str, right: str
) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError) as error:
        read_soup(tmp_path / name)
    assert str(error.value) == f"{tmp_path / name}: holds {kind} data; rename it to {right}"
