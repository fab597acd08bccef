"""Material libraries of OBJ files."""

import logging
from pathlib import Path

import pytest
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.material_library import MaterialLibrary
from depthwalk.ingest.mtl import material_libraries, parse_mtl
from depthwalk.ingest.sources import Sources


def test_terms_names_and_images() -> None:
    text = "Kd 1 1 1\nnewmtl a  b\n\tKd 0.1 0.2 0.3\nKs .5\nNs ten\nMap_Kd -clamp on  my picture.png \nnewmtl c # d\n"
    materials = parse_mtl(text)
    assert list(materials) == ["a b", "c # d"]
    assert materials["a b"].terms == {"kd": [0.1, 0.2, 0.3], "ks": 0.5}
    assert materials["a b"].image == "-clamp on  my picture.png"


def test_the_last_material_of_a_name_wins() -> None:
    assert parse_mtl("newmtl a\nNs 1\nnewmtl a\nKd 0 0 0\n")["a"].terms == {"kd": [0, 0, 0]}


@pytest.mark.parametrize(
    ("line", "found", "missing"),
    [
        ("mtllib a.mtl", ["a.mtl"], []),
        ("mtllib my own.mtl", ["my own.mtl"], []),
        ("mtllib a.mtl b.mtl", ["a.mtl", "b.mtl"], []),
        ("mtllib a.mtl gone.mtl", ["a.mtl"], ["gone.mtl"]),
        ("mtllib long gone.mtl\nmtllib a.mtl", ["a.mtl"], ["long gone.mtl"]),
        ("mtllib ../a.mtl", ["a.mtl"], []),
        ("mtllib ../../a/outside.mtl", [], ["../../a/outside.mtl"]),
    ],
)
def test_libraries_that_are_missing_are_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, line: str, found: list[str], missing: list[str]
) -> None:
    for name in ("a.mtl", "b.mtl", "my own.mtl"):
        (tmp_path / name).touch()
    libraries = material_libraries(f"{line}\nusemtl a\n".encode(), tmp_path / "m.obj", Sources())
    assert libraries == [tmp_path / name for name in found]
    start = f"{tmp_path / 'm.obj'}: "
    assert caplog.messages == [f"{start}{name!r} is missing or outside the folder; ignored" for name in missing]


def library(folder: Path, text: str) -> MaterialLibrary:
    (folder / "m.mtl").write_text(text)
    return MaterialLibrary.read([folder / "m.mtl"], folder / "a.obj", Sources())


def test_materials_are_converted_by_name(tmp_path: Path) -> None:
    Image.new("RGB", (1, 2), (1, 2, 3)).save(tmp_path / "p.png")
    materials = library(tmp_path, "newmtl a\nKd 0 0 0\nmap_Kd p.png\nnewmtl b\nKd 2 nan 0\n")
    textured, plain = materials.material("a"), materials.material("b")
    assert textured is not None and textured.texture is not None and plain is not None
    assert textured.base_colour == (1, 1, 1) and textured.texture[0, 0].tolist() == [1, 2, 3, 255]
    assert plain.base_colour == (0.8, 0.8, 0.8)
    assert materials.material("gone") is None and materials.material(None) is None


def test_materials_that_let_light_through_share_a_texture(tmp_path: Path) -> None:
    """Each copy would take as much memory as the picture, and be a texture and a draw of its own."""
    Image.new("RGBA", (1, 1), (1, 2, 3, 9)).save(tmp_path / "p.png")
    materials = library(tmp_path, "".join(f"newmtl {name}\nd 0.5\nmap_Kd p.png\n" for name in "abc"))
    textures = [material.texture for material in map(materials.material, "abc") if material is not None]
    assert len(textures) == 3 and len({id(each) for each in textures}) == 1
    assert textures[0] is not None and textures[0].tolist() == [[[1, 2, 3, 255]]]


def test_a_texture_that_is_no_picture_is_refused_even_if_unused(tmp_path: Path) -> None:
    (tmp_path / "p.png").write_bytes(b"no picture")
    with pytest.raises(InputError, match=r"p\.png: cannot be read as an image$"):
        library(tmp_path, "newmtl a\nmap_Kd p.png\n")


def test_what_has_no_name_of_a_picture_is_ignored_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "p.dat").write_bytes(b"no picture")
    with caplog.at_level(logging.WARNING):
        material = library(tmp_path, "newmtl a\nmap_Kd p.dat\n").material("a")
    assert material is not None and material.texture is None
    assert any("p.dat cannot be read as an image; ignored" in record.message for record in caplog.records)


def test_a_mask_cuts_out_where_it_is_the_alpha_of_the_texture(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    image = Image.new("RGBA", (2, 1), (9, 9, 9, 255))
    image.putpixel((1, 0), (9, 9, 9, 0))
    image.save(tmp_path / "p.png")
    text = (
        "newmtl leaf\nmap_Kd p.png\nmap_d p.png\nnewmtl whole\nmap_Kd p.png\nnewmtl other\nmap_Kd p.png\nmap_d q.png\n"
    )
    materials = library(tmp_path, text)
    leaf, whole, other = (materials.material(name) for name in ("leaf", "whole", "other"))
    assert leaf is not None and whole is not None and other is not None
    assert (leaf.cutoff, whole.cutoff, other.cutoff) == (0.5, None, None)
    assert [record.getMessage() for record in caplog.records] == [
        f"{tmp_path / 'a.obj'}: map_d q.png is ignored: it is not the picture of map_Kd"
    ]


def test_a_picture_of_what_glows(tmp_path: Path) -> None:
    Image.new("RGB", (1, 2), (1, 2, 3)).save(tmp_path / "p.png")
    lamp = library(tmp_path, "newmtl lamp\nKe 0 0 0\nmap_Ke p.png\n").material("lamp")
    assert lamp is not None and lamp.emission == (1, 1, 1) and lamp.texture is None
    assert lamp.emission_texture is not None and lamp.emission_texture[0, 0].tolist() == [1, 2, 3, 255]
