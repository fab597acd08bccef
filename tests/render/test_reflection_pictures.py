"""Surfaces that reflect the sky: the pass against its twin, and alike in every representation."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.colour import linear_from_srgb
from depthwalk.gpu.device import Device
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh import Mesh
from depthwalk.reference.gbuffer import is_reflecting, microfacets, reflecting_surfaces, unpacked_surfaces
from depthwalk.reference.light import lamp_light, reflected
from depthwalk.reference.reflection import lobe_direction, microfacet, mirrored, sky_reflection
from depthwalk.render.frame import Frame, common_settings
from depthwalk.render.lighting.harmonics import polynomials
from depthwalk.render.lighting.irradiance import Lighting, lighting
from depthwalk.render.passes.light import LightPass
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.shadows.casters import Shadows
from depthwalk.render.targets import Targets
from depthwalk.render.view.view import View, view_distance
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.scene.arrays import CAPTURED, Camera, Representation
from depthwalk.scene.effect_settings import LightParams
from depthwalk.scene.environment import Environment
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from glb_files import Glb
from shapes import ShapeLibrary, scene_of
from stage import set_all
from studio import Studio

pytestmark = pytest.mark.gl

POLYGONS = Representation.MESH, Representation.MESH_LOD, Representation.MESH_CLUSTERS
IMAGES = Representation.DPCI, Representation.DMESH
SKY = (0.5, 0.6, 0.7)
EVEN: dict[str, Any] = {"sky": {"zenith": SKY, "horizon": SKY, "light": True}, "sun": {"intensity": 0.0}}
LOW = Camera((0.0, -0.6, 2.0), (0.0, 0.5, 0.0), 0.5)  # so that what an upright square mirrors is above the horizon
SIZE = 150, 70
BASE = np.array([0.9, 0.5, 0.2])


def lit_twin(light: Lighting, lamp: Any, words: NDArray[np.uint32], from_viewer: Array, view: View) -> Array:
    """Linear RGB (n, 3) of what the G-buffer's words tell, `from_viewer` (n, 3) off, metres."""
    away = from_viewer / np.linalg.norm(from_viewer, axis=1, keepdims=True)
    plain, glossy, reflects = unpacked_surfaces(words), microfacets(words), is_reflecting(words)
    assert light.reflected is not None
    everywhere = np.maximum(polynomials(plain.normal) @ light.ambient, 0)
    sky = mirrored(light.reflected, light.reflected.levels(), lobe_direction(glossy, away), glossy.roughness)
    strength, to_lamp = lamp_light(from_viewer, np.array(lamp.position) - view.position, lamp.range)
    lamps = linear_from_srgb(lamp.colour) * lamp.intensity * strength[:, None]
    dull = plain.albedo * everywhere + light.sun * reflected(plain, away, light.to_sun)
    dull += lamps * reflected(plain, away, to_lamp)
    shown = sky_reflection(glossy, away, sky, everywhere, np.ones(len(words)))
    shown += light.sun * microfacet(glossy, away, light.to_sun) + lamps * microfacet(glossy, away, to_lamp)
    return np.where(reflects[:, None], shown, dull)


def test_the_pass_reflects_what_the_twin_reflects(gl_device: Device) -> None:
    """Random surfaces at random distances, every other of which reflects sky, sun and a lamp."""
    rng = np.random.default_rng(1)
    lamp = {"position": (0.0, 2.0, -2.0), "range": 50.0, "intensity": 60.0}
    sky = {"model": "preetham", "light": True}
    environment = Environment.model_validate({"sky": sky, "lights": [lamp]})
    view = View(Camera((1.0, 2.0, 13.0), (0, 1, -4), 0.9), SIZE, near=2.0, far=40.0)
    targets, light, scope = Targets(gl_device, SIZE), LightPass(), gl_device.scope("test")
    light.attach(gl_device)
    ViewBlock(scope, PICTURE_VIEW).show(view)
    words = rng.integers(0, 1 << 32, (SIZE[0] * SIZE[1], 2), np.uint32)
    words[:, 1] |= 1 << 31  # none is lit already
    count = len(words[::2])
    words[::2] = reflecting_surfaces(words[::2], rng.uniform(size=count), rng.uniform(size=count))
    depth = rng.uniform(0.3, 0.98, SIZE[::-1]).astype(np.float32)
    targets.surface.write(words.tobytes())
    targets.depth.write(depth.tobytes())
    frame = SimpleNamespace(
        targets=targets,
        view=view,
        common=common_settings(RenderSettings()),
        environment=environment,
        light=lighting(environment),
        assets=SimpleNamespace(has_unlit=False, reflects=True),
        transparent=False,
        objects_part=None,
        shadows=Shadows(),
    )
    light.draw(cast(Frame, frame), LightParams())
    found = np.frombuffer(targets.lit_texture.read(), np.float16).reshape(-1, 4)
    for each in (light, targets, scope):
        each.release()

    column, row = np.meshgrid(*((np.arange(pixels) + 0.5) / pixels * 2 - 1 for pixels in SIZE))
    ray = np.stack([column, row, np.ones_like(row)], -1).reshape(-1, 3) @ view.ray_from_screen.T
    from_viewer = ray * view_distance(depth.reshape(-1, 1), *view.depth_range)
    assert is_reflecting(words).sum() == count
    expected = lit_twin(lighting(environment), environment.lights[0], words, from_viewer, view)
    np.testing.assert_allclose(found[:, :3], expected, rtol=2e-2, atol=4e-3)


def quad(path: Path, roughness: float, metalness: float) -> Mesh:
    """An upright square that faces +z, from a file."""
    glb, terms = Glb(), {"roughnessFactor": roughness, "metallicFactor": metalness}
    glb.header["materials"] = [{"pbrMetallicRoughness": terms | {"baseColorFactor": [*BASE.tolist(), 1]}}]
    glb.mesh({}, material=0)
    return load_mesh(glb.write(path / "quad.glb", {"mesh": 0}))


def shown(mesh: Mesh, representation: Representation, **environment: Any) -> tuple[Scene, ShapeLibrary]:
    scene = scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=representation, **environment)
    return scene, ShapeLibrary([mesh], None if representation in IMAGES else [None])


def middle(studio: Studio, scene: Scene, library: ShapeLibrary) -> Array:
    """The linear mean colour (3,) in the middle of the picture."""
    return np.asarray(linear_from_srgb(studio.picture(scene, library, LOW)[50:70, 70:90, :3]).mean((0, 1)))


@pytest.mark.parametrize("representation", [*POLYGONS, *IMAGES, *CAPTURED])
def test_mirrors_of_metal_show_the_sky_in_their_colour(
    studio: Studio, tmp_path: Path, representation: Representation
) -> None:
    found = middle(studio, *shown(quad(tmp_path, 0.0, 1.0), representation, **EVEN))
    assert found == pytest.approx(linear_from_srgb(np.array(SKY)) * BASE, rel=0.05)


@pytest.mark.parametrize("lit", ["deferred", "forward", "warp"])
@pytest.mark.parametrize("representation", [Representation.MESH, Representation.DPCI])
def test_other_modes_of_light_reflect_from_polygons(
    studio: Studio, tmp_path: Path, representation: Representation, lit: str
) -> None:
    """And light depth images as they did."""
    scene, library = shown(quad(tmp_path, 0.0, 1.0), representation, **EVEN)
    set_all(scene.render, {"light.mode": lit})
    reflects = lit == "deferred" or representation is Representation.MESH
    dull = BASE * (polynomials(np.array([[0.0, 0, 1]])) @ lighting(scene.environment).ambient)[0]
    expected = linear_from_srgb(np.array(SKY)) * BASE if reflects else dull
    assert middle(studio, scene, library) == pytest.approx(expected, rel=0.05)


def test_metal_scatters_nothing(studio: Studio, tmp_path: Path) -> None:
    """Under a black sky, in the sun: metal is dark beside its highlight, plastic is not."""
    dark: dict[str, Any] = {"sky": {"zenith": (0, 0, 0), "horizon": (0, 0, 0), "light": True}}
    dark |= {"sun": {"direction": (-1, -0.1, -1), "colour": (1, 1, 1), "intensity": 1.0}}
    metal, plastic = (middle(studio, *shown(quad(tmp_path, 0.2, m), Representation.MESH, **dark)) for m in (1.0, 0.0))
    assert metal.max() < 0.05 and plastic == pytest.approx(BASE * np.sqrt(0.5), rel=0.1)


def test_textures_tell_metal_from_wood(studio: Studio, tmp_path: Path) -> None:
    """A chest of dull wood, with fittings of metal: depth images keep apart what is metal, as polygons do."""
    glb = Glb()
    terms = [{"roughnessFactor": 0.1, "metallicFactor": 1.0}, {"roughnessFactor": 1.0, "metallicFactor": 0.0}]
    glb.header["materials"] = [
        {"pbrMetallicRoughness": each | {"baseColorFactor": [*BASE.tolist(), 1]}} for each in terms
    ]
    glb.mesh({}, material=0)
    glb.mesh({}, material=1)
    mesh = load_mesh(glb.write(tmp_path / "a.glb", {"mesh": 0}, {"mesh": 1, "translation": [1.2, 0, -0.1]}))
    camera = replace(LOW, position=(0.0, -0.6, 2.6))
    for representation in (Representation.MESH, Representation.DPCI):
        scene, library = shown(mesh, representation, **EVEN)
        picture = linear_from_srgb(studio.picture(scene, library, camera)[..., :3])
        metal, wood = picture[50:70, 30:50].mean((0, 1)), picture[50:70, 110:130].mean((0, 1))
        dull = BASE * (polynomials(np.array([[0.0, 0, 1]])) @ lighting(scene.environment).ambient)[0]
        assert metal == pytest.approx(linear_from_srgb(np.array(SKY)) * BASE, rel=0.05)
        assert wood == pytest.approx(dull, rel=0.05)


def test_scenes_without_it_have_their_programs(studio: Studio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nothing reflects, or the sky gives no light."""
    defines: list[bool] = []
    inputs = LightPass.inputs

    def noted(self: LightPass, *arguments: Any) -> Any:
        found = inputs(self, *arguments)
        defines.append("REFLECTIONS" in found.defines)
        return found

    monkeypatch.setattr(LightPass, "inputs", noted)
    dark = {"sky": EVEN["sky"] | {"light": False}}
    dull, glossy = quad(tmp_path, 1.0, 0.0), quad(tmp_path, 0.3, 0.0)
    for representation in (*POLYGONS, *IMAGES):
        for mesh, environment in ((dull, EVEN), (glossy, dark), (glossy, EVEN)):
            defines.clear()
            studio.picture(*shown(mesh, representation, **environment), LOW)
            assert set(defines) == {mesh is glossy and environment is EVEN}


def test_what_is_evicted_is_forgotten(gl_device: Device, tmp_path: Path) -> None:
    library = ShapeLibrary([quad(tmp_path, 0.3, 0.0), quad(tmp_path, 1.0, 0.0)], layers=1)
    store = AssetStore(gl_device, library)
    (number,), (other,) = (store.parts.numbers(asset) for asset in (0, 1))
    store.stream([number], None)
    assert store.reflects
    store.budget = 1
    store.stream([other], None)
    assert store.depth_count == 1 and not store.reflects
    store.meshes.object(0)
    assert store.reflects
    store.release()
    assert not store.reflects
