"""Surfaces that are shown without light: their colour in every representation, however they face sun, lamps and sky."""

from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from depthwalk.colour import linear_from_srgb, srgb_from_linear
from depthwalk.gpu.device import Device
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.reference.fog import fog_through
from depthwalk.render.passes.light import LightPass
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import CAPTURED, Camera, Representation
from depthwalk.scene.scene import Scene
from glb_files import Glb
from modes import AaName
from shapes import ShapeLibrary, panes, scene_of, sphere
from stage import OnScreen, set_all
from studio import Studio

pytestmark = pytest.mark.gl

REPRESENTATIONS = [
    Representation.MESH,
    Representation.MESH_LOD,
    Representation.MESH_CLUSTERS,
    Representation.DPCI,
    Representation.DMESH,
]
IMAGES = Representation.DPCI, Representation.DMESH
FROM_BEHIND = {"sun": {"direction": (-0.2, -0.3, 1)}}  # of what faces the camera
CAMERA = Camera((0.0, 0.5, 2.0), (0.0, 0.5, 0.0), 0.7)
SIZE = 160, 120
MIDDLE = slice(50, 70), slice(70, 90)
BASE = np.array([153, 51, 13]) / 255  # linear
SHOWN = srgb_from_linear(BASE)


def quad(path: Path, **material: Any) -> Mesh:
    """An upright square that faces +z, of the base colour, from a file."""
    glb = Glb()
    material |= {"pbrMetallicRoughness": {"baseColorFactor": [*BASE.tolist(), 1], "roughnessFactor": 0.3}}
    glb.header["materials"] = [{"emissiveFactor": [0, 0, 0.5], **material}]
    glb.mesh({}, material=0)
    return load_mesh(glb.write(path / "quad.glb", {"mesh": 0}))


@pytest.fixture
def unlit(tmp_path: Path) -> Mesh:
    return quad(tmp_path, extensions={"KHR_materials_unlit": {}}, doubleSided=True)


def shown(mesh: Mesh, representation: Representation, **environment: Any) -> tuple[Scene, ShapeLibrary]:
    scene = scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=representation, **environment)
    return scene, ShapeLibrary([mesh], None if representation in IMAGES else [None])


@pytest.mark.parametrize("representation", [*REPRESENTATIONS, *CAPTURED])
@pytest.mark.parametrize("lit", ["deferred", "forward", "warp"])
def test_a_square_shows_its_base_colour(
    gl_device: Device, unlit: Mesh, representation: Representation, lit: str
) -> None:
    """Before the sun and away from it, with a lamp beside each of its sides."""
    lamps = [{"position": (0.3, 0.5, side * 0.5), "intensity": 3.0} for side in (-1, 1)]
    scene, library = shown(unlit, representation, lights=lamps, **FROM_BEHIND)
    set_all(scene.render, {"light.mode": lit})
    with OnScreen(gl_device, scene, library, SIZE) as stage:
        for side in (-1, 1):
            stage.draw(View(replace(CAMERA, position=(0.0, 0.5, side * 2.0)), SIZE))
            middle = stage.pixels()[MIDDLE] / 255
            np.testing.assert_allclose(middle, np.broadcast_to(SHOWN, (20, 20, 3)), rtol=0, atol=1.5 / 255)


@pytest.mark.parametrize("aa", get_args(AaName))
@pytest.mark.parametrize("representation", [Representation.MESH, Representation.DPCI])
def test_smoothing_and_single_passes_change_no_colour(
    studio: Studio, unlit: Mesh, representation: Representation, aa: AaName
) -> None:
    scene, library = shown(unlit, representation, **FROM_BEHIND)
    set_all(scene.render, {"aa": aa, "fused": False, "light.mode": "forward"})
    picture = studio.picture(scene, library, CAMERA)
    np.testing.assert_allclose(picture[MIDDLE][..., :3], np.broadcast_to(SHOWN, (20, 20, 3)), rtol=0, atol=1.5 / 255)


@pytest.mark.parametrize("representation", REPRESENTATIONS)
@pytest.mark.parametrize("lit", ["deferred", "forward", "warp"])
def test_without_the_extension_it_is_dark(
    studio: Studio, tmp_path: Path, representation: Representation, lit: str
) -> None:
    scene, library = shown(quad(tmp_path), representation, **FROM_BEHIND)
    set_all(scene.render, {"light.mode": lit})
    assert studio.picture(scene, library, CAMERA)[MIDDLE][..., 0].max() < SHOWN[0] / 2


def lit_alike(mesh: Mesh) -> Mesh:
    """The same mesh, lit."""
    return replace(mesh, materials=tuple(replace(material, unlit=False) for material in mesh.materials))


@pytest.mark.parametrize("lit", ["deferred", "forward", "warp"])
@pytest.mark.parametrize("aa", ["none", "msaa"])
def test_what_is_lit_beside_it_stays_as_it_is(studio: Studio, unlit: Mesh, lit: str, aa: AaName) -> None:
    """To the bit: a shadow, of a ball before them, falls on the ground and on polygons and depth images of a square."""
    ball = sphere(0.25, 48, 24)
    ball = replace(ball, materials=(Material((1.0, 1.0, 1.0), specular=1.0, shininess=1024.0),))
    pictures = []
    for square in (unlit, lit_alike(unlit)):
        scene = scene_of(
            (0, (-0.4, 0.0, 0.0), 0.0, 0.7),
            (0, (0.4, 0.0, 0.0), 0.0, 0.7),
            (1, (0.05, 0.0, 0.6), 0.0, 1.0),
            (1, (-0.7, 0.0, 0.6), 0.0, 0.5),
            sun={"direction": (-0.3, -0.1, -1)},
            ground={},
        )
        scene.objects.representation[:] = [Representation.MESH, Representation.DPCI] * 2
        scene.render.aa = aa
        set_all(scene.render, {"light.mode": lit, "shadows.enabled": True})
        pictures.append(studio.picture(scene, ShapeLibrary([square, ball], layers=1), CAMERA)[..., :3])
    flat = np.abs(pictures[0] - SHOWN).max(-1) < 1.5 / 255
    changed = (pictures[0] != pictures[1]).any(-1)
    near = flat if aa == "none" else binary_dilation(flat, iterations=2)  # pixels at its edges show both
    assert flat.sum() > 2000
    assert not (changed & ~near).any()
    assert pictures[1][flat].std(0).max() > 0.05  # where light matters, there is a shadow


def test_fog_is_before_it_and_ambient_occlusion_is_not(studio: Studio, unlit: Mesh) -> None:
    fog = {"density": 0.3, "colour": (0.0, 0.0, 0.0), "height": 100.0}
    scene, library = shown(unlit, Representation.MESH, fog=fog, **FROM_BEHIND)
    set_all(scene.render, {"ambient_occlusion.enabled": True})
    through = fog_through(0.5, np.array([[0.0, 0.0, -2.0]]), 0.3, 100.0, 10.0)
    found = linear_from_srgb(studio.picture(scene, library, CAMERA)[60, 80, :3])
    assert found == pytest.approx(BASE * through, abs=0.01)


def test_glass_keeps_its_colour_too(studio: Studio) -> None:
    """Before a white wall, as one without a highlight that light from everywhere reaches."""
    glass = Material(tuple(BASE.tolist()), specular=0.0, opacity=0.5, unlit=True)
    wall = Material((1.0, 1.0, 1.0), specular=0.0, unlit=True)
    scene, library = shown(panes((0.0, wall), (0.3, glass)), Representation.MESH, **FROM_BEHIND)
    found = linear_from_srgb(studio.picture(scene, library, CAMERA)[60, 80, :3])
    assert found == pytest.approx(0.5 * BASE + 0.5, abs=0.01)


def test_scenes_without_it_have_their_programs(studio: Studio, unlit: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    """And the next frame has them again, once it is gone."""
    defines: list[bool] = []
    inputs = LightPass.inputs

    def noted(self: LightPass, *arguments: Any) -> Any:
        found = inputs(self, *arguments)
        defines.append("UNLIT" in found.defines)
        return found

    monkeypatch.setattr(LightPass, "inputs", noted)
    for representation in REPRESENTATIONS:
        for mesh in (lit_alike(unlit), unlit):
            defines.clear()
            scene, library = shown(mesh, representation)
            studio.picture(scene, library, CAMERA)
            assert set(defines) == {mesh is unlit}


def test_what_is_evicted_is_forgotten(gl_device: Device, unlit: Mesh) -> None:
    library = ShapeLibrary([unlit, lit_alike(unlit)], layers=1)
    store = AssetStore(gl_device, library)
    (number,), (other,) = (store.parts.numbers(asset) for asset in (0, 1))
    store.stream([number], None)
    assert store.has_unlit
    store.budget = 1
    store.stream([other], None)
    assert store.depth_count == 1 and not store.has_unlit
    store.meshes.object(0)
    assert store.has_unlit
    store.release()
    assert not store.has_unlit
