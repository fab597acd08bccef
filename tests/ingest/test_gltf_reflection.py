"""Maps of roughness and metalness of glTF files."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from trimesh.visual.material import PBRMaterial

from depthwalk.ingest.gltf_reflection import MAP_SIDE
from depthwalk.ingest.image import TextureDecoder
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.materials import convert_material, without_light
from depthwalk.ingest.mesh import Material, Mesh
from glb_files import Glb

EVERYWHERE = np.random.default_rng(1).uniform(0, 1, (400, 2))


def picture(*colours: tuple[int, int, int], size: int = 2) -> NDArray[np.uint8]:
    """Upright stripes of equal width."""
    return np.repeat(np.array(colours, np.uint8)[None], size, 0).repeat(size, 1)


def converted(texels: NDArray[np.uint8], textures: TextureDecoder | None = None, **terms: Any) -> Material:
    material = PBRMaterial(metallicRoughnessTexture=Image.fromarray(texels), **terms)
    found = convert_material(material, "a", textures, EVERYWHERE)
    assert found is not None
    return found


def test_maps_are_kept_multiplied_by_the_factors() -> None:
    texels = picture((1, 100, 0), (2, 200, 255))
    found = converted(texels)
    assert found.reflection_map is not None and (found.reflection_map == texels[..., 1:]).all()
    half = converted(texels, roughnessFactor=0.5, metallicFactor=0.25)
    assert half.reflection_map is not None
    assert half.reflection_map[0].tolist() == [[50, 0], [50, 0], [100, 64], [100, 64]]
    assert without_light(found).reflection_map is None


def test_maps_that_are_the_same_everywhere_are_left_out() -> None:
    for other in ((90, 100, 255), (0, 104, 252)):
        found = converted(picture((0, 100, 255), other))
        assert found.reflection_map is None and found.reflection is not None
    varied = picture((0, 100, 0), (0, 200, 255))
    assert converted(varied, roughnessFactor=0.0, metallicFactor=0.0).reflection_map is None


@pytest.mark.parametrize(("scratch", "reflects"), [((0, 60, 255), True), ((0, 250, 0), False)])
def test_scratches_make_dull_paint_reflect(scratch: tuple[int, int, int], reflects: bool) -> None:
    """One stripe of twenty."""
    found = converted(picture(*[(0, 210, 0)] * 19, scratch))
    assert (found.reflection is not None) == (found.reflection_map is not None) == reflects


def test_large_maps_are_averaged() -> None:
    texels = np.zeros((2, 2 * MAP_SIDE, 3), np.uint8)
    texels[:, 1::2, 1], texels[:, :MAP_SIDE, 2] = 100, 255
    found = converted(texels).reflection_map
    assert found is not None and found.shape == (1, MAP_SIDE, 2)
    assert (found[0, :, 0] == 50).all() and set(found[0, :, 1]) == {0, 255}


def test_materials_share_a_map() -> None:
    textures, image = TextureDecoder(), Image.fromarray(picture((0, 100, 0), (0, 200, 255)))
    terms: list[dict[str, Any]] = [{}, {"name": "other"}, {"roughnessFactor": 0.5}]
    first, second, other = (
        convert_material(PBRMaterial(metallicRoughnessTexture=image, **each), "a", textures, EVERYWHERE)
        for each in terms
    )
    assert first is not None and second is not None and other is not None
    assert first.reflection_map is second.reflection_map is not other.reflection_map


def of_file(path: Path, **textures: dict[str, Any]) -> Mesh:
    """A square whose map is metal to the left, and which has other coordinates, upside down and half as large."""
    glb = Glb()
    glb.texture(picture((0, 51, 255), (0, 204, 0)))
    glb.header["materials"] = [{"name": "skin", "pbrMetallicRoughness": textures}]
    uv = np.array([(0, 1), (1, 1), (1, 0), (0, 0)])
    glb.mesh({"TEXCOORD_0": glb.accessor(uv), "TEXCOORD_1": glb.accessor((1 - uv) / 2)}, material=0)
    return load_mesh(glb.write(path / "a.glb", {"mesh": 0}))


def test_maps_with_coordinates_of_their_own_count_by_their_means(tmp_path: Path) -> None:
    """Unless there is no other texture, whose coordinates the mesh has."""
    own, colours = {"index": 0, "texCoord": 1}, {"index": 0}
    alone = of_file(tmp_path, metallicRoughnessTexture=own)
    assert alone.has_reflection_maps and alone.uv[:, 0].max() == 0.5
    shared = of_file(tmp_path, metallicRoughnessTexture=colours, baseColorTexture=colours)
    assert shared.has_reflection_maps and shared.uv[:, 0].max() == 1
    apart = of_file(tmp_path, metallicRoughnessTexture=own, baseColorTexture=colours)
    (material,) = apart.materials
    assert not apart.has_reflection_maps and material.reflection is not None and apart.uv[:, 0].max() == 1
