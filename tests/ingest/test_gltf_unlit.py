"""Unlit materials of glTF files: what they leave of a material, and files of which only some are unlit."""

import io
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from depthwalk.bake.surface import mean_shininess
from depthwalk.ingest.gltf import is_unlit
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.ingest.mesh_head import read_head
from glb_files import SQUARE, Glb

UNLIT: dict[str, Any] = {"extensions": {"KHR_materials_unlit": {}}}
LINES, STRIP = 1, 5
USED = {"material": 0}


def squares(*materials: dict[str, Any], uses: tuple[dict[str, Any], ...]) -> Glb:
    """Squares, each a primitive of its own mesh with what `uses` says of it."""
    glb = Glb()
    glb.header["materials"] = list(materials)
    for use in uses:
        glb.mesh({}, **use)
    return glb


def read(path: Path, glb: Glb) -> Mesh:
    return load_mesh(glb.write(path, *({"mesh": number} for number in range(len(glb.header["meshes"])))))


@pytest.mark.parametrize(
    ("second", "uses", "unlit"),
    [
        (UNLIT, (USED, {"material": 1}), True),
        ({}, (USED, {"material": 1}), False),
        ({}, (USED, USED), True),  # nothing shows the second
        ({}, (USED, {"material": 1, "mode": LINES}), True),  # nor lines
        (UNLIT, (USED, {"material": 1, "mode": STRIP}), True),
        (UNLIT, (USED, {}), False),  # a square without material is lit
        ({"extensions": {"KHR_materials_unlit": {}}, "alphaMode": "BLEND"}, (USED, {"material": 1}), True),
    ],
)
def test_a_file_is_unlit_if_all_that_it_shows_is(
    tmp_path: Path, second: dict[str, Any], uses: tuple[dict[str, Any], ...], unlit: bool
) -> None:
    glb = squares(UNLIT, second, uses=uses)
    mesh = read(tmp_path / "a.glb", glb)
    assert is_unlit(glb.header) == read_head(tmp_path / "a.glb").is_unlit == mesh.is_unlit == unlit
    assert {material.unlit for material in mesh.materials} == {unlit}
    assert (mean_shininess(mesh) == 0) == unlit


@pytest.mark.parametrize(
    "header",
    [
        {},
        {"meshes": 3},
        {"meshes": [{"primitives": [{"material": 7}]}], "materials": [UNLIT]},
        {"meshes": [{"primitives": [{"material": "0"}]}], "materials": [UNLIT]},
        {"meshes": [{"primitives": [{"material": 0, "mode": "4"}]}], "materials": [UNLIT]},
        {"meshes": [{"primitives": [{"material": 0}]}], "materials": [3]},
        {"meshes": [{"primitives": [{"material": 0}]}], "materials": [{"extensions": 3}]},
    ],
)
def test_what_is_malformed_is_lit(header: dict[str, Any]) -> None:
    assert not is_unlit(header)


def test_colour_texture_and_alpha_stay_and_the_rest_goes(tmp_path: Path) -> None:
    """As the extension says: a metal without highlight, that does not glow, and without its normal map."""
    glb = Glb()
    picture = io.BytesIO()
    Image.new("RGBA", (2, 2), (255, 128, 0, 90)).save(picture, "PNG")
    glb.header |= {"images": [{"bufferView": glb.view(picture.getvalue()), "mimeType": "image/png"}]}
    surface = {"baseColorFactor": [0.2, 0.4, 0.6, 1], "metallicFactor": 1, "roughnessFactor": 0}
    material = UNLIT | {
        "pbrMetallicRoughness": surface | {"baseColorTexture": {"index": 0}},
        "normalTexture": {"index": 0, "scale": 2},
        "emissiveFactor": [1, 1, 1],
        "emissiveTexture": {"index": 0},
        "alphaMode": "BLEND",
    }
    glb.header |= {"textures": [{"source": 0}], "materials": [material]}
    glb.mesh({"TEXCOORD_0": glb.accessor(SQUARE[:, :2])}, material=0)
    (found,) = read(tmp_path / "a.glb", glb).materials
    assert found.texture is not None and found.texture[0, 0].tolist() == [255, 128, 0, 90]
    assert found.base_colour == pytest.approx((0.2, 0.4, 0.6)) and found.opacity == 1
    assert found == Material(
        found.base_colour,
        found.texture,
        specular=0.0,
        shininess=found.shininess,
        opacity=found.opacity,
        unlit=True,
    )


def test_another_texture_is_unlit_too(tmp_path: Path) -> None:
    Image.new("RGB", (2, 2), (10, 20, 30)).save(tmp_path / "other.png")
    glb = squares(UNLIT, uses=())
    glb.mesh({"TEXCOORD_0": glb.accessor(SQUARE[:, :2])}, material=0)
    read(tmp_path / "a.glb", glb)
    (found,) = load_mesh(tmp_path / "a.glb", texture=tmp_path / "other.png").materials
    assert found.unlit and found.texture is not None and found.texture[0, 0, :3].tolist() == [10, 20, 30]
