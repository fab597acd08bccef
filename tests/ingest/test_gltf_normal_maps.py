"""Normal maps of glTF files: which are read, and how strong they are."""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.gltf_normal_maps import fold_normal_maps, is_read, name_and_scale, normal_map_counts
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.mesh_head import read_head
from glb_files import SQUARE, Glb

UV = SQUARE[:, :2]
ROTATED = {"KHR_texture_transform": {"rotation": 0.5}}
TEXELS = np.array([[[128, 128, 255], [255, 128, 128]]], np.uint8)


def square(folder: Path, material: dict[str, Any], **attributes: Any) -> Path:
    """A square with one material, two textures, and two sets of texture coordinates."""
    glb = Glb()
    picture = io.BytesIO()
    Image.fromarray(TEXELS).save(picture, "PNG")
    glb.header |= {"images": [{"bufferView": glb.view(picture.getvalue()), "mimeType": "image/png"}]}
    glb.header |= {"textures": [{"source": 0}], "materials": [material]}
    sets = {"TEXCOORD_0": glb.accessor(UV), "TEXCOORD_1": glb.accessor(UV / 2)}
    glb.mesh(sets | attributes, material=0)
    return glb.write(folder / "a.glb")


def read(folder: Path, material: dict[str, Any]) -> Mesh:
    return load_mesh(square(folder, material))


def test_a_map_is_read_with_its_scale_and_the_name_of_the_material_stays(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    clear = {"baseColorFactor": [1, 1, 1, 0]}
    glass = {"name": "pane", "alphaMode": "BLEND", "pbrMetallicRoughness": clear}
    mesh = read(tmp_path, {**glass, "normalTexture": {"index": 0, "scale": 0.25}})
    (material,) = mesh.materials
    assert material.normal_map is not None and material.normal_scale == 0.25
    assert material.normal_map[..., :3].tolist() == TEXELS.tolist()
    assert "material 'pane' is clear" in caplog.text


def test_a_picture_that_serves_twice_is_decoded_once(tmp_path: Path) -> None:
    both = {"normalTexture": {"index": 0}, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    (material,) = read(tmp_path, both).materials
    assert material.normal_map is not None and material.normal_map is material.texture
    assert material.normal_scale == 1


def test_a_map_alone_brings_its_own_coordinates(tmp_path: Path) -> None:
    mesh = read(tmp_path, {"normalTexture": {"index": 0, "texCoord": 1}})
    assert mesh.materials[0].normal_map is not None
    assert sorted(mesh.uv[:, 0].tolist()) == [0, 0, 0.5, 0.5]


@pytest.mark.parametrize(
    ("of_map", "of_colour", "shared"),
    [
        ({}, {}, True),
        ({"texCoord": 1}, {"texCoord": 1}, True),
        ({"extensions": ROTATED}, {"extensions": ROTATED}, True),
        ({"extensions": {"KHR_texture_transform": {"scale": [1, 1]}}}, {}, True),  # changes nothing
        ({"texCoord": 1}, {}, False),
        ({"extensions": ROTATED}, {}, False),
        ({}, {"extensions": ROTATED}, False),
        ({"extensions": {"KHR_texture_transform": {"texCoord": 1}}}, {"texCoord": 1}, True),
    ],
)
def test_maps_with_other_coordinates_than_the_colours_are_not_read(
    tmp_path: Path, of_map: dict[str, Any], of_colour: dict[str, Any], shared: bool
) -> None:
    material = {
        "normalTexture": {"index": 0} | of_map,
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0} | of_colour},
    }
    assert normal_map_counts({"materials": [material, {}]}) == ((1, 0) if shared else (0, 1))
    assert (read(tmp_path, material).materials[0].normal_map is not None) == shared
    assert read_head(tmp_path / "a.glb").has_normal_maps == shared


@pytest.mark.parametrize("scale", ["1", True, None, [1], float("nan"), float("inf")])
def test_a_scale_that_is_no_number_is_refused(tmp_path: Path, scale: Any) -> None:
    with pytest.raises(InputError, match=r"a\.glb: materials\[0\]: the scale of its normal map must be a number, not"):
        read(tmp_path, {"normalTexture": {"index": 0, "scale": scale}})


@pytest.mark.parametrize(("scale", "read_as"), [(1e300, 100), (-(10**400), -100), (0, 0)])
def test_a_scale_is_brought_into_range(tmp_path: Path, scale: float, read_as: float) -> None:
    assert read(tmp_path, {"normalTexture": {"index": 0, "scale": scale}}).materials[0].normal_scale == read_as


def test_names_may_hold_anything() -> None:
    assert name_and_scale(None) == (None, 1.0)
    assert name_and_scale("a\x1fb") == ("a\x1fb", 1.0)
    header: dict[str, Any] = {"materials": [{"name": "a\x1f2", "normalTexture": {"index": 0, "scale": -3}}]}
    assert fold_normal_maps(header, Path("a.glb"))
    assert name_and_scale(header["materials"][0]["name"]) == ("a\x1f2", -3.0)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers(-2, 2) | st.floats() | st.sampled_from(["", "KHR_texture_transform"]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["index", "scale", "texCoord", "extensions", "KHR_texture_transform", "offset"]),
            inner,
            max_size=3,
        )
    ),
    max_leaves=6,
)


@given(json_values, json_values)
def test_whatever_stands_in_a_header_is_read_removed_or_refused(of_map: Any, of_colour: Any) -> None:
    material = {"normalTexture": of_map, "pbrMetallicRoughness": {"baseColorTexture": of_colour}}
    header: dict[str, Any] = json.loads(json.dumps({"materials": [material]}))
    was_read = is_read(header["materials"][0])
    assert normal_map_counts(header) == (was_read, not was_read)
    try:
        fold_normal_maps(header, Path("a.glb"))
    except InputError as error:
        assert was_read and str(error).startswith("a.glb: materials[0]: ")
    else:
        assert ("normalTexture" in header["materials"][0]) == was_read


@pytest.mark.parametrize("header", [{}, {"materials": 3}, {"materials": [3, {"normalTexture": 3}]}])
def test_malformed_maps_are_not_read(header: dict[str, Any]) -> None:
    assert normal_map_counts(header)[0] == 0
