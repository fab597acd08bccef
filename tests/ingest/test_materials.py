"""Materials of MTL and glTF as Phong terms."""

from typing import Any

import numpy as np
import pytest
from PIL import Image
from trimesh.visual.material import PBRMaterial, SimpleMaterial

from depthwalk.errors import InputError
from depthwalk.ingest.image import TextureDecoder
from depthwalk.ingest.materials import convert_material, phong_from_mtl
from depthwalk.ingest.mesh import Material
from depthwalk.limits import MAX_SHININESS


def test_terms_of_a_library() -> None:
    material = phong_from_mtl({"kd": [0.1, 0.2, 0.3], "ks": [0.1, 0.5, 0.2], "ns": 90.0}, None)
    assert (material.base_colour, material.specular, material.shininess) == ((0.1, 0.2, 0.3), 0.5, 90)


@pytest.mark.parametrize("kd", [None, [1], "red", [0, 0, float("nan")], ["a", "b", "c"]])
def test_terms_without_sense_have_the_default(kd: Any) -> None:
    assert phong_from_mtl({"kd": kd, "ns": float("inf")}, None) == Material(specular=Material.specular)


def test_terms_are_clipped() -> None:
    material = phong_from_mtl({"kd": [2, -1, 0.5], "ks": [3, 0, 0], "ns": 1e9}, None)
    assert (material.base_colour, material.specular, material.shininess) == ((1, 0, 0.5), 1, MAX_SHININESS)


def test_a_texture_is_not_darkened_by_black() -> None:
    texture = np.zeros((3, 2, 4), np.uint8)
    material = phong_from_mtl({"kd": [0, 0, 0]}, texture)
    assert material.base_colour == (1, 1, 1)
    assert material.texture is texture


def test_a_texture_that_is_too_large_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.ingest.image.MAX_TEXTURE_SIDE", 4)
    with pytest.raises(InputError, match=r"^skin\.png: image of 5 × 1 pixels is larger than 4 a side$"):
        TextureDecoder().decode(Image.new("RGB", (5, 1)), "skin.png")


def test_rough_surfaces_have_wide_and_weak_highlights() -> None:
    smooth, rough = (convert_material(PBRMaterial(roughnessFactor=r, metallicFactor=1.0), "a") for r in (0.2, 1.0))
    assert smooth is not None and rough is not None
    assert smooth.shininess > rough.shininess == 1 and smooth.specular > rough.specular == 0
    assert convert_material(PBRMaterial(roughnessFactor=0.5), "a") is not None


def test_base_colours_of_gltf_are_linear() -> None:
    material = convert_material(PBRMaterial(baseColorFactor=np.array([255, 51, 0, 255], np.uint8)), "a")
    assert material is not None and material.base_colour == pytest.approx((1, 0.2, 0))


def test_what_trimesh_makes_up_is_no_material() -> None:
    assert convert_material(None, "a") is None
    assert convert_material(SimpleMaterial(image=Image.new("RGB", (1, 1))), "a") is None


@pytest.mark.parametrize(
    ("mode", "least", "factor", "cutoff"),
    [("MASK", 0, 255, 0.25), ("MASK", 0, 128, 0.498), ("BLEND", 0, 255, 0.5), ("OPAQUE", 0, 255, None)]
    + [(mode, 200, 255, None) for mode in ("MASK", "BLEND", "OPAQUE")],
)
def test_alpha_cuts_out_where_the_material_says_so(mode: str, least: int, factor: int, cutoff: float | None) -> None:
    """And only where the texture has any alpha below the cutoff."""
    image = Image.new("RGBA", (2, 1), (255, 255, 255, 255))
    image.putpixel((0, 0), (255, 255, 255, least))
    given = PBRMaterial(
        baseColorTexture=image, alphaMode=mode, alphaCutoff=0.25, baseColorFactor=np.array([255, 255, 255, factor])
    )
    material = convert_material(given, "a")
    assert material is not None and material.cutoff == (cutoff and pytest.approx(cutoff, rel=1e-2))


def test_what_cannot_be_drawn_is_told(caplog: pytest.LogCaptureFixture) -> None:
    glass = np.array([255, 255, 255, 51], np.uint8)
    convert_material(PBRMaterial(name="glass", alphaMode="BLEND", baseColorFactor=glass), "a.glb")
    convert_material(PBRMaterial(alphaMode="OPAQUE", baseColorFactor=glass, emissiveFactor=[0, 1, 0]), "b.glb")
    phong_from_mtl({"d": 0.5, "ke": [0, 0, 0]}, None, "c")
    phong_from_mtl({"tr": 0.25}, None, "d")
    phong_from_mtl({"d": 1.0}, None, "e")
    assert [record.getMessage() for record in caplog.records] == [
        "a.glb: material 'glass' is see-through (alpha 0.2); it is drawn opaque",
        "b.glb: a material glows; it is drawn without its glow",
        "c is see-through (alpha 0.5); it is drawn opaque",
        "d is see-through (alpha 0.75); it is drawn opaque",
    ]
