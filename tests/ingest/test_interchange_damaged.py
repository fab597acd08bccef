"""FBX, COLLADA, 3D Studio and 3MF files that are damaged or hostile: one line each, in bounded time and memory."""

import random
import re
import struct
import zlib
from pathlib import Path

import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.reader import read_soup
from fuzz.bytes_changes import change_bytes
from fuzz.case import Files
from fuzz.dae_files import dae
from fuzz.fbx_files import fbx
from fuzz.small_scenes import Paint, Use, cube
from fuzz.three_ds_files import three_ds
from fuzz.three_mf_files import three_mf, zipped

USES = [
    Use(name="one", shape=cube(), paint=Paint(name="a", colour=(0.5, 0.2, 0.1))),
    Use(name="two", shape=cube(), paint=Paint(name="a", colour=(0.5, 0.2, 0.1)), moved=(3, 0, 0)),
]
WHOLE: dict[str, Files] = {
    "fbx": fbx(USES, {}),
    "fbx-text": fbx(USES, {}, text=True),
    "dae": dae(USES, {}),
    "3ds": three_ds(USES, {}),
    "3mf": three_mf(USES, {}, parts=True),
}
EACH = pytest.mark.parametrize("kind", WHOLE)
COLLADA = '<COLLADA version="1.4.1">{}</COLLADA>'
MODEL = '<model unit="millimeter"><resources>{}</resources><build><item objectid="1"/></build></model>'
LOOP = '<object id="1"><components><component objectid="1"/></components></object>'


def _model(objects: str) -> bytes:
    return zipped({"3D/3dmodel.model": MODEL.format(objects).encode()})


def outcome(folder: Path, kind: str, data: bytes) -> str:
    """Return what is said of a file with these contents, "" if it is read; the same is said of its head, or nothing."""
    path = folder / next(iter(WHOLE[kind]))
    path.write_bytes(data)
    try:
        read_head(path)
    except InputError as error:
        assert str(error).startswith(f"{path}:") or not data
    try:
        read_soup(path)
    except InputError as error:
        message = str(error)
        assert message.startswith(f"{path}:") and "\n" not in message and len(message) < 300 + len(str(path))
        return message.removeprefix(f"{path}:")
    return ""


def contents(kind: str) -> bytes:
    return next(iter(WHOLE[kind].values()))


@pytest.mark.slow
@EACH
def test_truncated_at_every_place(tmp_path: Path, kind: str) -> None:
    data = contents(kind)
    whole = (
        len(data)
        if kind in ("3ds", "3mf")
        else data.rfind({"dae": b"<", "fbx": b"OO", "fbx-text": b"Connections"}[kind])
    )
    for length in range(0, len(data), 3):
        said = outcome(tmp_path, kind, data[:length])
        assert said or length >= whole, f"{length} of {len(data)} bytes are read"


@pytest.mark.slow
@EACH
def test_changed_at_random(tmp_path: Path, kind: str) -> None:
    data = contents(kind)
    for seed in range(1000):
        rng = random.Random(seed)
        changed = data
        for _ in range(rng.choice((1, 1, 2, 8))):
            changed = change_bytes(changed, rng)
        outcome(tmp_path, kind, changed[: 4 * len(data)])


@EACH
def test_other_files_under_its_name(tmp_path: Path, kind: str) -> None:
    for other in (b"hello", b"\0" * 100, b"{}", b"<html></html>", contents("dae" if kind != "dae" else "3ds")):
        assert outcome(tmp_path, kind, other)


@pytest.mark.parametrize(
    ("kind", "data", "said"),
    [
        ("dae", '<!DOCTYPE a [<!ENTITY a "bb">]>' + COLLADA.format("&a;"), "1: document types are not read"),
        ("dae", "<a>" * 300 + "</a>" * 300, "1: elements nest deeper than 256"),
        ("dae", "<COLLADA><a></COLLADA>", "1: not well-formed: mismatched tag"),
        ("dae", COLLADA.format(""), "no faces; lines alone are not drawn"),
        (
            "dae",
            COLLADA.format(
                '<library_visual_scenes><visual_scene id="s"><node id="n"><instance_node url="#n"/></node>'
                "</visual_scene></library_visual_scenes>"
            ),
            "node 'n' is within itself, or too deep",
        ),
        ("fbx", b"Kaydara FBX Binary  \0\x1a\0" + struct.pack("<I", 6100), "FBX 6.1 is not read; save it as FBX 2011"),
        ("fbx-text", "; FBX 6.1.0 project file\nFBXVersion: 6100\n", "FBX 6.1 is not read; save it as FBX 2011"),
        ("fbx-text", "; FBX\nFBXVersion: 7400\n" + "A: {\n" * 99, "nodes nest deeper than 64"),
        ("fbx-text", "; FBX\nFBXVersion: 7400\n}", "3: a '}' too many"),
        ("fbx-text", "; FBX\nFBXVersion: 7400\nObjects: {\n", "truncated: 1 nodes do not end"),
        ("3ds", struct.pack("<HI", 0x4D4D, 600), "truncated: 6 of 600 bytes"),
        ("3mf", b"PK\3\4", "not a ZIP archive, as 3MF files are, or truncated"),
        ("3mf", zipped({"a": b""}), "'3D/3dmodel.model' is missing in the archive"),
        (
            "3mf",
            _model(LOOP),
            "object '1' is a component of itself",
        ),
        ("3mf", _model(""), "object '1' is missing"),
    ],
)  # fmt: skip
def test_what_is_said(tmp_path: Path, kind: str, data: str | bytes, said: str) -> None:
    found = outcome(tmp_path, kind, data if isinstance(data, bytes) else data.encode())
    assert found.lstrip().startswith(said), found


def test_nodes_that_place_each_other_do_not_multiply(tmp_path: Path) -> None:
    nodes = "".join(
        f'<node id="n{k}"><instance_node url="#n{k + 1}"/><instance_node url="#n{k + 1}"/></node>' for k in range(60)
    )
    text = COLLADA.format(
        f"<library_nodes>{nodes}</library_nodes><library_visual_scenes><visual_scene><node>"
        '<instance_node url="#n0"/></node></visual_scene></library_visual_scenes>'
    )
    assert "its nodes place each other more than 100" in outcome(tmp_path, "dae", text.encode())
    parts = "".join(
        LOOP.replace('objectid="1"/>', f'objectid="{k + 1}"/><component objectid="{k + 1}"/>').replace(
            ' id="1"', f' id="{k}"'
        )
        for k in range(1, 60)
    )
    data = _model(parts)
    assert re.search("place each other more than|is missing", outcome(tmp_path, "3mf", data))


def test_joints_do_not_pose_a_mesh_thousands_of_times(tmp_path: Path) -> None:
    skin = '<controller id="c"><skin source="#g"/></controller>'
    mesh = (
        '<geometry id="g"><mesh><source id="p"><float_array>0 0 0 1 0 0 0 1 0</float_array></source>'
        '<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>'
        '<triangles><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>'
    )
    uses = '<node><instance_controller url="#c"/></node>' * 1200
    text = COLLADA.format(
        f"<library_geometries>{mesh}</library_geometries><library_controllers>{skin}</library_controllers>"
        f'<library_visual_scenes><visual_scene id="s">{uses}</visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#s"/></scene>'
    )
    assert "its nodes pose more than 10" in outcome(tmp_path, "dae", text.encode())


def test_copies_of_a_mesh_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.ingest.interchange.model.MAX_COPIED_TRIANGLES", 10)
    copies = "".join(f'<item objectid="1" transform="1 0 0 0 1 0 0 0 1 {k} 0 0"/>' for k in range(2000))
    data = contents("3mf")
    assert outcome(tmp_path, "3mf", data) == ""
    vertices = "".join(f'<vertex x="{k % 2}" y="{k // 2}" z="0"/>' for k in range(3))
    mesh = f'<object id="1"><mesh><vertices>{vertices}</vertices><triangles>'
    mesh += '<triangle v1="0" v2="1" v3="2"/>' * 100 + "</triangles></mesh></object>"
    model = MODEL.format(mesh).replace('<item objectid="1"/>', copies)
    said = outcome(tmp_path, "3mf", zipped({"3D/3dmodel.model": model.encode()}))
    assert "triangles of the same data, at most" in said


def test_what_is_compressed_is_bounded_by_the_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.budget.machine_memory", lambda: 1 << 30)
    bomb = zipped({"3D/3dmodel.model": b" " * (70 << 20)})
    assert "bytes that are compressed would take" in outcome(tmp_path, "3mf", bomb)
    small = contents("fbx")
    packed = small[(at := small.index(b"Vertices") + 8) :]
    count, _, length = struct.unpack_from("<III", packed, 1)
    assert packed[:1] == b"d" and count == 24
    huge = small[: at + 1] + struct.pack("<I", 1 << 28) + small[at + 5 :]
    assert "bytes of arrays would take" in outcome(tmp_path, "fbx", huge)
    assert zlib.decompress(packed[13 : 13 + length])
    more = small[: at + 1] + struct.pack("<I", 23) + small[at + 5 :]
    assert "of 184 bytes of an array" in outcome(tmp_path, "fbx", more)


@pytest.mark.parametrize("kind", ["fbx-text", "dae"])
def test_indices_outside_are_reported(tmp_path: Path, kind: str) -> None:
    data = contents(kind).replace(b"a: 0,1,3,-3", b"a: 0,99,3,-3").replace(b"<p>0 0 0 0 ", b"<p>99 0 0 0 ")
    assert data != contents(kind)
    assert "99 of 0 to 7" in outcome(tmp_path, kind, data) or "outside of its 8 rows" in outcome(tmp_path, kind, data)


def test_parents_of_each_other_are_refused(tmp_path: Path) -> None:
    data = contents("fbx-text")
    models = re.findall(rb'C: "OO", (\d+), 0', data)
    looped = data.replace(b'C: "OO", %b, 0' % models[0], b'C: "OO", %b, %b' % (models[0], models[1]))
    looped = looped.replace(b'C: "OO", %b, 0' % models[1], b'C: "OO", %b, %b' % (models[1], models[0]))
    assert "nest too deep" in outcome(tmp_path, "fbx-text", looped)


def test_what_has_no_finite_place_is_left_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    data = contents("fbx-text").replace(b"a: -1,-1,-1", b"a: nan,-1,-1", 1)
    assert outcome(tmp_path, "fbx-text", data) == ""
    assert "6 of 24 triangles have NaN or infinite coordinates; left out" in caplog.text
