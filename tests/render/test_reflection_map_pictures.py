"""Maps of roughness and metalness: the G-buffer has what they hold, in every representation."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.bake.reflection_code import reflection_codes
from depthwalk.cook import colour_pca
from depthwalk.cook.virtual_texture import VirtualTexture
from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.ingest.gltf_reflection import phong_exponent, phong_strength
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh import Mesh, Reflection
from depthwalk.limits import MAX_SHININESS
from depthwalk.quality.metrics import flip_map
from depthwalk.reference.gbuffer import is_reflecting, microfacets, unpacked_surfaces
from depthwalk.render.resources.surface_texture import _reflections
from depthwalk.scene.arrays import CAPTURED, Camera, Representation
from depthwalk.scene.scene import Scene
from glb_files import Glb
from shapes import ShapeLibrary, scene_of
from stage import set_all
from studio import Studio

POLYGONS = Representation.MESH, Representation.MESH_LOD, Representation.MESH_CLUSTERS
IMAGES = Representation.DPCI, Representation.DMESH
SKY: dict[str, Any] = {"sky": {"model": "preetham", "light": True}, "sun": {"direction": (-0.4, -0.5, -1)}}
AMBIENT: dict[str, Any] = {"sun": {"direction": (-0.1, -0.2, -1), "intensity": 1.0}}
FRONT = Camera((0.0, 0.5, 2.0), (0.0, 0.5, 0.0), 0.6)
UV = np.array([(0, 1), (1, 1), (1, 0), (0, 0)])


def square(path: Path, texels: NDArray[np.uint8], **terms: Any) -> Mesh:
    """An upright square of one metre that faces +z, with a map (H, W, 3)."""
    glb = Glb()
    shine = {"baseColorFactor": [0.9, 0.5, 0.2, 1.0], "metallicRoughnessTexture": glb.texture(texels)} | terms
    glb.header["materials"] = [{"pbrMetallicRoughness": shine}]
    glb.mesh({"TEXCOORD_0": glb.accessor(UV)}, material=0)
    return load_mesh(glb.write(path / "a.glb", {"mesh": 0}))


def halves(path: Path) -> Mesh:
    """Smooth metal to the left, rough paint to the right."""
    texels = np.zeros((8, 8, 3), np.uint8)
    texels[:, :4], texels[:, 4:] = (7, 51, 255), (7, 204, 0)
    return square(path, texels)


def shown(mesh: Mesh, representation: Representation, **environment: Any) -> tuple[Scene, ShapeLibrary]:
    scene = scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=representation, **environment)
    return scene, ShapeLibrary([mesh], None if representation in IMAGES else [None])


@pytest.mark.gl
@pytest.mark.parametrize("representation", [*POLYGONS, *IMAGES])
def test_each_half_reflects_as_its_texels_say(studio: Studio, tmp_path: Path, representation: Representation) -> None:
    words = studio.surfaces(*shown(halves(tmp_path), representation, **SKY), FRONT)[40:80]
    for columns, roughness, metalness in ((slice(40, 70), 0.2, 1.0), (slice(90, 120), 0.8, 0.0)):
        half = words[:, columns].reshape(-1, 2)
        found = microfacets(half)
        assert is_reflecting(half).all() and (found.metalness == metalness).all()
        assert found.roughness == pytest.approx(roughness, abs=0.6 / 49)


@pytest.mark.gl
@pytest.mark.parametrize("representation", [*POLYGONS, *IMAGES])
def test_highlights_follow_the_map_where_no_sky_is_reflected(
    studio: Studio, tmp_path: Path, representation: Representation
) -> None:
    words = studio.surfaces(*shown(halves(tmp_path), representation, **AMBIENT), FRONT)[40:80]
    for columns, roughness, metalness in ((slice(40, 70), 0.2, 1.0), (slice(90, 120), 0.8, 0.0)):
        half = words[:, columns].reshape(-1, 2)
        found, strength = unpacked_surfaces(half), phong_strength(np.array([roughness]), np.array([metalness]))
        assert not is_reflecting(half).any()
        assert found.specular == pytest.approx(strength[0], abs=2 / 255)
        assert found.shininess == pytest.approx(min(max(phong_exponent(roughness), 1), MAX_SHININESS), rel=0.05)


@pytest.mark.gl
@pytest.mark.parametrize("lit", ["deferred", "forward", "warp"])
def test_depth_images_cannot_be_told_from_polygons(studio: Studio, tmp_path: Path, lit: str) -> None:
    """Of blocks as random as those of a worn machine; with the mean of their map, they can."""
    rng = np.random.default_rng(2)
    blocks = np.stack([np.zeros((6, 6)), rng.uniform(30, 200, (6, 6)), 255 * rng.integers(0, 2, (6, 6))], -1)
    mesh = square(tmp_path, blocks.astype(np.uint8).repeat(16, 0).repeat(16, 1))
    mean = replace(mesh, materials=(replace(mesh.materials[0], reflection_map=None),))
    environment = SKY if lit == "deferred" else AMBIENT
    pictures = []
    for model, representation in ((mesh, POLYGONS[0]), (mesh, IMAGES[0]), (mean, POLYGONS[0])):
        scene, library = shown(model, representation, **environment)
        set_all(scene.render, {"light.mode": lit})
        picture = studio.picture(scene, library, FRONT)
        pictures.append((255 * picture + 0.5).astype(np.uint8)[30:90, 45:115])
    polygons, images, means = pictures
    assert flip_map(polygons, images).mean() < min(0.045, 0.3 * flip_map(polygons, means).mean())


@pytest.mark.gl
@pytest.mark.parametrize("representation", CAPTURED)
def test_captured_views_have_the_mean(studio: Studio, tmp_path: Path, representation: Representation) -> None:
    mesh = halves(tmp_path)
    words = studio.surfaces(*shown(mesh, representation, **SKY), FRONT)[50:70, 50:110].reshape(-1, 2)
    found, mean = microfacets(words), cast(Reflection, mesh.materials[0].reflection)
    assert is_reflecting(words).all()
    assert found.roughness == pytest.approx(mean.roughness, abs=0.6 / 49)
    assert found.metalness == pytest.approx(mean.metalness, abs=0.51 / 4)


@pytest.mark.gl
def test_the_shader_finds_the_highlight_of_its_twin(gl_device: Device, tmp_path: Path) -> None:
    source = tmp_path / "highlight.frag"
    source.write_text(
        '#include "common/told_reflection.glsl"\nout vec2 found;\n'
        "void main() { found = highlight_of((gl_FragCoord.xy - 0.5) / 31.0); }\n",
        encoding="utf-8",
    )
    scope = gl_device.scope("test")
    target = scope.texture((32, 32), 2, "f4")
    with scope.state(into=scope.framebuffer([target])):
        Program(scope, "common/fullscreen.vert", source).fill()
    metalness, roughness = np.mgrid[:32, :32] / 31
    found = np.frombuffer(target.read(), np.float32).reshape(32, 32, 2)
    np.testing.assert_allclose(found[..., 0], phong_strength(roughness, metalness), atol=1e-6)
    exponents = [min(max(phong_exponent(each), 1), MAX_SHININESS) for each in roughness[0]]
    np.testing.assert_allclose(found[..., 1], np.tile(exponents, (32, 1)), rtol=1e-4)
    scope.release()


@pytest.mark.parametrize("own", [0, 1, 2, 4])
def test_codes_are_found_in_few_components_of_colours(own: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(colour_pca, "_SMALL", 0 if own in (1, 2) else 1 << 18)
    rng = np.random.default_rng(4)
    roughness = np.tile(np.linspace(0.2, 0.8, 32).repeat(2)[:, None], 64)
    metalness = np.zeros((64, 64))
    if own == 0:
        roughness[:] = 0.4
    if own == 2:
        metalness[:] = rng.integers(0, 2, (64, 64))
    colours = np.full((64, 64, 4), 0.5)
    if own:
        colours[..., :3] = rng.uniform(0, 1, (64, 64, 1))
    colours[..., 3] = reflection_codes(roughness, metalness)
    found = colour_pca.few_components(np.round(65535 * colours).astype(np.uint16), np.ones((64, 64), bool))
    assert found.components.shape[2] == own
    pages = SimpleNamespace(
        normals=np.zeros((64, 64, 4), np.uint8), colours=found.components, tints=found.tints, palette=found.palette
    )
    told = _reflections(cast(VirtualTexture, pages)) / 255
    assert np.abs(told[..., 0] - roughness).max() < 0.03
    assert (told[..., 1] == metalness).all()
