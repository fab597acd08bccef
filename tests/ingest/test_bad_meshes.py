"""Every bad mesh is refused with one line that names the file and the defect."""

import os
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from depthwalk import limits
from depthwalk.errors import InputError
from depthwalk.ingest import formats, gltf, soup
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh_head import read_head

HOSTILE = Path(__file__).parent.parent / "hostile" / "meshes"
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"

MESSAGES = {
    "broken_texture.obj": "broken_texture.png: cannot be read as an image",
    "buffer_outside.gltf": "buffer_outside.gltf: buffer '../../../pyproject.toml' is missing or outside the folder",
    "empty.stl": "empty.stl: empty file",
    "face_not_a_number.obj": "face_not_a_number.obj:9: cannot read the face '1 two 3'",
    "face_of_two.obj": "face_of_two.obj:9: a face needs at least three corners",
    "index_before_start.obj": "index_before_start.obj:10: face refers to vertex -9 of 8",
    "index_out_of_range.obj": "index_out_of_range.obj:10: face refers to vertex 9 of 8",
    "index_out_of_range.ply": "index_out_of_range.ply: face 1 refers to vertex 7 of 0 to 3",
    "index_zero.obj": "index_zero.obj:9: face refers to vertex 0 of 8",
    "line.obj": "line.obj: flat: none of its 1 faces has an area",
    "no_data.gltf": "no_data.gltf: accessors[0]: compressed or empty data is not supported",
    "no_faces.obj": "no_faces.obj: no faces; lines alone are not drawn",
    "not_finite.obj": "not_finite.obj: all of its 2 triangles have NaN or infinite coordinates",
    "truncated.glb": "truncated.glb: truncated: 24 of 65535 bytes",
    "truncated.gltf": "truncated.gltf: its glTF header is not JSON: Expecting value: line 1 column 42 (char 41)",
    "truncated.ply": "truncated.ply: truncated: 2 of 4 PLY face elements",
    "truncated.stl": "truncated.stl: no faces",
    "unknown.xyz": "unknown.xyz: '.xyz' is not a mesh format (use .obj, .ply, .stl, .off, .glb, .gltf, .usd, "
    ".usda, .usdc, .usdz, .las, .laz, "
    ".fbx, .dae, .3ds, .3mf); save it as .ply",
    "vertex_of_two.obj": "vertex_of_two.obj:1: a vertex needs three numbers",
}


def refusal(path: Path, height: float | None = None) -> str:
    with pytest.raises(InputError) as caught:
        load_mesh(path, height=height)
    return str(caught.value)


def test_every_hostile_file_has_its_message() -> None:
    meshes = {path.name for path in HOSTILE.iterdir() if path.suffix not in (".mtl", ".png")}
    assert meshes == MESSAGES.keys()


@pytest.mark.parametrize("name", MESSAGES)
def test_message(name: str) -> None:
    assert refusal(HOSTILE / name) == f"{HOSTILE}{os.sep}{MESSAGES[name]}"


def test_missing_file_and_folder(tmp_path: Path) -> None:
    assert refusal(tmp_path / "gone.obj") == f"{tmp_path}/gone.obj: no such file"
    (tmp_path / "folder.obj").mkdir()
    assert refusal(tmp_path / "folder.obj") == f"{tmp_path}/folder.obj: is a folder"


@pytest.mark.parametrize("height", [0.0, -1.0, np.nan, np.inf])
def test_height_must_be_positive(tmp_path: Path, height: float) -> None:
    path = tmp_path / "t.obj"
    path.write_text(TETRAHEDRON)
    assert refusal(path, height=height) == f"{path}: height must be a positive number of metres, not {height}"


def test_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "t.obj"
    path.write_text(TETRAHEDRON)
    monkeypatch.setattr(soup, "MAX_MESH_TRIANGLES", 3)
    assert refusal(path) == f"{path}: too large: 4 triangles, the limit is 3"
    monkeypatch.setattr("depthwalk.ingest.sources.MAX_MESH_BYTES", 10)
    assert refusal(path) == f"{path}: too large: {len(TETRAHEDRON)} bytes, the limit is 10"


@pytest.mark.parametrize("scale", ["1e-200", "1e200"])
def test_unrepresentable_size(tmp_path: Path, scale: str) -> None:
    path = tmp_path / "t.obj"
    path.write_text(
        TETRAHEDRON.replace("1 0 0", f"{scale} 0 0").replace("0 1 0", f"0 {scale} 0").replace("0 0 1", f"0 0 {scale}")
    )
    assert refusal(path) == f"{path}: its extent of {float(scale):g} is out of range"


def test_binary_stl_cut_short(tmp_path: Path) -> None:
    path = tmp_path / "cut.stl"
    path.write_bytes(b"caf\xe9".ljust(80) + struct.pack("<I", 10) + bytes(75))
    assert refusal(path) == f"{path}: neither a whole binary STL file nor one of text"


def test_a_missing_buffer_is_told_of_once(caplog: pytest.LogCaptureFixture) -> None:
    read_head(HOSTILE / "buffer_outside.gltf")  # `load_mesh` refuses the file
    assert not caplog.records


@pytest.mark.parametrize("count", [0, -1, 3 * limits.MAX_MESH_TRIANGLES + 1])
def test_gltf_counts_are_checked_before_allocation(count: int) -> None:
    header = {"accessors": [{"bufferView": 0, "count": count}]}
    with pytest.raises(InputError, match=rf"^a\.gltf: accessors\[0\]: count {count} is out of range$"):
        gltf.check_header(header, Path("a.gltf"))


def test_gltf_extension_that_must_be_understood() -> None:
    with pytest.raises(InputError, match=r"^a\.glb: the required glTF extension KHR_audio_emitter is not sup"):
        gltf.check_header({"extensionsRequired": ["KHR_audio_emitter"]}, Path("a.glb"))


STARTS = st.sampled_from([
    b"", TETRAHEDRON.encode(), b"f 1 2 3\nv ", b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n",
    b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nend_header\n",
    b"solid x\nvertex 1 2 3\n",
    b'{"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {}}]}], "nodes": [{"mesh": 0}]}',
    b'{"nodes": [{"children": [0]}], "scenes": [{"nodes": [0]}]}', b'{"buffers": [1]}', b'{"images": 3}', b"[]",
    b"glTF\x02\x00\x00\x00\x14\x00\x00\x00\x00\x00\x00\x00JSON", bytes(80) + b"\x01\x00\x00\x00" + bytes(48),
])  # fmt: skip


@given(start=STARTS, rest=st.binary(max_size=200), suffix=st.sampled_from(formats.MESH_SUFFIXES))
def test_garbage_raises_nothing_but_input_errors(tmp_path: Path, start: bytes, rest: bytes, suffix: str) -> None:
    path = tmp_path / f"garbage{suffix}"
    path.write_bytes(start + rest)
    for act in (load_mesh, read_head):
        try:
            act(path)
        except InputError as error:
            assert "\n" not in str(error) and str(error).startswith(str(tmp_path))


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["a.obj", "a.off", "a.ply", "text.ply", "a.stl", "text.stl", "a.glb"])
def test_triangles_without_a_place_are_left_out(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, name: str, wrong: float
) -> None:
    """One vertex of a grid takes along the triangles around it, and nothing else."""
    y, x = np.mgrid[:4, :4]
    corner = np.arange(16).reshape(4, 4)
    square = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], -1).reshape(-1, 4)
    faces = square[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    places = np.stack([x, x * y, y], -1).reshape(-1, 3) + 1.0
    places[6, 1] = wrong
    mesh = trimesh.Trimesh(places, faces, process=False, validate=False)
    kind = name.split(".")[1] if not name.startswith("text") else {"ply": "ply", "stl": "stl_ascii"}[name[5:]]
    options = {"encoding": "ascii"} if name == "text.ply" else {}
    with np.errstate(invalid="ignore"):  # in normals that trimesh computes
        data: Any = mesh.export(file_type=kind, **options)
    (tmp_path / name).write_bytes(data.encode() if isinstance(data, str) else data)
    shown = load_mesh(tmp_path / name)
    assert len(shown.faces) == 12 and np.isfinite(shown.positions).all() and np.isfinite(shown.normals).all()
    np.testing.assert_allclose(np.ptp(shown.positions, axis=0), [3, 9, 3])
    assert "6 of 18 triangles have NaN or infinite coordinates; left out" in caplog.text
