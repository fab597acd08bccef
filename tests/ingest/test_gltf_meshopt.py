"""glTF files compressed by meshoptimizer, which read as they do without compression."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthwalk import budget
from depthwalk.conversion.gltf import convert_gltf
from depthwalk.errors import InputError
from depthwalk.ingest.gltf import read_header
from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.soup import Soup
from glb_files import SQUARE, Glb

meshopt = pytest.importorskip("meshopt")

EXT, KHR = "EXT_meshopt_compression", "KHR_meshopt_compression"
NORMALS = np.array([(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0.6, 0.8)])
UV = np.array([(0, 0), (0.25, 0), (1, 0.5), (0, 2)], np.float32)
COLOURS = np.array([(0, 1, 2, 255), (128, 0, 7, 255), (255, 255, 0, 255), (9, 90, 200, 255)], np.uint8)


def compress(
    glb: Glb, name: str = EXT, version: int = 0, filters: dict[int, tuple[str, np.ndarray]] | None = None
) -> None:
    """Compress each view of the file: its bytes, or in place of these the rows that a filter makes the same of."""
    plain, glb.data = bytes(glb.data), bytearray()
    listed = glb.header["bufferViews"]
    glb.header["bufferViews"] = []
    indices = {mesh["primitives"][0].get("indices") for mesh in glb.header["meshes"]}
    corners = {glb.header["accessors"][number]["bufferView"] for number in indices - {None}}
    views = []
    for number, view in enumerate(listed):
        raw = np.frombuffer(plain, np.uint8, view["byteLength"], view["byteOffset"])
        stride, mode, more = view.get("byteStride", 4), "ATTRIBUTES", {}
        if number in corners:
            stride, mode = 2, "TRIANGLES"
            coded = meshopt.encode_gltf_buffer(raw.view(np.uint16), mode, version)
        else:
            filtered = (filters or {}).get(number)
            rows = raw.reshape(-1, stride) if filtered is None else filtered[1]
            more = {} if filtered is None else {"filter": filtered[0]}
            stride = rows.shape[1]
            coded = meshopt.encode_gltf_buffer(rows, mode, version)
        count = view["byteLength"] // stride
        place = glb.header["bufferViews"][glb.view(coded)]
        terms = place | {"byteStride": stride, "count": count, "mode": mode} | more
        views.append(view | {"buffer": 1, "extensions": {name: terms}})
    glb.header["bufferViews"] = views
    glb.header["buffers"] = [{}, {"byteLength": len(plain), "extensions": {name: {"fallback": True}}}]
    glb.header["extensionsUsed"] = glb.header["extensionsRequired"] = [name]


def quantised() -> Glb:
    """A square as `gltfpack` writes meshes: positions of 16 bits with a stride of 8 bytes, and small attributes."""
    glb = Glb()
    positions = np.zeros((4, 4), np.uint16)
    positions[:, :3] = SQUARE * 1000
    rows = {
        "POSITION": glb.accessor(positions, "u2", type="VEC3"),
        "NORMAL": glb.accessor(np.rint(np.c_[NORMALS, np.ones(4)] * 127), "i1", type="VEC3", normalized=True),
        "TEXCOORD_0": glb.accessor(UV),
        "COLOR_0": glb.accessor(COLOURS, "u1", normalized=True),
    }
    for number, stride in zip(rows.values(), (8, 4, 8, 4), strict=True):
        glb.header["bufferViews"][glb.header["accessors"][number]["bufferView"]]["byteStride"] = stride
    glb.mesh(rows, material=0)
    glb.header["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    return glb


def assert_same(found: Soup, expected: Soup, within: float = 0.0) -> None:
    for name in ("positions", "normals", "colours", "uv", "faces"):
        a, b = getattr(found, name), getattr(expected, name)
        assert a.shape == b.shape and np.allclose(a, b, rtol=0, atol=within, equal_nan=True), name


@pytest.mark.parametrize(("name", "version"), [(EXT, 0), (KHR, 0), (KHR, 1)])
def test_compressed_views_hold_what_they_held(tmp_path: Path, name: str, version: int) -> None:
    expected = read_soup(quantised().write(tmp_path / "a.glb", {"mesh": 0}))
    assert np.isfinite(expected.uv).all() and len(np.unique(expected.colours)) > 8
    glb = quantised()
    compress(glb, name, version)
    assert_same(read_soup(glb.write(tmp_path / "b.glb", {"mesh": 0})), expected)


def test_filters_are_undone(tmp_path: Path) -> None:
    expected = read_soup(quantised().write(tmp_path / "a.glb", {"mesh": 0}))
    glb = quantised()
    directions = meshopt.encode_filter_oct(np.c_[NORMALS, np.ones(4)], 4, 8)
    colours = meshopt.encode_filter_color(COLOURS / 255, 4, 8)
    coordinates = meshopt.encode_filter_exp(UV, 15)
    compress(glb, KHR, 1, {1: ("OCTAHEDRAL", directions), 2: ("EXPONENTIAL", coordinates), 3: ("COLOR", colours)})
    found = read_soup(glb.write(tmp_path / "b.glb", {"mesh": 0}))
    assert np.abs(found.colours.astype(int) - expected.colours).max() <= 13  # a step of 255 where sRGB is steepest
    assert np.array_equal(found.uv, expected.uv) and np.abs(found.normals - expected.normals).max() < 0.02


def test_what_is_there_without_compression_is_used(tmp_path: Path) -> None:
    plain = quantised()
    expected = read_soup(plain.write(tmp_path / "a.glb", {"mesh": 0}))
    for view in plain.header["bufferViews"]:
        view["extensions"] = {EXT: {"buffer": 7, "mode": "nonsense"}}
    assert_same(read_soup(plain.write(tmp_path / "b.glb", {"mesh": 0})), expected)


def test_compressed_files_are_converted_as_others(tmp_path: Path) -> None:
    packed, plain = quantised(), quantised()
    compress(packed)
    made = []
    for name, glb in ("packed", packed), ("plain", plain):
        glb.header["materials"] = [{}]
        path = glb.write(tmp_path / f"{name}.glb", *({"mesh": 0, "translation": [4 * k, 0, 0]} for k in range(30)))
        convert_gltf(path, tmp_path / name)
        made += list((tmp_path / name).glob("*.glb"))
    assert "extensionsRequired" not in read_header(made[0].read_bytes(), made[0])
    found, expected = map(read_soup, made)
    assert len(found.faces) == 60
    assert_same(found, expected)


def change(**terms: Any) -> Any:
    return lambda found: found.update(terms)


@pytest.mark.parametrize(
    ("number", "damage", "message"),
    [
        (0, change(byteLength=9), r"bufferViews\[0\]: its meshopt data is damaged \(Malformed"),
        (0, change(byteOffset=10**6), r"bufferViews\[0\]: its meshopt data is damaged \(too short"),
        (0, change(count=3), r"bufferViews\[0\]: its meshopt data has 24 bytes instead of 32"),
        (0, change(count=10**12), r"meshopt data of 8\d+ bytes would take \d+ MB of memory"),
        (0, change(count=-4), "is no number of items"),
        (0, change(count="4"), "is no number of items"),
        (0, change(byteStride=2, count=16), r"bufferViews\[0\]: its meshopt data is damaged \(a row must be"),
        (0, change(mode="POINTS"), r"bufferViews\[0\]: its meshopt data is damaged"),
        (0, change(filter="BLUR"), r"bufferViews\[0\]: its meshopt data is damaged"),
        (0, lambda terms: terms.pop("mode"), "KeyError"),
        (0, change(buffer=5), "list index out of range"),
    ],
)
def test_damaged_data_is_located(tmp_path: Path, number: int, damage: Any, message: str) -> None:
    glb = quantised()
    compress(glb)
    damage(glb.header["bufferViews"][number]["extensions"][EXT])
    with pytest.raises(InputError, match=rf"^\S+a\.glb: .*{message}"):
        read_soup(glb.write(tmp_path / "a.glb", {"mesh": 0}))


@pytest.mark.parametrize("number", [0, 4])
def test_no_more_is_announced_than_the_data_can_hold(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    monkeypatch.setattr(meshopt, "decode_gltf_buffer", None)
    glb = quantised()
    compress(glb)
    view = glb.header["bufferViews"][number]
    terms = view["extensions"][EXT]
    glb.header["bufferViews"] = [view]
    terms["count"] = 3 * (terms["byteLength"] + 1) if number else 128 * (terms["byteLength"] + 1)
    view["byteLength"] = terms["count"] * terms["byteStride"]
    with pytest.raises(InputError, match=r"bufferViews\[0\]: its meshopt data is damaged \(too short\)$"):
        read_soup(glb.write(tmp_path / "a.glb", {"mesh": 0}))


def test_the_memory_is_checked_before_anything_is_decoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "_SMALL", 0)
    monkeypatch.setattr(budget, "machine_memory", lambda: 100)
    monkeypatch.setattr(meshopt, "decode_gltf_buffer", None)
    glb = quantised()
    compress(glb)
    with pytest.raises(InputError, match=r"a\.glb: meshopt data of 108 bytes would take 0 MB of memory"):
        read_soup(glb.write(tmp_path / "a.glb", {"mesh": 0}))


def test_no_changed_byte_gets_past_the_reader(tmp_path: Path) -> None:
    glb = quantised()
    compress(glb)
    path = glb.write(tmp_path / "a.glb", {"mesh": 0})
    whole = path.read_bytes()
    start = 20 + int.from_bytes(whole[12:16], "little") + 8
    random = np.random.default_rng(7)
    for place in random.integers(start, len(whole), 200):
        path.write_bytes(whole[:place] + bytes(random.integers(0, 256, 1, np.uint8)) + whole[place + 1 :])
        try:
            read_soup(path)
        except InputError as error:
            assert str(error).startswith(str(path)) and "\n" not in str(error)
