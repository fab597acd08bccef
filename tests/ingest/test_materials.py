"""Materials of MTL and glTF as Phong terms."""

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image
from trimesh.visual.material import PBRMaterial, SimpleMaterial

from depthwalk.errors import InputError
from depthwalk.ingest.image import TextureDecoder
from depthwalk.ingest.materials import convert_material, phong_from_mtl, without_light
from depthwalk.ingest.mesh import Material
from depthwalk.limits import MAX_EMISSION, MAX_SHININESS


def test_terms_of_a_library() -> None:
    material = phong_from_mtl({"kd": [0.1, 0.2, 0.3], "ks": [0.1, 0.5, 0.2], "ns": 90.0}, None)
    assert (material.base_colour, material.specular, material.shininess) == ((0.1, 0.2, 0.3), 0.5, 90)


@pytest.mark.parametrize("kd", [None, [1], "red", [0, 0, float("nan")], ["a", "b", "c"]])
def test_terms_without_sense_have_the_default(kd: Any) -> None:
    assert phong_from_mtl({"kd": kd, "ns": float("inf")}, None) == Material(specular=Material.specular)


def test_terms_are_clipped() -> None:
    material = phong_from_mtl({"kd": [2, -1, 0.5], "ks": [3, 0, 0], "ns": 1e9}, None)
    assert (material.base_colour, material.specular, material.shininess) == ((1, 0, 0.5), 1, MAX_SHININESS)


@pytest.mark.parametrize(
    ("terms", "specular"),
    [
        ({"ks": [1, 1, 1], "ns": 0.0, "illum": 2.0}, 0.0),  # MeshLab
        ({"ns": 0.0, "illum": 1.0}, 0.0),  # RealityCapture
        ({"illum": 0.0}, 0.0),  # Pix4D
        ({"ks": [0.5, 0.5, 0.5], "ns": 324.0, "illum": 1.0}, 0.0),
        ({"ks": [0.5, 0.5, 0.5], "ns": 1.0, "illum": 2.0}, 0.5),
        ({"ks": [0.5, 0.5, 0.5], "ns": 324.0, "illum": 7.0}, 0.5),
        ({"ks": [0.5, 0.5, 0.5], "ns": 324.0}, 0.5),
        ({}, Material.specular),
    ],
)
def test_highlights_need_an_exponent_and_a_model_that_has_them(terms: dict[str, Any], specular: float) -> None:
    assert phong_from_mtl(terms, None).specular == specular


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


@pytest.mark.parametrize(
    ("terms", "expected"),
    [
        ({}, (1, 1)),  # metal, as glTF says of what it does not
        ({"metallicFactor": 0.0}, None),
        ({"metallicFactor": 0.0, "roughnessFactor": 0.74}, (0.74, 0)),
        ({"metallicFactor": 0.05, "roughnessFactor": 0.76}, None),
        ({"metallicFactor": 0.2, "roughnessFactor": 0.0}, (0, 0.2)),
    ],
)
def test_glossy_and_metallic_surfaces_reflect(terms: dict[str, float], expected: tuple[float, float] | None) -> None:
    found = convert_material(PBRMaterial(**terms), "a")
    assert found is not None and found.reflection == (None if expected is None else pytest.approx(expected))
    assert without_light(found).reflection is None


def test_a_roughness_map_counts_where_the_surface_shows_it() -> None:
    texels = np.zeros((2, 2, 3), np.uint8)  # left: smooth metal, as what nothing shows often is
    texels[0, 1], texels[1, 1] = (9, 128, 255), (9, 255, 0)  # right: metal of middling roughness above, rough below
    uv = np.array([(0.75, 0.75), (1.75, 0.75), (-0.25, 0.25), (np.nan, 0.5)])  # two vertices above, one below

    def given(**terms: float) -> PBRMaterial:
        return PBRMaterial(metallicRoughnessTexture=Image.fromarray(texels), **terms)

    found = convert_material(given(), "a", uv=uv)
    assert found is not None and found.specular == pytest.approx(2 / 3 * (1 - 128 / 255))
    assert found.shininess == pytest.approx(2 / (128 / 255) ** 4 - 2)
    half = convert_material(given(roughnessFactor=0.5, metallicFactor=0.0), "a", uv=uv)
    assert half is not None and half.specular == pytest.approx(0.3 * (1 - (2 * 64 / 255 + 127.5 / 255) / 3))
    for nowhere in None, np.full((3, 2), np.nan):
        plain = convert_material(given(roughnessFactor=0.5), "a", uv=nowhere)
        assert plain == convert_material(PBRMaterial(roughnessFactor=0.5), "a")


def test_a_large_roughness_map_is_averaged_in_fewer_pixels() -> None:
    texels = np.zeros((1024, 1536, 3), np.uint8)
    texels[::2, :, 1], texels[1::2, :, 1] = 100, 200
    uv = np.random.default_rng(1).uniform(0, 1, (50, 2))
    found = convert_material(PBRMaterial(metallicRoughnessTexture=Image.fromarray(texels)), "a", uv=uv)
    assert found is not None and found.specular == pytest.approx(0.3 * (1 - 150 / 255), abs=0.002)


def test_a_damaged_roughness_map_is_told() -> None:
    data = io.BytesIO()
    Image.new("RGB", (64, 64)).save(data, "PNG")
    broken = Image.open(io.BytesIO(data.getvalue()[:60]))
    with pytest.raises(InputError, match=r"^a: embedded texture: image data is damaged"):
        convert_material(PBRMaterial(metallicRoughnessTexture=broken), "a", uv=np.zeros((1, 2)))


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


def test_alpha_is_how_much_a_material_hides() -> None:
    glass = np.array([255, 255, 255, 51], np.uint8)
    blended = convert_material(PBRMaterial(alphaMode="BLEND", baseColorFactor=glass), "a")
    opaque = convert_material(PBRMaterial(alphaMode="OPAQUE", baseColorFactor=glass), "a")
    assert blended is not None and opaque is not None
    assert blended.opacity == pytest.approx(0.2) and opaque.opacity is None
    terms: list[dict[str, Any]] = [{"d": 0.5}, {"tr": 0.25}, {"d": 1.0}, {}, {"tr": 1.0}]
    assert [phong_from_mtl(each, None).opacity for each in terms] == [0.5, 0.75, None, None, None]


@pytest.mark.parametrize(("alpha", "cutoff", "opacity"), [((60, 70), None, 1.0), ((0, 255), 0.5, None)])
def test_a_texture_of_middling_alpha_is_stained_glass_and_no_stencil(
    alpha: tuple[int, int], cutoff: float | None, opacity: float | None
) -> None:
    image = Image.new("RGBA", (2, 1), (255, 255, 255, alpha[0]))
    image.putpixel((1, 0), (255, 255, 255, alpha[1]))
    material = convert_material(PBRMaterial(alphaMode="BLEND", baseColorTexture=image), "a")
    assert material is not None and (material.cutoff, material.opacity) == (cutoff, opacity)


def test_the_alpha_of_a_texture_counts_where_the_format_says_so() -> None:
    texture = np.full((1, 1, 4), 128, np.uint8)
    material = phong_from_mtl({"d": 0.5}, texture)
    assert material.texture is not None and (material.opacity, material.texture[0, 0, 3]) == (0.5, 255)
    assert phong_from_mtl({}, texture).texture is texture
    faint = Image.new("RGBA", (1, 1), (255, 255, 255, 60))
    solid = convert_material(PBRMaterial(alphaMode="OPAQUE", baseColorTexture=faint), "a")
    assert solid is not None and solid.opacity is None


def test_what_glows() -> None:
    texture = np.zeros((1, 1, 4), np.uint8)
    assert phong_from_mtl({"ke": [0, 2, 1e9]}, None).emission == (0, 2, MAX_EMISSION)
    assert phong_from_mtl({"ke": [0, 0, 0]}, None, emission_texture=texture).emission == (1, 1, 1)
    assert not phong_from_mtl({"ke": ["a", 0, 0]}, None).glows
    image = Image.new("RGB", (1, 1), (255, 0, 0))
    material = convert_material(PBRMaterial(emissiveFactor=[0, 3, 0], emissiveTexture=image), "a")
    assert material is not None and material.emission == (0, 3, 0) and material.emission_texture is not None


def test_what_is_not_drawn_as_the_file_has_it_is_told(caplog: pytest.LogCaptureFixture) -> None:
    stencil = np.zeros((1, 2, 4), np.uint8)
    stencil[0, 0] = 255
    assert phong_from_mtl({"d": 0.5}, stencil, "a", cut_out=True).opacity is None
    phong_from_mtl({"d": 0.0}, None, "b")
    assert [record.getMessage() for record in caplog.records] == [
        "a is see-through (alpha 0.5) and cut out; what is not cut out is drawn opaque",
        "b is clear (alpha 0): nothing of it shows but highlights",
    ]
