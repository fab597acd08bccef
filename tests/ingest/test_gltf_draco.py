"""glTF files compressed by Draco, which read as they do without compression."""

import logging
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthwalk.conversion.gltf import convert_gltf
from depthwalk.errors import InputError
from depthwalk.ingest.draco import decoder
from depthwalk.ingest.draco.decoder import DracoStream, decode
from depthwalk.ingest.gltf import read_header
from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.soup import Soup
from depthwalk.limits import MAX_MESH_TRIANGLES
from draco_files import DRACO, compressed, ids, stream
from glb_files import HALVES, SQUARE, Glb

pytest.importorskip("DracoPy")

FLAT = SQUARE.astype(np.float32)
NORMALS = np.array([(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0.6, 0.8)], np.float32)
UV = np.array([(0, 0), (0.25, 0), (1, 0.5), (0, 2)], np.float32)
COLOURS = np.array([(0, 1, 2, 255), (128, 0, 7, 255), (255, 255, 0, 255), (9, 90, 200, 255)], np.uint8)
JOINTS = np.array([(0, 1, 0, 0), (1, 0, 0, 0), (0, 0, 0, 0), (1, 0, 0, 0)], np.uint8)
WEIGHTS = np.array([(0.5, 0.5, 0, 0), (1, 0, 0, 0), (1, 0, 0, 0), (1, 0, 0, 0)], np.float32)


def read(glb: Glb, tmp_path: Path, *nodes: dict[str, Any]) -> Soup:
    """What is read, with texture coordinates where there are any; these need a material, but no picture."""
    glb.header["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    for primitive in glb.header["meshes"][0]["primitives"]:
        primitive["material"] = 0
    return read_soup(glb.write(tmp_path / "a.glb", *nodes))


def plain(attributes: dict[str, np.ndarray]) -> Glb:
    """The same mesh without compression."""
    glb = Glb()
    more = {name: {"normalized": True} for name, values in attributes.items() if values.dtype.kind == "u"}
    more.pop("JOINTS_0", None)
    glb.mesh(
        {name: glb.accessor(values, values.dtype.str[1:], **more.get(name, {})) for name, values in attributes.items()}
    )
    return glb


def assert_same(found: Soup, expected: Soup) -> None:
    for name in ("positions", "normals", "colours", "uv", "faces"):
        assert np.array_equal(getattr(found, name), getattr(expected, name), equal_nan=name in ("normals", "uv")), name


@pytest.mark.slow
@pytest.mark.parametrize(
    "attributes",
    [
        {"NORMAL": NORMALS, "TEXCOORD_0": UV, "COLOR_0": COLOURS},
        {"COLOR_0": COLOURS.astype(np.uint16) * 257, "TEXCOORD_0": (UV * 32767).astype(np.uint16)},
        {"COLOR_0": COLOURS[:, :3].astype(np.float32) / 255, "NORMAL": NORMALS, "TEXCOORD_1": UV},
    ],
)  # fmt: skip
def test_attributes_are_found_by_their_ids(tmp_path: Path, attributes: dict[str, np.ndarray]) -> None:
    glb = Glb()
    compressed(glb, attributes)
    found = read(glb, tmp_path)
    assert_same(found, read(plain(attributes), tmp_path))
    assert np.isfinite(found.uv).all() == ("TEXCOORD_0" in attributes) and len(np.unique(found.colours)) > 8


@pytest.mark.slow
def test_joints_and_weights_pose_it(tmp_path: Path) -> None:
    attributes: dict[str, np.ndarray] = {"JOINTS_0": JOINTS, "WEIGHTS_0": WEIGHTS}
    nodes = {"mesh": 0, "skin": 0}, {"translation": [1, 2, 3]}, {"scale": [2, 2, 2]}
    packed, other = Glb(), plain(attributes)
    compressed(packed, attributes)
    for glb in (packed, other):
        glb.header["skins"] = [{"joints": [1, 2]}]
    found = read(packed, tmp_path, *nodes)
    assert_same(found, read(other, tmp_path, *nodes))
    assert np.ptp(found.positions, axis=0)[2] == 3


@pytest.mark.slow
def test_strips_become_triangles_and_streams_may_be_shared(tmp_path: Path) -> None:
    glb = Glb()
    first = compressed(glb, {"TEXCOORD_0": UV}, mode=5)
    glb.header["accessors"][first["indices"]]["count"] = 4
    glb.header["meshes"][0]["primitives"].append(first | {"attributes": {"POSITION": first["attributes"]["POSITION"]}})
    second = glb.header["meshes"][0]["primitives"][1]
    second["extensions"] = {DRACO: first["extensions"][DRACO] | {"attributes": {"POSITION": 1}}}
    found = read(glb, tmp_path)
    assert len(found.positions) == 8 and found.faces.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    assert np.array_equal(found.positions[4:], FLAT) and np.isfinite(found.uv[:4]).all()


def test_the_same_without_compression_is_preferred(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "Popen", None)
    glb = plain({"COLOR_0": COLOURS})
    expected = read(glb, tmp_path)
    glb.header["meshes"][0]["primitives"][0]["extensions"] = {DRACO: {"bufferView": 0, "attributes": {"POSITION": 0}}}
    assert_same(read(glb, tmp_path), expected)


@pytest.mark.slow
def test_attributes_beside_the_stream_are_kept(tmp_path: Path) -> None:
    glb = Glb()
    primitive = compressed(glb, {})
    primitive["attributes"]["COLOR_0"] = glb.accessor(COLOURS, "u1", normalized=True)
    del glb.header["extensionsRequired"]  # all the same, there is no other data
    assert_same(read(glb, tmp_path), read(plain({"COLOR_0": COLOURS}), tmp_path))
    glb.header["accessors"][primitive["attributes"]["COLOR_0"]]["count"] = 3
    with pytest.raises(InputError, match=r"a\.glb: meshes\[0\]\.primitives\[0\]: COLOR_0: 3 values for the 4 vertices"):
        read(glb, tmp_path)
    del glb.header["accessors"][primitive["attributes"]["COLOR_0"]]["bufferView"]  # stands for zeros
    assert (read(glb, tmp_path).colours == 0).all()


@pytest.mark.slow
def test_streams_may_have_more_vertices_and_fewer_triangles_than_announced(tmp_path: Path) -> None:
    """As files by Blender until 2.90, whose accessors say what there was before compression."""
    glb = Glb()
    primitive = compressed(glb, {"NORMAL": NORMALS})
    for number in primitive["attributes"].values():
        glb.header["accessors"][number]["count"] = 3
    glb.header["accessors"][primitive["indices"]]["count"] = 9
    assert_same(read(glb, tmp_path), read(plain({"NORMAL": NORMALS}), tmp_path))


def _changed(glb: Glb, case: str) -> None:
    """A compressed mesh with a defect."""
    many = np.tile(FLAT, (2, 1))
    match case:
        case "triangles":
            compressed(glb, {}, HALVES[:3], stream({}))
        case "vertices":
            compressed(glb, {}, HALVES, stream({"POSITION": many}))
        case "points":
            compressed(glb, {}, mode=0)
        case "no indices":
            del compressed(glb, {})["indices"], glb.header["accessors"][-1]
        case "id":
            compressed(glb, {"NORMAL": NORMALS})["extensions"][DRACO]["attributes"]["NORMAL"] = 9
        case "type":
            compressed(glb, {"COLOR_0": COLOURS.astype(np.float32)}, data=stream({"COLOR_0": COLOURS}))
        case "width":
            compressed(glb, {"COLOR_0": COLOURS[:, :3]}, data=stream({"COLOR_0": COLOURS}))
        case "range":
            compressed(glb, {"COLOR_0": COLOURS}, data=stream({"COLOR_0": COLOURS.astype(np.uint16) + 1}))
        case "truncated":
            compressed(glb, {}, data=stream({})[:-9])
        case "empty":
            compressed(glb, {}, data=b"")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "message"),
    [
        ("triangles", "its Draco data has 2 triangles instead of 1$"),
        ("vertices", "the 2 triangles of its Draco data do not fit its 8 vertices$"),
        ("points", "Draco compresses only triangles and strips, with indices$"),
        ("no indices", "Draco compresses only triangles and strips, with indices$"),
        ("id", "NORMAL is missing from its Draco data$"),
        ("type", "COLOR_0 has another type in its Draco data than in its accessor$"),
        ("width", "COLOR_0 has another type in its Draco data than in its accessor$"),
        ("range", "COLOR_0 has numbers in its Draco data that its accessor cannot hold$"),
        ("truncated", "its Draco data is damaged$"),
        ("empty", "its Draco data is damaged$"),
    ],
)
def test_defects_are_told_with_their_place(tmp_path: Path, case: str, message: str) -> None:
    glb = Glb()
    _changed(glb, case)
    with pytest.raises(InputError, match=rf"^\S+a\.glb: meshes\[0\]\.primitives\[0\]: {message}"):
        read(glb, tmp_path)


def _claiming(triangles: int) -> bytes:
    """A stream of four triangles and five vertices whose head claims others, in numbers of seven bits a byte."""
    corners = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)]
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], np.float32)
    whole = stream({"POSITION": points}, corners, preserve_order=False, quantization_bits=8, compression_level=7)
    assert whole[12:16] == bytes((5, 4, 0, 4))  # vertices, triangles, further attributes, symbols

    def number(value: int) -> bytes:
        return bytes((value >> shift) & 127 | (128 if shift < 28 else 0) for shift in range(0, 35, 7))

    return whole[:12] + number(triangles * 2 // 3) + number(triangles) + b"\0" + number(triangles - 1) + whole[16:]


@pytest.mark.slow
def test_a_stream_gets_no_more_memory_than_its_size_explains(tmp_path: Path) -> None:
    """The library takes 2.3 GB for it."""
    glb = Glb()
    compressed(glb, {}, data=_claiming(100_000_000))
    began = time.monotonic()
    with pytest.raises(InputError, match=r"primitives\[0\]: its Draco data takes too much memory to decode$"):
        read(glb, tmp_path)
    assert time.monotonic() - began < 20  # with the whole of it 30 s and more


@pytest.mark.slow
def test_many_streams_get_no_more_memory_than_their_sizes_explain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each has four attributes of a hundred numbers, of which the file does not tell: 9 MB, compressed to some kB."""
    monkeypatch.setattr(decoder, "_BYTES", 96 << 20)
    side = np.arange(150, dtype=np.float32)
    points = np.array([(x, y, 0) for y in side for x in side], np.float32)
    untold = {name: np.zeros((len(points), 100), np.uint8) for name in "abcd"}
    data = stream({"POSITION": points} | untold, (0, 1, 2), compression_level=10)
    with pytest.raises(InputError, match=r"^here: its Draco data takes too much memory to decode$"):
        decode([_square(data)] * 12, Path("a.glb"))
    assert len(decode([_square(data)] * 2, Path("a.glb"))) == 2


@pytest.mark.slow
def test_a_stream_gets_no_more_time_than_its_size_explains(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decoder, "_SECONDS", 0.0)
    with pytest.raises(InputError, match=r"^here: its Draco data takes too much time to decode$"):
        decode([_square(), *[_square(_claiming(3_000_000))] * 9], Path("a.glb"))


def _square(data: bytes | None = None) -> DracoStream:
    return DracoStream(where="here", data=data or stream({}), triangles=2, vertices=4, width=3)


def test_more_than_the_machine_has_is_refused_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "Popen", None)
    monkeypatch.setattr("depthwalk.budget.machine_memory", lambda: 8 << 30)
    great = DracoStream(where="here", data=b"", triangles=MAX_MESH_TRIANGLES, vertices=4, width=3)
    with pytest.raises(InputError, match=r"^a\.glb: Draco data of 200000000 triangles would take 60\d+ MB of memory"):
        decode([great], Path("a.glb"))


@pytest.mark.slow
def test_a_library_that_does_not_start_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decoder, "_WORKER", "depthwalk.no_such_module")
    with pytest.raises(
        InputError, match=r"^a\.glb: is compressed by Draco, and DracoPy, which reads it, does not start$"
    ):
        decode([_square()], Path("a.glb"))


@pytest.mark.slow
def test_converted_models_are_not_compressed(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    glb = Glb()
    attributes: dict[str, np.ndarray] = {"NORMAL": NORMALS, "COLOR_0": COLOURS, "POSITION": FLAT + NORMALS}
    compressed(glb, attributes)
    path = glb.write(tmp_path / "a.glb", {"mesh": 0})
    with caplog.at_level(logging.WARNING):
        convert_gltf(path, tmp_path / "made")
    (model,) = (tmp_path / "made").glob("*.glb")
    assert "extensionsRequired" not in read_header(model.read_bytes(), model) and not caplog.records
    assert_same(read_soup(model), read_soup(path))
    assert ids(attributes)["POSITION"] == 2
