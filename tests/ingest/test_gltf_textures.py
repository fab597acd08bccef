"""Pictures of glTF textures: which are read, and that nobody has to guess why others do not show."""

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.gltf_textures import textures_without_picture
from depthwalk.ingest.gltf_unread import unread
from depthwalk.ingest.loader import load_mesh
from glb_files import SQUARE, Glb

BASISU, WEBP, AVIF = "KHR_texture_basisu", "EXT_texture_webp", "EXT_texture_avif"
KTX = b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80)
RED, BLUE = (250, 20, 10), (10, 20, 250)


def picture(colour: tuple[int, int, int], form: str = "PNG") -> bytes:
    data = io.BytesIO()
    Image.new("RGB", (8, 8), colour).save(data, form, lossless=True)
    return data.getvalue()


def square(folder: Path, texture: dict[str, Any], *images: tuple[bytes, str], **header: Any) -> Path:
    """A textured square."""
    glb = Glb()
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    glb.header |= {"images": [{"bufferView": glb.view(data), "mimeType": kind} for data, kind in images]}
    glb.header |= {"textures": [texture], "materials": [material]} | header
    glb.mesh({"TEXCOORD_0": glb.accessor(SQUARE[:, :2])}, material=0)
    return glb.write(folder / "a.glb")


def colour(file: Path) -> tuple[int, ...] | None:
    """The colour of the only texture; None if there is none."""
    texture = load_mesh(file).materials[0].texture
    return None if texture is None else tuple(texture[0, 0, :3].tolist())


PNG = picture(RED), "image/png"


@pytest.mark.parametrize(
    ("texture", "images", "shown"),
    [
        ({"source": 0}, [PNG], RED),
        ({"source": 0, "extensions": {BASISU: {"source": 1}}}, [PNG, (KTX, "image/ktx2")], RED),
        ({"source": 0, "extensions": {AVIF: {"source": 1}}}, [PNG, (b"avif", "image/avif")], RED),
        ({"extensions": {WEBP: {"source": 0}}}, [(picture(BLUE, "WEBP"), "image/webp")], BLUE),
        ({"source": 0, "extensions": {WEBP: {"source": 1}}}, [PNG, (picture(BLUE, "WEBP"), "image/webp")], BLUE),
    ],
)
def test_the_picture_that_can_be_read_is_shown(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, texture: dict[str, Any], images: list[Any], shown: Any
) -> None:
    assert colour(square(tmp_path, texture, *images)) == shown
    assert not caplog.text


@pytest.mark.parametrize(
    ("texture", "images", "warning"),
    [
        (
            {"extensions": {AVIF: {"source": 0}}},
            [(b"avif", "image/avif")],
            "1 texture is not shown: no support for 'EXT_texture_avif'; export it with PNG, JPEG or WebP",
        ),
        ({}, [PNG], "1 texture is not shown: no picture is named; export it with PNG, JPEG or WebP"),
        ({"source": 0}, [(b"rubbish", "image/png")], "images[0] cannot be read as an image; ignored"),
    ],
)
def test_one_line_says_why_a_texture_is_not_shown(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, texture: dict[str, Any], images: list[Any], warning: str
) -> None:
    file = square(tmp_path, texture, *images)
    assert colour(file) is None
    assert [record.getMessage() for record in caplog.records] == [f"{file}: {warning}"]


def test_pictures_within_the_header_are_checked(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    def uri(data: bytes) -> dict[str, Any]:
        return {"images": [{"uri": "data:image/png;base64," + base64.b64encode(data).decode()}]}

    assert colour(square(tmp_path, {"source": 0}, **uri(PNG[0]))) == RED
    assert colour(square(tmp_path, {"source": 0}, **uri(PNG[0][:30]))) is None
    assert caplog.text.count("images[0] cannot be read as an image") == 1


def test_only_textures_that_would_be_drawn_count() -> None:
    avif = {"extensions": {AVIF: {"source": 0}}}
    header: dict[str, Any] = {
        "images": [{"mimeType": "image/avif"}],
        "textures": [avif, avif, avif, avif],
        "materials": [
            {"normalTexture": {"index": 1}, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
            {"occlusionTexture": {"index": 2}},
            {"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": {"index": 3}}}},
        ],
    }
    assert sum(textures_without_picture(header).values()) == 3
    assert "3 textures without pictures that are read" in unread(header)


@pytest.mark.parametrize(
    "texture", [3, None, [], {"extensions": 3}, {"source": "a"}, {"source": 9}, {"source": -1}, {"source": [0]}]
)
def test_malformed_textures_count_as_missing(texture: Any) -> None:
    material = {"emissiveTexture": {"index": 0}}
    header = {"textures": [texture], "images": [{}], "materials": [material, {"emissiveTexture": {"index": "a"}}]}
    assert sum(textures_without_picture(header).values()) == 1
    assert sum(textures_without_picture({"materials": [material, 3]}).values()) == 1


@pytest.mark.parametrize("name", [AVIF, "MSFT_texture_dds"])
def test_a_kind_of_picture_that_is_required_is_refused(tmp_path: Path, name: str) -> None:
    file = square(tmp_path, {"extensions": {name: {"source": 0}}}, PNG, extensionsRequired=[name])
    with pytest.raises(InputError, match=f"required glTF extension {name} is not supported; export its"):
        load_mesh(file)


def test_transformed_textures(tmp_path: Path) -> None:
    """Half of the square shows each half of the picture; turned over, the other."""
    halves = np.array([[RED, BLUE]], np.uint8)
    data = io.BytesIO()
    Image.fromarray(halves).save(data, "PNG")
    moved = {"KHR_texture_transform": {"offset": [0.5, 0.25], "scale": [0.5, 2]}}
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": moved}}}
    required = {"extensionsRequired": ["KHR_texture_transform"], "materials": [material]}
    mesh = load_mesh(square(tmp_path, {"source": 0}, (data.getvalue(), "image/png"), **required))
    assert mesh.uv[:, 0].min() == 0.5 and mesh.uv[:, 0].max() == 1
    assert np.ptp(mesh.uv[:, 1]) == 2
