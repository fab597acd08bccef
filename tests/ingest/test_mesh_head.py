"""Which files a mesh is made of and their hash, and what its head tells of materials."""

import json
from pathlib import Path

import pytest
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh_head import is_all_translucent, read_head
from depthwalk.ingest.sources import Sources, hash_files


def digest_of(path: Path, texture: Path | None = None, sources: Sources | None = None) -> str:
    sources = sources or Sources()
    return hash_files(read_head(path, texture, sources).files, sources)


def test_obj_libraries_and_textures(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "a.obj").write_text("mtllib lib/one.mtl gone.mtl\nmtllib two words.mtl\nv 0 0 0\n")
    (tmp_path / "lib/one.mtl").write_text("newmtl m\nmap_Kd beside.png\nnewmtl o\nmap_Kd ../../outside.png\n")
    (tmp_path / "two words.mtl").write_text("newmtl n\n  map_kd -clamp on top.png\n")
    for name in ("lib/beside.png", "top.png", "extra.png"):
        Image.new("RGB", (1, 1)).save(tmp_path / name)
    found = read_head(tmp_path / "a.obj", tmp_path / "extra.png").files
    names = [path.relative_to(tmp_path).as_posix() for path in found]
    assert names == ["a.obj", "lib/one.mtl", "two words.mtl", "lib/beside.png", "top.png", "extra.png"]


def test_gltf_buffers_and_images(tmp_path: Path) -> None:
    uris = {"buffers": [{"uri": "b%20c.bin"}, {"uri": "data:application/octet-stream;base64,AA=="}]}
    (tmp_path / "a.gltf").write_text(json.dumps({**uris, "images": [{"uri": "p.png"}, {"bufferView": 0}]}))
    (tmp_path / "b c.bin").write_bytes(b"1")
    (tmp_path / "p.png").write_bytes(b"2")
    assert [p.name for p in read_head(tmp_path / "a.gltf").files] == ["a.gltf", "b c.bin", "p.png"]


def test_ply_texture_and_missing_mesh(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(b"ply\r\ncomment TextureFile p.png\r\nend_header\r\n")
    (tmp_path / "p.png").write_bytes(b"2")
    assert [p.name for p in read_head(tmp_path / "a.ply").files] == ["a.ply", "p.png"]
    with pytest.raises(InputError, match=r"gone\.stl: no such file$"):
        read_head(tmp_path / "gone.stl")


def test_what_may_be_textured(tmp_path: Path) -> None:
    (tmp_path / "one.mtl").write_text("newmtl m\nmap_Kd p.png\n")
    (tmp_path / "two.mtl").write_text("newmtl m\nKd 1 0 0\n")
    contents = {
        "plain.obj": "v 0 0 0\n",
        "painted.obj": "mtllib two.mtl\nv 0 0 0\n",
        "textured.obj": "mtllib one.mtl\nv 0 0 0\n",
        "plain.gltf": "{}",
        "textured.gltf": json.dumps({"images": [{"bufferView": 0}]}),
        "plain.ply": "ply\nend_header\n",
        "textured.ply": "ply\ncomment TextureFile p.png\nend_header\n",
        "any.stl": "solid\n",
    }
    for name, text in contents.items():
        (tmp_path / name).write_text(text)
        assert read_head(tmp_path / name).is_textured == name.startswith("textured"), name
        assert read_head(tmp_path / name, tmp_path / "t.png").is_textured


def test_hash_follows_contents_not_names(tmp_path: Path) -> None:
    for name in ("a.obj", "b.obj"):
        (tmp_path / name).write_text("mtllib m.mtl\nv 0 0 0\n")
    (tmp_path / "m.mtl").write_text("newmtl m\n")
    before = digest_of(tmp_path / "a.obj")
    assert before == digest_of(tmp_path / "b.obj") and len(before) == 64
    (tmp_path / "m.mtl").write_text("newmtl changed\n")
    assert digest_of(tmp_path / "a.obj") != before


def test_a_mesh_is_of_the_bytes_that_were_hashed(tmp_path: Path) -> None:
    """Whatever of its files is replaced, removed or added after its hash was taken."""
    (tmp_path / "m.mtl").write_text("newmtl m\nmap_Kd p.png\n")
    (tmp_path / "a.obj").write_text(
        "mtllib m.mtl late.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n"
    )
    Image.new("RGB", (1, 1), (1, 2, 3)).save(tmp_path / "p.png")
    Image.new("RGB", (1, 1), (4, 5, 6)).save(tmp_path / "t.png")
    for texture, colour in ((None, [1, 2, 3, 255]), (tmp_path / "t.png", [4, 5, 6, 255])):
        sources = Sources()
        before = digest_of(tmp_path / "a.obj", texture, sources)
        held = {name: (tmp_path / name).read_bytes() for name in ("m.mtl", "a.obj", "p.png", "t.png")}
        (tmp_path / "a.obj").write_text("v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n")
        (tmp_path / "m.mtl").unlink()
        (tmp_path / "late.mtl").write_text("newmtl m\nKd 1 0 0\n")
        Image.new("RGB", (1, 1), (9, 9, 9)).save(tmp_path / "p.png")
        (tmp_path / "t.png").unlink()
        mesh = load_mesh(tmp_path / "a.obj", texture=texture, sources=sources)
        assert mesh.bounds[1][1] == 1
        (material,) = mesh.materials
        assert material.texture is not None and material.texture[0, 0].tolist() == colour
        (tmp_path / "late.mtl").unlink()
        for name, data in held.items():
            (tmp_path / name).write_bytes(data)
        assert digest_of(tmp_path / "a.obj", texture) == before


def test_pictures_of_what_glows_belong_to_a_mesh_and_are_no_texture(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Ke glow.png\n")
    Image.new("RGB", (1, 1)).save(tmp_path / "glow.png")
    assert [path.name for path in read_head(tmp_path / "a.obj").files] == ["a.obj", "a.mtl", "glow.png"]
    assert not read_head(tmp_path / "a.obj").is_textured


@pytest.mark.parametrize(
    ("library", "through", "glow"),
    [
        ("d 1.000\nTr 0\nKe 0.0 0 0\nillum 2\n", False, False),
        ("d 0.25\n", True, False),
        ("Tr 0.9\n", True, False),
        ("Tr 1\n", False, False),
        ("Ke 0 0 .5\n", False, True),
        ("map_Ke p.png\n", False, True),
        ("d -halo\nKe red\n", False, False),
    ],
)
def test_heads_of_files_tell_what_is_not_opaque(tmp_path: Path, library: str, through: bool, glow: bool) -> None:
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n")
    (tmp_path / "a.mtl").write_text(f"newmtl m\n{library}")
    head = read_head(tmp_path / "a.obj")
    assert (head.is_translucent, head.has_glow) == (through, glow)
    assert head.is_all_translucent == is_all_translucent(tmp_path / "a.obj") == through
    (tmp_path / "a.mtl").write_text(f"newmtl m\n{library}newmtl n\nKd 1 1 1\n")
    mixed = read_head(tmp_path / "a.obj")
    assert mixed.is_translucent == through and not mixed.is_all_translucent


def test_a_malformed_gltf_header_is_told_of(tmp_path: Path) -> None:
    """Whatever of it is asked first; one whose primitives make no sense is left to those who read the mesh."""
    for header in ({"images": 3}, {"buffers": ["x"]}):
        (tmp_path / "a.gltf").write_text(json.dumps(header))
        with pytest.raises(InputError, match=r"a\.gltf: its glTF header is malformed$"):
            read_head(tmp_path / "a.gltf")
        assert not is_all_translucent(tmp_path / "a.gltf")
    (tmp_path / "a.gltf").write_text(json.dumps({"meshes": [{"primitives": [{"material": 7}]}]}))
    assert not read_head(tmp_path / "a.gltf").is_all_translucent and not is_all_translucent(tmp_path / "gone.obj")
