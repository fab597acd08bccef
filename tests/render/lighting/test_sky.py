"""Sky, fog and tone mapping: the shaders against their twins, and what must hold of each."""

from types import SimpleNamespace
from typing import Any, cast

import moderngl
import numpy as np
import pytest

from depthwalk.colour import LUMINANCE, linear_from_srgb, srgb_from_linear
from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.reference.fog import fog_before_sky, fog_density, fog_through
from depthwalk.reference.tone import TONES
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.lighting.harmonics import polynomials
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.lighting.sky import daylight, environment_sky, sunlight
from depthwalk.render.view.view import View
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import Environment
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from shapes import ShapeLibrary, box, scene_of

SIZE = (64, 48)


def toward(elevation: int, azimuth: float = 0.0) -> Array:
    """Unit vector; degrees."""
    rise, turn = np.radians([elevation, azimuth])
    return np.array([np.cos(rise) * np.sin(turn), np.sin(rise), np.cos(rise) * np.cos(turn)])


def sun_at(elevation: int, **sky: float) -> Environment:
    sun = {"direction": tuple(-toward(elevation)), "colour": (1, 1, 1)}
    return Environment.model_validate({"sky": {"model": "preetham"} | sky, "sun": sun})


ANY_VIEW = View(Camera((0, 0, 0), (0, 0, -1), 1.0), SIZE, near=0.1, far=10.0)


def drawn(
    gl_device: Device, name: str, result: str, view: View, defines: tuple[str, ...] = (), **values: Any
) -> tuple[Array, Array]:
    """What a pass makes of every pixel, (H · W, 4), lower row first; and the rays (H · W, 3). result: the target."""
    scope = gl_device.scope("test")
    run = *defines, f"DRAW_PASSES=draw_{name}(pixel);", f"RESULT=pixel.{result}"
    out = scope.texture(view.size, 4, "f4")
    scope.framebuffer([out]).use()
    gl_device.context.enable_only(moderngl.NOTHING)
    ViewBlock(scope, PICTURE_VIEW).show(view)
    for half in ("SURFACES", "SKY"):
        shaders = "common/far_plane.vert", "common/pixel_passes.frag"
        program = Program(scope, *shaders, (*run, half), includes=(f"{name}/{name}.glsl",))
        program.set(**values)
        program.fill()
    found = np.frombuffer(out.read(), np.float32).reshape(-1, 4)
    scope.release()
    column, row = np.meshgrid(*((np.arange(pixels) + 0.5) / pixels * 2 - 1 for pixels in view.size))
    return found, np.stack([column, row, np.ones_like(row)], -1).reshape(-1, 3) @ view.ray_from_screen.T


@pytest.mark.parametrize(
    "environment", [Environment(), Environment.model_validate({"sky": {}}), sun_at(4), sun_at(50, turbidity=6.0)]
)
@pytest.mark.parametrize("azimuth", [20, 200])
def test_the_sky_is_its_twins(gl_device: Device, environment: Environment, azimuth: int) -> None:
    sky, view = (
        environment_sky(environment),
        View(Camera((0, 0, 0), tuple(toward(25, azimuth)), 1.5), SIZE, near=0.1, far=10.0),
    )
    found, rays = drawn(gl_device, "light", "lit", view, sky.defines, **sky.uniforms())
    expected = sky.radiance(rays / np.linalg.norm(rays, axis=1, keepdims=True))
    np.testing.assert_allclose(found[:, :3], expected, rtol=2e-3, atol=1e-5)


def test_daylight_is_of_the_brightness_that_is_measured() -> None:
    """kcd/m² at the zenith and klx on level ground, as on clear to hazy days."""
    unit = 128 / np.pi
    for elevation, low, high in ((30, 2.0, 6.0), (60, 4.0, 20.0)):
        environment = sun_at(elevation, turbidity=3.0, light=True)
        zenith = environment_sky(environment).radiance(np.array([[0.0, 1, 0]]))[0] @ LUMINANCE
        level = (polynomials(np.array([[0.0, 1, 0]])) @ lighting(environment).ambient)[0] @ LUMINANCE
        assert low < zenith * unit < high
        assert 5 < level * 128 < 35


def test_a_low_sun_is_red_and_one_that_set_leaves_night() -> None:
    noon, low, dusk, night = (sun_at(elevation) for elevation in (60, 3, -3, -18))
    high, red = sunlight(noon), sunlight(low)
    assert (high > 0.5).all() and high[2] > 0.7 * high[0]
    assert red[0] < 0.5 * high[0] and red[2] < 0.1 * red[0]
    up = np.array([toward(70)])
    brightness = [environment_sky(each).radiance(up).max() for each in (low, dusk, night)]
    assert brightness[0] > 4 * brightness[1] > 0 and brightness[2] < 1e-5 * brightness[0]
    assert np.isfinite(daylight(np.array([0.0, -1, 0]), 3, 1).radiance(up)).all()


def test_the_disc_is_where_the_sun_is_and_holds_its_light(gl_device: Device) -> None:
    environment = Environment.model_validate(
        {"sky": {"sun_size": 6.0}, "sun": {"direction": tuple(-toward(20)), "intensity": 0.5}}
    )
    camera = Camera((0, 0, 0), tuple(toward(20)), 0.3)
    with HeadlessRenderer(scene_of_nothing(environment), ShapeLibrary([box(1, 1, 1)], resolution=16), SIZE) as headless:
        headless.draw(View(camera, SIZE), linear=True)
        with_disc = headless.linear_image().colour[..., :3]
        assert environment.sky is not None
        environment.sky.sun_size = 0.0
        headless.draw(View(camera, SIZE), linear=True)
        disc = with_disc - headless.linear_image().colour[..., :3]
    view = View(camera, SIZE)
    solid_angle = disc / view.focal_pixels**2  # of a pixel, nearly, so near to the middle
    assert solid_angle.sum((0, 1)) == pytest.approx(np.pi * sunlight(environment), rel=0.02)
    row, column = np.mgrid[: SIZE[1], : SIZE[0]]
    weight = disc.sum(-1) / disc.sum()
    assert ((weight * row).sum(), (weight * column).sum()) == pytest.approx((23.5, 31.5), abs=0.1)


def scene_of_nothing(environment: Environment) -> Scene:
    scene = scene_of((0, (0, -900, 0), 0.0, 0.001))
    cast(SimpleNamespace, scene).environment = environment
    return scene


FOGS = [(0.02, 0.0, 20.0), (0.3, 4.0, 1.5), (0.001, -30.0, 400.0)]


@pytest.mark.parametrize("fog", FOGS)
@pytest.mark.parametrize("viewer_y", [-6.0, 1.6, 60.0])
def test_fog_is_the_integral_of_its_density(fog: tuple[float, float, float], viewer_y: float) -> None:
    """The twin against a sum of 100,000 steps, for ways up, down, across the fog's top and level."""
    rng = np.random.default_rng(2)
    way = rng.normal(size=(40, 3)) * rng.uniform(0.1, 40, (40, 1))
    way[0, 1], way[1, 1] = 0, 1e-7
    along = (np.arange(100_000) + 0.5) / 100_000
    for each, through in zip(way, fog_through(viewer_y, way, *fog), strict=True):
        summed = fog_density(viewer_y + along * each[1], *fog).mean() * np.linalg.norm(each)
        assert through == pytest.approx(np.exp(-summed), abs=1e-6)
    rise = np.array([0.02, 0.3, 1.0])
    far = np.stack([0 * rise, rise, np.sqrt(1 - rise**2)], -1) * 1e6
    np.testing.assert_allclose(fog_before_sky(viewer_y, rise, *fog), fog_through(viewer_y, far, *fog), atol=1e-9)


@pytest.mark.parametrize("fog", FOGS)
@pytest.mark.parametrize("viewer_y", [-6.0, 1.6, 60.0])
def test_the_pass_fogs_as_its_twin(gl_device: Device, fog: tuple[float, float, float], viewer_y: float) -> None:
    rng = np.random.default_rng(3)
    view = View(Camera((0, viewer_y, 0), (0.3, viewer_y + 0.05, 1), 1.2), SIZE, near=0.2, far=300.0)
    depth = rng.uniform(0.9, 1.0, SIZE[::-1]).astype(np.float32)
    depth[: SIZE[1] // 3 * 2 : 2, ::3] = 1.0
    scope = gl_device.scope("depth")
    scope.texture(SIZE, 1, "f4", depth.tobytes()).use(0)
    density, height, falloff = fog
    scope.texture(SIZE, 1, "f4", np.ones(SIZE, np.float32).tobytes()).use(1)  # red light
    values = {
        "fog_density": density,
        "fog_height": height,
        "fog_falloff": falloff,
        "depth_texture": 0,
        "lit_texture": 1,
    }
    defines = "FOG_COLOUR", "READS_DEPTH", "READS_LIT"
    found, rays = drawn(gl_device, "fog", "lit", view, defines, fog_colour=(0, 0.2, 0.3), **values)
    scope.release()
    near, far = view.depth_range
    stored = depth.reshape(-1, 1).astype(float)
    way = rays * (near * far / (far - stored * (far - near)))
    rise = rays[:, 1] / np.linalg.norm(rays, axis=1)
    through = np.where(stored[:, 0] == 1, fog_before_sky(viewer_y, rise, *fog), fog_through(viewer_y, way, *fog))
    np.testing.assert_allclose(found[:, 0], through, atol=2e-3)
    np.testing.assert_allclose(found[:, 1:3], np.outer(1 - found[:, 0], [0.2, 0.3]), atol=1e-6)


@pytest.mark.gl
@pytest.mark.parametrize("sky", [{}, {"model": "preetham"}])
def test_dense_fog_is_all_there_is_and_shows_the_horizon(sky: dict[str, str]) -> None:
    """Ground and sky alike; with alpha, fog is on surfaces only."""
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), sky=sky, ground={}, fog={"density": 1.0, "falloff": 1e4})
    camera = Camera((0, 2, 8), (0, 2, 0), 0.8)
    with HeadlessRenderer(scene, ShapeLibrary([box(1, 1, 1)], resolution=32), SIZE) as headless:
        headless.draw(View(camera, SIZE), linear=True)
        colour = headless.linear_image().colour
        headless.draw(View(camera, SIZE), transparent=True, linear=True)
        alpha = headless.linear_image().colour
    horizon = environment_sky(scene.environment).radiance(np.array([[0.0, 0, -1]]))[0]
    assert (colour[..., 3] == 1).all()
    assert colour[:, SIZE[0] // 2, :3] == pytest.approx(np.tile(horizon, (SIZE[1], 1)), rel=0.03)
    nothing = alpha[..., 3] == 0
    assert nothing.any() and not nothing.all() and (alpha[nothing] == 0).all()


@pytest.mark.gl
def test_fog_is_as_dense_whatever_the_samples_of_a_pixel() -> None:
    """On the ground, whose fog thickens with the distance, and before the sky."""
    scene = scene_of((0, (0, -5, 0), 0.0, 1.0), sky={}, ground={}, fog={"density": 0.1, "height": 0.5, "falloff": 2})
    view, drawn = View(Camera((0, 2, 8), (0, 1, 0), 0.8), SIZE), []
    with HeadlessRenderer(scene, ShapeLibrary([box(1, 1, 1)], resolution=32), SIZE) as headless:
        for aa in ("none", "ssaa"):
            scene.render.aa = aa
            headless.draw(view, linear=True)
            drawn.append(headless.linear_image())
    apart = np.abs(drawn[0].colour - drawn[1].colour).max(-1)
    changes = np.abs(np.diff(np.isfinite(drawn[0].distance), axis=0)).any(1)  # rows above the horizon
    assert changes.sum() == 1 and np.ptp(drawn[0].colour[..., 0]) > 0.1
    assert np.delete(apart, np.flatnonzero(changes)[0] + np.arange(-1, 3), 0).max() < 4e-3


@pytest.mark.parametrize("tone", TONES)
@pytest.mark.parametrize("exposure", [0.0, -1.5])
def test_tones_are_their_twins(gl_device: Device, tone: str, exposure: float) -> None:
    rng = np.random.default_rng(6)
    light = (rng.uniform(size=(*SIZE[::-1], 4)) ** 4 * 20).astype(np.float32)
    light[..., 3] = rng.choice([0.25, 1.0], SIZE[::-1])
    scope = gl_device.scope("light")
    scope.texture(SIZE, 4, "f4", light.tobytes()).use(0)
    defines = tone.upper(), "READS_LIT"
    found, _ = drawn(gl_device, "output", "screen", ANY_VIEW, defines, lit_texture=0, exposure=2.0**exposure)
    scope.release()
    straight = light[..., :3] / light[..., 3:]
    expected = srgb_from_linear(TONES[tone](straight.reshape(-1, 3).astype(float) * 2.0**exposure))
    np.testing.assert_allclose(found[:, :3], expected, atol=2e-3)
    assert found[:, 3] == pytest.approx(light[..., 3].ravel())


def test_light_is_encoded_as_for_any_screen(gl_device: Device) -> None:
    """Its fitted curve is off by a hundredth of what 8 bits tell apart."""
    light = np.linspace(0, 1, SIZE[0] * SIZE[1], dtype=np.float32)
    scope = gl_device.scope("light")
    scope.texture(SIZE, 4, "f4", np.column_stack([light, light, light, 0 * light + 1]).tobytes()).use(0)
    found, _ = drawn(gl_device, "output", "screen", ANY_VIEW, ("READS_LIT",), lit_texture=0, exposure=1.0)
    scope.release()
    np.testing.assert_allclose(found[:, 1], srgb_from_linear(light), atol=5e-5)
    assert (found[:, 3] == 1).all()


@pytest.mark.parametrize("tone", TONES)
def test_tones_keep_black_order_and_grey(tone: str) -> None:
    grey = np.repeat(np.concatenate([[0], np.geomspace(1e-3, 40, 400)])[:, None], 3, 1)
    shown = TONES[tone](grey)
    assert np.ptp(shown, axis=1).max() < 2e-3
    assert shown[0].max() < 1e-3 and (np.diff(shown[:, 0]) > -1e-4).all()


@pytest.mark.gl
def test_exposure_doubles_what_is_shown() -> None:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), background=(0.2, 0.3, 0.1))
    camera = Camera((0, 30, 8), (0, 30, 0), 0.8)
    with HeadlessRenderer(scene, ShapeLibrary([box(1, 1, 1)], resolution=32), SIZE) as headless:
        scene.render.output.exposure = 1.0
        headless.draw(View(camera, SIZE), linear=True)
        shown, linear = headless.pixels()[0, 0, :3] / 255, headless.linear_image().colour[0, 0, :3]
    background = linear_from_srgb(scene.environment.background)
    assert linear_from_srgb(shown) == pytest.approx(2 * background, abs=5e-3)
    assert linear == pytest.approx(background, rel=2e-3)  # files of linear light are not exposed
