"""The headers of glTF files."""

import json
import struct
from pathlib import Path
from typing import Any

import pytest

from depthwalk.errors import InputError
from depthwalk.ingest import gltf_meshopt
from depthwalk.ingest.draco import decoder
from depthwalk.ingest.gltf import (
    check_header,
    external_uris,
    fold_extensions,
    has_glow,
    has_translucency,
    is_all_translucent,
    read_header,
    with_header,
)
from depthwalk.ingest.reader import read_soup
from draco_files import compressed
from glb_files import Glb

GLTF, GLB = Path("a.gltf"), Path("a.glb")


def glb(header: bytes, *, version: int = 2, kind: bytes = b"JSON", total: int | None = None) -> bytes:
    whole = 20 + len(header) if total is None else total
    return struct.pack("<4sIII4s", b"glTF", version, whole, len(header), kind) + header


def mesh(**accessor: Any) -> dict[str, Any]:
    """The smallest header with one primitive."""
    position = {"bufferView": 0, "count": 3, "componentType": 5126} | accessor
    return {"accessors": [position], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]}


def test_both_kinds_of_files_have_one_header() -> None:
    header = {"asset": {"version": "2.0"}}
    text = json.dumps(header).encode()
    assert read_header(text, GLTF) == read_header(glb(text), GLB) == header


@pytest.mark.parametrize(
    ("data", "path", "defect"),
    [
        (b"", GLTF, "empty file"),
        (b"", GLB, "empty file"),
        (b"{", GLTF, "its glTF header is not JSON"),
        (b"[]", GLTF, "its glTF header is not an object"),
        (b"[" * 100_000, GLTF, "its glTF header is not JSON"),
        (b"glTF", GLB, "not a GLB file"),
        (glb(b"{}", version=1), GLB, "not a GLB file of version 2 but 1.0; gltf-pipeline, for example, converts it"),
        (b'{"accessors": {"a": {}}}', GLTF, "not a glTF file of version 2 but 1.0; gltf-pipeline, .* converts it"),
        (glb(b"{}", kind=b"BIN\0"), GLB, "not a GLB file of version 2"),
        (glb(b"{}", total=100), GLB, "truncated: 22 of 100 bytes"),
    ],
)
def test_damaged_headers(data: bytes, path: Path, defect: str) -> None:
    with pytest.raises(InputError, match=defect):
        read_header(data, path)


def test_files_that_the_header_names() -> None:
    header = {"buffers": [{"uri": "a.bin"}, {"uri": "data:,x"}, {}]}
    assert external_uris(header, "buffers") == ["a.bin"]
    assert external_uris(header, "images") == []


def test_a_plain_mesh_passes() -> None:
    check_header(mesh() | {"extensionsRequired": ["KHR_materials_unlit", "KHR_mesh_quantization"]}, GLTF)


@pytest.mark.parametrize(
    ("header", "defect"),
    [
        ({"extensionsRequired": ["KHR_audio_emitter"]}, "extension KHR_audio_emitter is not supported$"),
        ({"extensionsRequired": ["EXT_texture_avif"]}, "not supported; export its textures as PNG, JPEG or WebP$"),
        ({"accessors": [{"count": 3}]}, r"accessors\[0\]: compressed or empty"),
        (mesh(count=0), r"accessors\[0\]: count 0 is out of range"),
        (mesh(count=10**12), r"count 1000000000000 is out of range"),
    ],
)
def test_what_trimesh_would_misread(header: dict[str, Any], defect: str) -> None:
    with pytest.raises(InputError, match=defect):
        check_header(header, GLTF)


def with_material(**terms: Any) -> dict[str, Any]:
    return {"materials": [{}, terms]}


def strength(value: Any) -> dict[str, Any]:
    return {"KHR_materials_emissive_strength": {"emissiveStrength": value}}


def transmission(value: Any) -> dict[str, Any]:
    return {"KHR_materials_transmission": {"transmissionFactor": value}}


def test_extensions_become_terms_of_the_core() -> None:
    header = with_material(emissiveFactor=[0, 0.5, 1], extensions=strength(4.0) | transmission(0.75))
    assert fold_extensions(header, GLTF)
    material = header["materials"][1]
    assert (material["emissiveFactor"], material["alphaMode"]) == ([0, 2, 4], "BLEND")
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [1, 1, 1, 0.25]


def test_clear_glass_mirrors_still() -> None:
    header = with_material(pbrMetallicRoughness={"baseColorFactor": [1, 0, 0, 0.1]}, extensions=transmission(1))
    assert fold_extensions(header, GLTF)  # the alpha of an opaque material means nothing
    assert header["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"] == [1, 0, 0, pytest.approx(0.08)]


def test_what_says_nothing_is_left_as_it_is() -> None:
    assert not fold_extensions(with_material(extensions=strength(3) | transmission(0)), GLTF)
    assert not fold_extensions(with_material(alphaMode="MASK", extensions=transmission(1)), GLTF)


@pytest.mark.parametrize(
    ("extensions", "defect"),
    [
        (strength(-1), "emissiveStrength must be a number, 0 or more, not -1"),
        (strength(float("nan")), "emissiveStrength must be a number, 0 or more, not nan"),
        (strength("bright"), "emissiveStrength must be a number, 0 or more, not bright"),
        (transmission(1.5), "transmissionFactor must be a number from 0 to 1, not 1.5"),
        (transmission(True), "transmissionFactor must be a number from 0 to 1, not True"),
    ],
)
def test_extensions_out_of_range(extensions: dict[str, Any], defect: str) -> None:
    with pytest.raises(InputError, match=rf"^a\.gltf: materials\[1\]: {defect}$"):
        fold_extensions(with_material(extensions=extensions), GLTF)


def test_a_header_is_replaced_in_both_kinds_of_files() -> None:
    header = {"asset": {"version": "2.0"}, "more": "x"}
    assert read_header(with_header(b"{}", header, GLTF), GLTF) == header
    whole = with_header(glb(b"{}  ") + b"rest", header, GLB)
    assert read_header(whole, GLB) == header and whole.endswith(b"rest")


def test_materials_that_are_none_hide_nothing() -> None:
    assert not has_glow({"materials": [3]}) and not has_translucency({"materials": {}})
    assert has_glow(with_material(emissiveFactor=[1, 1, 1])) and has_translucency(with_material(alphaMode="BLEND"))
    assert not any(has_translucency(with_material(extensions=each)) for each in (None, 5, [1]))


@pytest.mark.parametrize(
    ("material", "nothing_opaque"),
    [
        ({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}}, True),
        ({"extensions": transmission(0.5)}, True),
        ({"alphaMode": "MASK", "extensions": transmission(0.5)}, False),
        ({"alphaMode": "BLEND"}, False),  # as many programs write of all that is opaque
        ({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, False),  # it may cut out
        ({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}}, False),
        ({"extensions": None}, False),
        (5, False),
    ],
)
def test_nothing_is_opaque_only_where_the_numbers_say_so(material: Any, nothing_opaque: bool) -> None:
    primitive = {"attributes": {"POSITION": 0}, "material": 0}
    header = {"meshes": [{"primitives": [primitive, primitive]}], "materials": [material]}
    assert is_all_translucent(header) == nothing_opaque
    del primitive["material"]
    assert not is_all_translucent(header)


def test_what_reads_draco_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decoder, "find_spec", lambda name: None)
    glb = Glb()
    compressed(glb, {}, data=b"DRACO")
    wanted = r'^\S+a\.glb: is compressed by Draco; `pip install -e "\S+\[gltf\]"` installs what reads it, and `gltf-tr'
    with pytest.raises(InputError, match=wanted):
        read_soup(glb.write(tmp_path / "a.glb"))


def test_what_reads_meshopt_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gltf_meshopt, "find_spec", lambda name: None)
    glb = Glb()
    glb.mesh({})
    glb.header["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": {"count": 4, "byteStride": 12}}
    glb.header["extensionsRequired"] = ["EXT_meshopt_compression"]
    wanted = r'^\S+a\.glb: is compressed by meshopt; `pip install -e "\S+\[gltf\]"` installs what reads it, and `gl'
    with pytest.raises(InputError, match=wanted):
        read_soup(glb.write(tmp_path / "a.glb"))
