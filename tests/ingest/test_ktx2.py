"""KTX 2 pictures, and the glTF files that they are in."""

import base64
import logging
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthwalk import budget
from depthwalk.assets.asset_files import mesh_source
from depthwalk.errors import InputError
from depthwalk.ingest import ktx2
from depthwalk.ingest.gltf_unread import unread
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.watched_process import Answer, framed
from depthwalk.scene.scene import MeshAsset
from glb_files import SQUARE, Glb

pytest.importorskip("opengl_basisu")

BASISU = "KHR_texture_basisu"
QUARTERS = [[(255, 0, 0, 255), (0, 255, 0, 255)], [(0, 0, 255, 255), (255, 255, 255, 128)]]  # 8 × 8 pixels in all
FILES = {
    "ETC1S": base64.b64decode(
        "q0tUWCAyMLsNChoKAAAAAAEAAAAIAAAACAAAAAAAAAAAAAAAAQAAAAEAAAABAAAAaAAAADwAAACkAAAAJAAAAMgAAAAAAAAAjgAAAAAAAABWAQAAAAAA"
        "AAQAAAAAAAAAAAAAAAAAAAA8AAAAAAAAAAIAOACjAQIAAwMAAAgIAAAAAAAAAAA/AAAAAAAAAAAA/////0AAPw8AAAAAAAAAAP////8fAAAAS1RYd3Jp"
        "dGVyAEJhc2lzIFVuaXZlcnNhbCAyLjEwAAAFAAIALgAAAAkAAAAvAAAAAAAAAAAAAAAAAAAAAgAAAAIAAAACAAAAIMBEAAAAAAAA4gQIMBEAAAAAAIAs"
        "OCAATAAAAAAAACAgAFMAAAAAACBQFn0YG6yqqqpSVVVVBQDBRAAAAAAAAPLfJ0gBMAEgAAAAAIDIESBqwAAAACBoEI2eQAAwAQAAAAAAgAACmw7QDw=="
    ),
    "UASTC": base64.b64decode(
        "q0tUWCAyMLsNChoKAAAAAAEAAAAIAAAACAAAAAAAAAAAAAAAAQAAAAEAAAAAAAAAaAAAACwAAACUAAAALAAAAAAAAAAAAAAAAAAAAAAAAADAAAAAAAAA"
        "AEAAAAAAAAAAQAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AwAAAAAAAAAA/////x8AAABLVFh3cml0ZXIAQmFzaXMgVW5pdmVy"
        "c2FsIDIuMTAAAAQAAAB/fwAA9x8A4B96AAAAAAAAAAAAABfgH+AfAg8AAAAAAAAAAAAXAOD/HwLgAQAAAAAAAAAA9///HxB87wEAAAAAAAAAAA=="
    ),
}  # fmt: skip


def sized(width: int, height: int) -> bytes:
    """A file of which nothing but the size is sound."""
    return FILES["UASTC"][:20] + struct.pack("<II", width, height) + bytes(200)


@pytest.mark.parametrize("codec", FILES)
def test_pictures_are_decoded_from_the_top(codec: str) -> None:
    (pixels,) = ktx2.decode([FILES[codec]], Path("a.glb"))
    assert pixels is not None and pixels.shape == (8, 8, 4)
    assert np.abs(pixels[2::4, 2::4].astype(int) - QUARTERS).max() <= 2


def test_damaged_pictures_leave_the_others_as_they_are() -> None:
    files = [b"", FILES["UASTC"][:120], FILES["UASTC"], b"\x89PNG", sized(20_000, 4), sized(0, 8), FILES["ETC1S"]]
    found = ktx2.decode(files, Path("a.glb"))
    assert [pixels is not None for pixels in found] == [False, False, True, False, False, False, True]


def test_the_process_may_take_what_the_sizes_explain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ktx2, "_SECONDS", 0.0)
    monkeypatch.setattr(ktx2, "_SECONDS_PER_PIXEL", 0.0)
    assert ktx2.decode([FILES["UASTC"]] * 1000, Path("a.glb")).count(None) == 1000


def test_the_memory_is_checked_before_a_process_is_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "machine_memory", lambda: 1 << 28)
    monkeypatch.setattr(ktx2, "run_watched", None)
    with pytest.raises(InputError, match=r"^a\.glb: KTX 2 pictures of 100000000 pixels would take 1868 MB of memory"):
        ktx2.decode([sized(10_000, 10_000)], Path("a.glb"))


def test_an_answer_of_another_size_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    for picture in b"", struct.pack("<II", 8, 4) + bytes(128), struct.pack("<II", 8, 8) + bytes(255):
        data = b"".join(framed([picture]))
        monkeypatch.setattr(ktx2, "run_watched", lambda *_, data=data, **__: Answer(True, data, ""))
        assert ktx2.decode([FILES["UASTC"]], Path("a.glb")) == [None]


def textured(data: bytes, folder: Path, *, texture: Any = None, image: Any = None, required: bool = True) -> Path:
    glb = Glb()
    glb.header["images"] = [image or {"bufferView": glb.view(data), "mimeType": "image/ktx2"}]
    glb.header["textures"] = [texture or {"extensions": {BASISU: {"source": 0}}}]
    glb.header["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    glb.header["extensionsRequired"] = [BASISU] if required else []
    glb.mesh({"TEXCOORD_0": glb.accessor(SQUARE[:, :2])}, material=0)
    return glb.write(folder / "a.glb")


def drawn(path: Path) -> np.ndarray | None:
    return load_mesh(path).materials[0].texture


def test_gltf_textures_are_decoded(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    data = FILES["UASTC"]
    (tmp_path / "skin.ktx2").write_bytes(data)
    beside = {"uri": "skin.ktx2"}
    within = {"uri": "data:image/ktx2;base64," + base64.b64encode(data).decode(), "mimeType": "image/ktx2"}
    expected = {colour[:3] for row in QUARTERS for colour in row}
    for image, texture in (None, None), (beside, None), (within, {"source": 0}):
        found = drawn(textured(data, tmp_path, image=image, texture=texture))
        assert found is not None and {tuple(c) for c in found[2::4, 2::4, :3].reshape(-1, 3).tolist()} == expected
    assert not caplog.records


@pytest.mark.parametrize("data", [b"", FILES["ETC1S"][:300]])
def test_a_damaged_picture_is_told_once_and_the_mesh_is_drawn(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, data: bytes
) -> None:
    path = textured(data, tmp_path)
    assert drawn(path) is None
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING] == [
        f"{path}: images[0] cannot be read as an image; ignored"
    ]


def test_bakes_from_before_are_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = textured(FILES["UASTC"], tmp_path)
    spec = MeshAsset(name="a", mesh=path, texture=None, up="y", height=None, dpci=None)
    assert read_head(path).has_ktx2 is False  # without the extension, which exporters name
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b'"extensionsRequired": [', b'"extensionsUsed":     ['))
    assert read_head(path).has_ktx2
    decoded = mesh_source(spec)
    monkeypatch.setattr(ktx2, "find_spec", lambda name: None)
    assert not read_head(path).has_ktx2 and mesh_source(spec) != decoded


def test_a_missing_file_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert drawn(textured(b"", tmp_path, image={"uri": "gone.ktx2"})) is None
    assert "'gone.ktx2' is missing or outside the folder; ignored" in caplog.text


def test_the_library_is_named_where_it_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(ktx2, "find_spec", lambda name: None)
    told = r'no support for image/ktx2; `pip install -e "\S+\[gltf\]"` installs what reads it, or export it with PNG'
    with pytest.raises(InputError, match=rf"^\S+a\.glb: {told}"):
        drawn(textured(FILES["UASTC"], tmp_path))
    path = textured(FILES["UASTC"], tmp_path, required=False)
    assert drawn(path) is None
    (record,) = caplog.records
    assert "1 texture is not shown: no support for image/ktx2; `pip install" in record.getMessage()
    header: dict[str, Any] = {
        "images": [{"mimeType": "image/ktx2"}],
        "textures": [{"extensions": {BASISU: {"source": 0}}}],
        "materials": [{"normalTexture": {"index": 0}}],
    }
    assert unread(header) == ["1 texture without a picture that is read"]
    monkeypatch.undo()
    assert unread(header) == []
