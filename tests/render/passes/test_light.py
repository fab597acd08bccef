"""Sun, ambient light and lamps: the pass against its twin, the paper's place for it, and laws that light obeys."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from depthwalk.colour import linear_from_srgb
from depthwalk.gpu.device import Device
from depthwalk.pictures import LinearImage
from depthwalk.reference.gbuffer import is_unlit, unlit_surfaces, unpacked_surfaces
from depthwalk.reference.light import Surfaces, lamp_light, phong, reflected
from depthwalk.render.frame import Frame, common_settings
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.lighting.harmonics import polynomials
from depthwalk.render.lighting.irradiance import irradiance, lighting, sphere_directions
from depthwalk.render.lighting.light_clusters import SLICES, SQUARE, lamp_table, visible_lamps
from depthwalk.render.passes.light import LightPass
from depthwalk.render.shadows.casters import Shadows
from depthwalk.render.targets import Targets
from depthwalk.render.view.view import View, view_distance
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.effect_settings import LightParams
from depthwalk.scene.environment import Environment
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from modes import AaName
from shapes import ShapeLibrary, box, scene_of, sphere

SIZE = (150, 70)  # neither a whole number of squares
WHITE = (1.0, 1.0, 1.0)


def random_lamps(rng: np.random.Generator, count: int, far: float = 12.0) -> list[dict[str, Any]]:
    """Half of them spot lights."""
    lamps = []
    for k in range(count):
        axis = {"direction": tuple(rng.normal(size=3)), "angle": rng.uniform(20, 150)} if k % 2 else {}
        position, colour = tuple(rng.uniform(-far, far, 3)), tuple(rng.uniform(size=3))
        lamps.append({"position": position, "colour": colour, "range": rng.uniform(1, far), "intensity": 5.0} | axis)
    return lamps


def lit_twin(environment: Environment, surfaces: Surfaces, from_viewer: Array, view: View) -> Array:
    """Linear RGB (n, 3) of surfaces that are `from_viewer` (n, 3) off, metres."""
    away = from_viewer / np.linalg.norm(from_viewer, axis=1, keepdims=True)
    sun = linear_from_srgb(environment.sun.colour) * environment.sun.intensity
    ambient = linear_from_srgb(environment.ambient.colour) * environment.ambient.intensity
    colour = phong(surfaces, away, lighting(environment).to_sun, sun, ambient)
    for lamp in environment.lights:
        axis = None if lamp.direction is None else np.array(lamp.direction) / np.linalg.norm(lamp.direction)
        place = np.array(lamp.position) - view.position
        strength, to_lamp = lamp_light(from_viewer, place, lamp.range, axis, np.radians(lamp.angle))
        light = linear_from_srgb(lamp.colour) * lamp.intensity * strength[:, None]
        colour += light * reflected(surfaces, away, to_lamp)
    return colour


@pytest.mark.parametrize("count", [0, 3, 90])
def test_the_pass_lights_what_the_twin_lights(gl_device: Device, count: int) -> None:
    """Random surfaces at random distances: each is reached by all lamps that should reach it."""
    rng = np.random.default_rng(count)
    environment = Environment.model_validate({"lights": random_lamps(rng, count)})
    view = View(Camera((1.0, 2.0, 13.0), (0, 1, -4), 0.9), SIZE, near=2.0, far=40.0)
    targets, light, scope = Targets(gl_device, SIZE), LightPass(), gl_device.scope("test")
    light.attach(gl_device)
    ViewBlock(scope, PICTURE_VIEW).show(view)
    words = rng.integers(0, 1 << 32, (SIZE[0] * SIZE[1], 2), np.uint32)
    words[:, 1] |= 1 << 31  # none is lit already
    if count:
        words[::3] = unlit_surfaces(words[::3])
    depth = rng.uniform(0.3, 0.98, SIZE[::-1]).astype(np.float32)
    targets.surface.write(words.tobytes())
    targets.depth.write(depth.tobytes())
    frame = SimpleNamespace(
        targets=targets,
        view=view,
        common=common_settings(RenderSettings()),
        environment=environment,
        light=lighting(environment),
        assets=SimpleNamespace(has_unlit=count > 0, reflects=False),
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
    surfaces = unpacked_surfaces(words)
    expected = lit_twin(environment, surfaces, from_viewer, view)
    unlit = is_unlit(words)
    assert unlit.sum() == (len(words[::3]) if count else 0)
    expected[unlit] = surfaces.albedo[unlit]
    assert (found[:, 3] == 1).all()
    np.testing.assert_allclose(found[:, :3], expected, rtol=6e-3, atol=2e-3)
    by_lamps = np.abs(expected - lit_twin(Environment(), surfaces, from_viewer, view)).max(1) > 0.01
    assert by_lamps.any() == (count > 0)


def test_lists_name_each_lamp_where_it_is_seen() -> None:
    """Points of lamps' spheres that are in the picture: the list of their cell names the lamp."""
    rng = np.random.default_rng(4)
    environment = Environment.model_validate({"lights": random_lamps(rng, 40)})
    view = View(Camera((0.0, 2.0, 14.0), (0, 1, 0), 0.9), SIZE, near=0.1, far=60.0)
    lamps = visible_lamps(view, lamp_table(environment.lights))
    place = lamps.records["place"].astype(float)
    direction = rng.normal(size=(len(place), 60, 3))
    direction *= rng.uniform(0, 1, (len(place), 60, 1)) / np.linalg.norm(direction, axis=-1, keepdims=True)
    x, y, forward = np.moveaxis((place[:, None, :3] + direction * place[:, None, 3:]) @ view.axes.T, -1, 0)
    at = np.stack([x, y], -1) / np.where(forward > 0.1, forward, np.nan)[..., None] / view.half_extent
    lamp, point = np.nonzero((np.abs(at) < 1).all(-1))
    column, row = np.floor((at[lamp, point] + 1) / 2 * SIZE / SQUARE).astype(int).T
    level = np.clip(np.floor(2 * np.log2(forward[lamp, point])), 0, SLICES - 1).astype(int)
    cell = (level * lamps.across[1] + row) * lamps.across[0] + column
    first, count = lamps.cells["numbers"][cell, :2].astype(int).T
    numbers = lamps.lists["numbers"].reshape(-1)
    named = [k in numbers[start : start + length] for k, start, length in zip(lamp, first, count, strict=True)]
    assert len(named) > 500 and all(named)
    assert lamps.cells["numbers"][:, 1].mean() < 0.4 * len(place)  # they do not name all of them


def linear_picture(scene: Scene, library: ShapeLibrary, camera: Camera, size: tuple[int, int] = SIZE) -> LinearImage:
    with HeadlessRenderer(scene, library, size) as headless:
        headless.draw(View(camera, size), linear=True)
        return headless.linear_image()


@pytest.mark.gl
def test_light_stays_finite() -> None:
    """A strong lamp just above white ground: half floats end at 65504, and infinity, blended, is no number."""
    lamp = {"position": (0, 0.02, 0), "intensity": 10000.0, "range": 100.0}
    scene = scene_of((0, (0, 0, 9), 0.0, 1.0), ground={"colour": WHITE}, lights=[lamp])
    library = ShapeLibrary([box(0.1, 0.1, 0.1)], resolution=16)
    picture = linear_picture(scene, library, Camera((0, 2, 0.001), (0, 0, 0), 0.1))
    assert 6e4 < picture.colour.max() < np.inf


@pytest.mark.gl
@pytest.mark.parametrize("away", [1.0, 2.0, 4.0])
def test_light_falls_with_the_square_of_the_distance(away: float) -> None:
    """White ground straight below a lamp of strength 3."""
    lamp = {"position": (0, away, 0), "intensity": 3.0, "range": 1000.0, "colour": WHITE}
    dark: dict[str, Any] = {"sun": {"intensity": 0.0}, "ambient": {"intensity": 0.0}}
    scene = scene_of((0, (0, 0, 9), 0.0, 1.0), ground={"colour": WHITE}, lights=[lamp], **dark)
    library = ShapeLibrary([box(0.1, 0.1, 0.1)], resolution=16)
    picture = linear_picture(scene, library, Camera((0, 5, 0.001), (0, 0, 0), 0.1))
    assert picture.colour[SIZE[1] // 2, SIZE[0] // 2, :3] == pytest.approx(3 / away**2, rel=2e-3)


@pytest.mark.parametrize("axis", [(0, 1, 0), (1, 0, 0), (0.6, -0.8, 0), (0, 0, -1)])
def test_the_light_of_an_even_sky_is_even(axis: tuple[float, float, float]) -> None:
    """The furnace: a white surface shows what is all around it, whichever way it faces; half of it shows half."""
    direction, _ = sphere_directions()
    normal = np.array([axis], float)
    even = irradiance(np.ones((len(direction), 3)))
    assert polynomials(normal) @ even == pytest.approx(np.ones((1, 3)), abs=1e-3)
    rng = np.random.default_rng(1)
    smooth = polynomials(direction) @ rng.uniform(-0.1, 0.1, (9, 3)) + 1
    cosine = np.maximum(direction @ normal[0], 0)
    expected = (cosine[:, None] * smooth).sum(0) * 4 / len(direction)
    assert (polynomials(normal) @ irradiance(smooth))[0] == pytest.approx(expected, abs=2e-3)


@pytest.mark.gl
def test_white_ground_under_an_even_sky_shows_the_sky() -> None:
    colour = (0.7, 0.8, 0.9)
    sky = {"zenith": colour, "horizon": colour, "light": True}
    scene = scene_of((0, (0, 0, 9), 0.0, 1.0), ground={"colour": WHITE}, sky=sky, sun={"intensity": 0.0})
    library = ShapeLibrary([box(0.1, 0.1, 0.1)], resolution=16)
    picture = linear_picture(scene, library, Camera((0, 2, 6), (0, 2, 0), 0.9))
    below, above = picture.colour[-1, 10, :3], picture.colour[0, 10, :3]
    assert above == pytest.approx(linear_from_srgb(colour), rel=2e-3)
    assert below == pytest.approx(above, rel=5e-3)


@pytest.mark.gl
@pytest.mark.parametrize("representation", [Representation.DPCI, Representation.DMESH])
def test_forward_and_deferred_agree(representation: Representation) -> None:
    """The paper's place for lighting: within the rounding of the G-buffer; what is in front of it is lit too."""
    library = ShapeLibrary([sphere(0.7, 64, 32), box(0.8, 0.8, 0.8, (0, 0.4, 0))], resolution=64)
    places = (0, (-0.6, -0.2, 0), 0.5, 1.3), (1, (0.6, 0, -0.5), 0.4, 0.8), (0, (0.2, -0.9, 1.0), 1.0, 1.0)
    scene = scene_of(*places, representation=representation, sky={"light": True}, ground={})
    scene.objects.representation[2] = Representation.MESH
    pictures = []
    for mode in ("deferred", "forward"):
        scene.render.light.mode = mode
        pictures.append(linear_picture(scene, library, Camera((0.3, 1.2, 4.2), (0.2, 0.6, 0), 0.8)).colour)
    difference = np.abs(pictures[0] - pictures[1])
    assert 0 < difference.mean() < 2e-3 and difference.max() < 0.02


@pytest.mark.gl
@pytest.mark.parametrize("aa", ["none", "msaa"])
def test_forward_and_deferred_agree_in_shadow(aa: AaName) -> None:
    """Two boxes partly in the shadow of a ball of polygons: within rounding, but for pixels at its edge."""
    library = ShapeLibrary([sphere(0.7, 64, 32), box(0.8, 0.8, 0.8, (0, 0.4, 0))], resolution=64)
    places = (1, (-0.5, 0, 0), 0.0, 1.0), (1, (0.7, 0, 0), 0.0, 1.2), (0, (0.5, 0.3, 1.3), 0.0, 0.5)
    scene = scene_of(*places, representation=Representation.DPCI, ground={}, sun={"direction": (-0.4, -0.25, -0.8)})
    scene.objects.representation[2] = Representation.MESH
    scene.render.aa = aa
    pictures = {}
    for shadows in (False, True):
        scene.render.shadows.enabled = shadows
        for mode in ("deferred", "forward"):
            scene.render.light.mode = mode
            pictures[mode, shadows] = linear_picture(scene, library, Camera((-1, 1.4, 3.4), (0.1, 0.5, 0), 0.8)).colour
    difference = np.abs(pictures["deferred", True] - pictures["forward", True])
    assert 0 < difference.mean() < 2e-3 and np.quantile(difference, 0.999) < 0.02
    on_box = pictures["forward", False][..., 0] > 2 * pictures["forward", False][..., 1]  # the ground is green
    assert ((pictures["forward", False] - pictures["forward", True])[on_box, 0] > 0.2).sum() > 100


@pytest.mark.gl
def test_forward_lighting_leaves_lamps_to_the_polygons() -> None:
    library = ShapeLibrary([sphere(0.7, 64, 32)], resolution=64)
    camera, lamp = Camera((0.3, 1.2, 3.0), (0.2, 0.6, 0), 0.8), {"position": (0, 2, 2), "intensity": 2.0}
    pictures = {}
    for lights in ([], [lamp]):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0), ground={"height": 0.1}, lights=lights)
        scene.render.light.mode = "forward"
        pictures[len(lights)] = linear_picture(scene, library, camera).colour
    changed = np.abs(pictures[0] - pictures[1]).max(-1) > 0.01
    middle = SIZE[1] // 2, SIZE[0] // 2
    assert not changed[middle] and changed[-1].all()
