"""Geometry of glTF files that trimesh alone would skip or misread."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.soup import Soup
from glb_files import HALVES, SQUARE, Glb

UV = SQUARE[:, :2]
EIGHTHS = np.array([(0, 0, 0, 255), (255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255)])


def textured(tmp_path: Path, attributes: dict[str, int], glb: Glb, **texture: Any) -> Soup:
    """What is read of a square whose colour texture has these terms; without a picture, coordinates are kept, too."""
    glb.header["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0} | texture}}]
    glb.mesh(attributes, material=0)
    return read_soup(glb.write(tmp_path / "a.glb"))


def as_written(uv: np.ndarray) -> np.ndarray:
    return np.column_stack([uv[:, 0], 1 - uv[:, 1]])  # v points downward in glTF


@pytest.mark.parametrize(("kind", "most"), [("u1", 255), ("u2", 65535)])
def test_texture_coordinates_may_be_normalised_integers(tmp_path: Path, kind: str, most: int) -> None:
    glb = Glb()
    found = textured(tmp_path, {"TEXCOORD_0": glb.accessor(UV * most, kind, normalized=True)}, glb)
    assert as_written(found.uv) == pytest.approx(UV)


def test_the_material_chooses_the_texture_coordinates(tmp_path: Path) -> None:
    glb = Glb()
    found = textured(tmp_path, {"TEXCOORD_0": glb.accessor(UV * 0), "TEXCOORD_1": glb.accessor(UV)}, glb, texCoord=1)
    assert as_written(found.uv) == pytest.approx(UV)


def test_texture_coordinates_are_scaled_turned_and_moved(tmp_path: Path) -> None:
    """As in an example of the extension, which shows the lower left quarter of the picture, turned clockwise."""
    glb = Glb()
    terms = {"KHR_texture_transform": {"offset": [0, 1], "rotation": math.pi / 2, "scale": [0.5, 0.5]}}
    glb.header["extensionsRequired"] = ["KHR_texture_transform"]
    found = textured(tmp_path, {"TEXCOORD_0": glb.accessor(UV)}, glb, extensions=terms)
    assert as_written(found.uv) == pytest.approx(np.array([(0, 1), (0, 0.5), (0.5, 0.5), (0.5, 1)]), abs=1e-6)


@pytest.mark.parametrize("name", ["emissiveTexture", "diffuseTexture"])
def test_a_texture_of_another_kind_chooses_where_there_is_none_of_colour(tmp_path: Path, name: str) -> None:
    glb = Glb()
    texture = {name: {"index": 0, "texCoord": 1}}
    gloss = {"extensions": {"KHR_materials_pbrSpecularGlossiness": texture}}
    glb.header["materials"] = [gloss if name == "diffuseTexture" else texture]
    glb.mesh({"TEXCOORD_0": glb.accessor(UV * 0), "TEXCOORD_1": glb.accessor(UV)}, material=0)
    assert as_written(read_soup(glb.write(tmp_path / "a.glb")).uv) == pytest.approx(UV)


def test_a_transform_may_choose_the_coordinates(tmp_path: Path) -> None:
    glb = Glb()
    terms = {"KHR_texture_transform": {"texCoord": 1}}
    attributes = {"TEXCOORD_0": glb.accessor(UV * 0), "TEXCOORD_1": glb.accessor(UV)}
    assert as_written(textured(tmp_path, attributes, glb, extensions=terms).uv) == pytest.approx(UV)


@pytest.mark.parametrize("has_material", [False, True])
def test_colours_of_16_bits_are_those_of_8(tmp_path: Path, has_material: bool) -> None:
    found = []
    for kind, values in ("u1", EIGHTHS), ("u2", EIGHTHS * 257):
        glb = Glb()
        glb.header["materials"] = [{}]
        colours = {"COLOR_0": glb.accessor(values, kind, normalized=True)}
        glb.mesh(colours, **({"material": 0} if has_material else {}))
        found.append(read_soup(glb.write(tmp_path / f"{kind}.glb")).colours)
    assert (found[0] == found[1]).all() and (found[0] == EIGHTHS[:, :3]).all()


def test_positions_may_be_normalised_integers(tmp_path: Path) -> None:
    glb = Glb()
    glb.mesh({"POSITION": glb.accessor(SQUARE * 32767, "i2", normalized=True)})
    assert read_soup(glb.write(tmp_path / "a.glb", {"mesh": 0, "scale": [3, 3, 3]})).positions == pytest.approx(
        3 * SQUARE
    )


@pytest.mark.parametrize("has_base", [False, True])
def test_sparse_values_replace_those_of_the_base_or_zeros(tmp_path: Path, has_base: bool) -> None:
    glb = Glb()
    base = (SQUARE + np.array([0, 0, 2])) if has_base else SQUARE * 0
    places = {"bufferView": glb.view(np.array([2, 3], "<u2").tobytes()), "componentType": 5123}
    values = {"bufferView": glb.view((SQUARE[2:]).astype("<f4").tobytes())}
    number = glb.accessor(base, sparse={"count": 2, "indices": places, "values": values})
    if not has_base:
        del glb.header["accessors"][number]["bufferView"]
    glb.mesh({"POSITION": number}, [1, 2, 3] if has_base else HALVES)
    found = read_soup(glb.write(tmp_path / "a.glb"))
    assert found.positions == pytest.approx(np.concatenate([base[:2], SQUARE[2:]]))


@pytest.mark.parametrize("indices", [None, [0, 1, 2, 3]])
def test_fans_are_drawn(tmp_path: Path, indices: list[int] | None) -> None:
    glb = Glb()
    glb.mesh({}, indices, mode=6)
    assert read_soup(glb.write(tmp_path / "a.glb")).faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_a_file_without_scenes_shows_all_nodes(tmp_path: Path) -> None:
    glb = Glb()
    glb.mesh({})
    glb.header["nodes"] = [{"mesh": 0}, {"children": [0], "translation": [5, 0, 0]}]
    assert read_soup(glb.write(tmp_path / "a.glb")).positions == pytest.approx(SQUARE + np.array([5, 0, 0]))


def test_what_hangs_from_a_camera_is_drawn(tmp_path: Path) -> None:
    glb = Glb()
    glb.mesh({})
    glb.header["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]
    above = {"camera": 0, "children": [1], "translation": [0, 5, 0]}
    path = glb.write(tmp_path / "a.glb", above, {"mesh": 0}, roots=[0])
    assert read_soup(path).positions == pytest.approx(SQUARE + np.array([0, 5, 0]))


@pytest.mark.parametrize(
    "defect",
    [
        {"count": 5},
        {"byteOffset": 4},
        {"byteOffset": -4},
        {"componentType": 7},
        {"type": "VEC9"},
        {"sparse": {"count": 1, "indices": {"bufferView": 9, "componentType": 5123}, "values": {"bufferView": 0}}},
        {"sparse": {"count": -1}},
        {"sparse": 3},
    ],
)
def test_damaged_accessors_are_reported(tmp_path: Path, defect: dict[str, Any]) -> None:
    glb = Glb()
    number = glb.accessor(UV * 255, "u1", normalized=True)
    glb.header["accessors"][number] |= defect
    with pytest.raises(InputError, match=r"a\.glb: damaged, truncated or an unsupported kind of GLB"):
        textured(tmp_path, {"TEXCOORD_0": number}, glb)


def test_files_that_used_to_look_otherwise_are_marked(tmp_path: Path) -> None:
    """Their depth images have another key than those of earlier versions."""
    plain, other = Glb(), Glb()
    plain.mesh({})
    other.mesh({}, mode=6)
    assert not read_head(plain.write(tmp_path / "plain.glb")).has_other_geometry
    assert read_head(other.write(tmp_path / "other.glb")).has_other_geometry
