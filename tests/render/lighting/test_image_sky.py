"""Pictures as the sky: their light where it can be computed by hand, and the shader against its twin."""

import math
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.pictures import png_bytes
from depthwalk.reference.fog import fog_colour
from depthwalk.reference.image_sky import pixel_level, sky_radiance
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.lighting.harmonics import polynomials
from depthwalk.render.lighting.image_sky import (
    ImageSky,
    SkyImages,
    image_irradiance,
    prepare_sky_image,
    texel_directions,
    turned_light,
)
from depthwalk.render.lighting.irradiance import irradiance, lighting, sphere_directions
from depthwalk.render.view.view import View
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import Environment
from depthwalk.types import Array
from shapes import ShapeLibrary, box, scene_of

SIZE = (64, 48)
RNG = np.random.default_rng(4)
AXES = {"-z": (0, 0, -1), "+x": (1, 0, 0), "+z": (0, 0, 1), "-x": (-1, 0, 0), "up": (0, 1, 0), "down": (0, -1, 0)}


def directions(count: int = 200) -> Array:
    found = RNG.normal(size=(count, 3))
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def picture_of(radiance: Any, height: int = 64) -> np.ndarray:
    """A picture (H, 2 H, 3) of a function of directions (n, 3)."""
    direction, _ = texel_directions(height, 2 * height)
    light = np.broadcast_to(np.asarray(radiance(direction), np.float32), (len(direction), 3))
    return np.ascontiguousarray(light.reshape(height, 2 * height, 3))


def sky_of(texels: np.ndarray, turn: float = 0.0, intensity: float = 1.0) -> ImageSky:
    return ImageSky(image=prepare_sky_image(texels), turn=math.radians(turn), intensity=intensity)


def bright(direction: Array) -> Array:
    """A smooth sky without any symmetry."""
    x, y, z = direction.T
    return np.stack([2 + x + y * z, 1 + 0.5 * z + x * y, 1.5 + y + 0.5 * x * z], -1)


def test_texels_cover_the_sphere() -> None:
    direction, weight = texel_directions(20, 40)
    assert weight.sum() == pytest.approx(4 * np.pi) and np.linalg.norm(direction, axis=1) == pytest.approx(1)
    grid = direction.reshape(20, 40, 3)
    assert grid[0, :, 1].min() > 0.99 and grid[9, 19, 2] < -0.99 and grid[9, 29, 0] > 0.99
    assert (weight @ polynomials(direction)[:, 1:]) == pytest.approx(0, abs=0.03)


def test_even_light_lights_all_surfaces_evenly() -> None:
    sky = sky_of(picture_of(lambda direction: [0.2, 0.5, 3.0]), turn=33, intensity=2)
    assert polynomials(directions()) @ sky.ambient(True) == pytest.approx(np.tile([0.4, 1, 6], (200, 1)), rel=1e-3)
    assert sky.sun() is None and (sky.ambient(False) == sky.ambient(True)).all()


def test_a_cosine_lobe_lights_as_computed_by_hand() -> None:
    """Light max(cos a, 0) from around +x is 1/4 + 1/2 P1 + 5/16 P2 + …; surfaces get 1, 2/3 and 1/4 of these."""
    sky = sky_of(picture_of(lambda direction: np.maximum(direction[:, :1], 0)))
    cosine = directions()
    expected = 1 / 4 + 2 / 3 / 2 * cosine[:, 0] + 1 / 4 * 5 / 16 * (3 * cosine[:, 0] ** 2 - 1) / 2
    found = polynomials(cosine) @ sky.ambient(True)
    assert found == pytest.approx(np.repeat(expected[:, None], 3, 1), abs=2e-3)
    facing = polynomials(np.array([[1.0, 0, 0]])) @ sky.ambient(True)
    assert facing == pytest.approx(2 / 3, abs=0.01)  # the integral of cos² / π


def test_any_light_is_summed_as_that_of_other_skies() -> None:
    other, _ = sphere_directions()
    direction, weight = texel_directions(128, 256)
    assert image_irradiance(bright(direction), direction, weight) == pytest.approx(irradiance(bright(other)), abs=2e-3)


@pytest.mark.parametrize("turn", [0.0, 30.0, 90.0, -200.0])
def test_light_turns_as_the_picture_does(turn: float) -> None:
    angle = math.radians(turn)
    about_y = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    light, normal = RNG.normal(size=(9, 3)), directions()
    turned = polynomials(normal @ about_y.T) @ turned_light(light, angle)
    assert turned == pytest.approx(polynomials(normal) @ light)
    spot = np.array([0.6, 0.48, -0.64])
    sky = sky_of(picture_of(lambda direction: 0.1 + 500.0 * (direction @ spot > 0.999)[:, None], 256), turn)
    found = sky.sun()
    assert found is not None and found[0] == pytest.approx(about_y @ spot, abs=2e-3)
    assert sky_radiance(sky, found[0][None], np.zeros(1)).min() > 400


def test_the_brightest_spot_becomes_the_sun_and_no_light_is_lost() -> None:
    spot, size = np.array([0.6, 0.48, -0.64]), 0.002
    texels = picture_of(lambda direction: 0.3 + 2000.0 * (direction @ spot > 1 - size)[:, None], 256)
    sky = sky_of(texels, intensity=0.5)
    direction, weight = texel_directions(256, 512)
    found = sky.sun()
    assert found is not None
    light = 2000 * weight[direction @ spot > 1 - size].sum() / np.pi
    assert found[1] == pytest.approx(np.full(3, 0.5 * light), rel=1e-3)
    assert sky.ambient(False)[0] == pytest.approx(np.full(3, 0.15), rel=1e-3)  # mean radiance
    assert sky.ambient(True)[0] == pytest.approx(0.15 + found[1] / 4, rel=1e-3)


def test_soft_light_is_no_sun() -> None:
    wide = picture_of(lambda direction: 0.1 + 9.0 * (direction[:, :1] > 0.9))
    assert sky_of(wide).sun() is None
    assert sky_of(picture_of(bright)).sun() is None
    assert sky_of(picture_of(lambda direction: 0.0)).sun() is None


def environment(**sky: Any) -> Environment:
    return Environment.model_validate({"sky": {"model": "image", "image": "sky.png"} | sky})


def test_what_lights_the_scene() -> None:
    spot = np.array([0.6, 0.48, -0.64])
    image = prepare_sky_image(picture_of(lambda direction: 0.1 + 500.0 * (direction @ spot > 0.999)[:, None], 256))
    plain = lighting(Environment())
    shown, lit, sunny, both = (
        lighting(environment(**sky), lambda path: image)
        for sky in ({}, {"light": True}, {"sun": True}, {"light": True, "sun": True})
    )
    assert (shown.ambient == plain.ambient).all() and (shown.sun == plain.sun).all()
    assert (lit.ambient == image.ambient).all() and (lit.to_sun == plain.to_sun).all()
    assert (sunny.ambient == plain.ambient).all() and sunny.to_sun == pytest.approx(spot, abs=2e-3)
    assert (both.ambient == image.ambient_without_sun).all() and (both.sun == image.sun).all()
    even = prepare_sky_image(picture_of(lambda direction: 0.1))
    dark = lighting(environment(sun=True), lambda path: even)
    assert (dark.sun == 0).all() and (dark.to_sun == plain.to_sun).all()


def test_programs_without_pictures_say_so() -> None:
    with pytest.raises(InputError, match=r"sky\.png: a picture as the sky is not supported here"):
        lighting(environment())


def test_a_picture_is_read_once_until_another_one_is_shown() -> None:
    read: list[Path] = []
    images = SkyImages(lambda path: read.append(path) or picture_of(bright, 4))
    first = images(Path("a"))
    assert images(Path("a")) is first and images(Path("b")) is not first and read == [Path("a"), Path("b")]


def test_fog_has_the_smoothed_colour_of_the_horizon() -> None:
    glow = sky_of(picture_of(lambda direction: 0.2 + 3.0 * (direction[:, :1] > 0.95)), turn=90)  # now toward −z
    level = np.array([[0.0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 0, 1], [0, 1, 0], [0, -1, 0]])
    ahead, right, left, behind, up, down = fog_colour(glow, level)[:, 0]
    assert ahead > 2 * up and right == pytest.approx(left, rel=1e-3) and up == down
    assert right > behind and behind == pytest.approx(0.2, abs=0.01)
    around = np.radians(np.arange(360))
    ring = np.stack([np.sin(around), 0 * around, -np.cos(around)], -1)
    assert fog_colour(glow, ring).mean() == pytest.approx(up, rel=1e-3)
    assert fog_colour(sky_of(picture_of(lambda direction: 0.7)), directions()) == pytest.approx(0.7, rel=1e-3)


VIEWS = {
    "ahead": (Camera((0, 0, 0), (0.0, 0.1, -1), 1.0), SIZE),
    "seam": (Camera((0, 0, 0), (0.0, 0.0, 1), 0.6), SIZE),
    "zenith": (Camera((0, 0, 0), (0.0, 1.0, -1e-4), 1.2), (65, 49)),
    "nadir": (Camera((0, 0, 0), (0.01, -1.0, 0.0), 1.2), SIZE),
    "narrow": (Camera((0, 0, 0), (-1.0, 0.3, 0.2), 0.05), SIZE),
    "wide": (Camera((0, 0, 0), (1.0, 0.2, 0.3), 2.7), SIZE),
}


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("height", [32, 37])
def test_the_shader_is_its_twin(gl_device: Device, name: str, height: int) -> None:
    """Of a picture whose mip levels all differ, at the seam, the poles, magnified and reduced, and any size."""
    camera, size = VIEWS[name]
    view = View(camera, size, near=0.1, far=10.0)
    sky = sky_of(RNG.uniform(0, 2, (height, 2 * height, 3)).astype(np.float32), turn=70, intensity=1.5)
    scope = gl_device.scope("test")
    out = scope.texture(size, 4, "f4")
    texture = scope.sky_texture(sky.image.levels)
    scope.framebuffer([out]).use()
    gl_device.context.enable_only(moderngl.NOTHING)
    ViewBlock(scope, PICTURE_VIEW).show(view)
    run = "DRAW_PASSES=draw_light(pixel);", "RESULT=pixel.lit", "SKY", *sky.defines
    program = Program(scope, "common/far_plane.vert", "common/pixel_passes.frag", run, includes=("light/light.glsl",))
    texture.use(0)
    program.set(sky_image=0, **sky.uniforms())
    program.fill()
    found = np.frombuffer(out.read(), np.float32).reshape(-1, 4)[:, :3]
    scope.release()
    column, row = np.meshgrid(*((np.arange(pixels) + 0.5) / pixels * 2 - 1 for pixels in size))
    rays = np.stack([column, row, np.ones_like(row)], -1).reshape(-1, 3) @ view.ray_from_screen.T
    unit = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    expected = sky_radiance(sky, unit, pixel_level(sky, view, rays))
    apart = np.abs(found - expected).max(1)
    # Drivers filter with 8 bits, and choose levels with fewer.
    assert np.isfinite(found).all() and np.quantile(apart, 0.99) < 0.03 and apart.max() < 0.2


@pytest.mark.gl
@pytest.mark.parametrize("turn", [0, 90, 180, -90])
def test_a_picture_is_seen_where_it_says(tmp_path: Path, turn: int) -> None:
    """Six sides, each of a colour of its own; turned counter-clockwise, what was ahead is on the left."""
    colours = np.random.default_rng(0).permutation(np.mgrid[30:240:3j, 60:220:2j].reshape(2, -1).T).astype(np.uint8)
    colours = np.column_stack([colours, np.arange(6) * 40]).astype(np.uint8)
    direction, _ = texel_directions(32, 64)
    texels = colours[(direction @ np.array(list(AXES.values())).T).argmax(1)].reshape(32, 64, 3)
    (file := tmp_path / "sides.png").write_bytes(png_bytes(texels))
    scene = scene_of((0, (0, -900, 0), 0.0, 0.001), sky={"model": "image", "image": file, "turn": turn})
    around = list(AXES)[:4]
    with HeadlessRenderer(scene, ShapeLibrary([box(1, 1, 1)], resolution=16), SIZE) as headless:
        for name, axis in AXES.items():
            headless.draw(View(Camera((0, 0, 0), (axis[0], axis[1], axis[2] - 1e-4), 0.5), SIZE))
            seen = headless.pixels()[SIZE[1] // 2, SIZE[0] // 2, :3].astype(int)
            shown = around[(around.index(name) + turn // 90) % 4] if name in around else name
            assert np.abs(seen - colours[list(AXES).index(shown)]).max() <= 1, (name, shown)


@pytest.mark.gl
def test_another_picture_replaces_the_first_and_memory_is_freed(tmp_path: Path) -> None:
    for name, grey in (("a.png", 50), ("b.png", 200)):
        (tmp_path / name).write_bytes(png_bytes(np.full((8, 16, 3), grey, np.uint8)))
    scene = scene_of((0, (0, -900, 0), 0.0, 0.001), sky={"model": "image", "image": tmp_path / "a.png"})
    view = View(Camera((0, 0, 0), (0, 0, -1), 0.5), SIZE)
    sky, textures = scene.environment.sky, []
    assert sky is not None
    with HeadlessRenderer(scene, ShapeLibrary([box(1, 1, 1)], resolution=16), SIZE) as headless:
        for name, expected in (("a.png", 50), ("b.png", 200), ("a.png", 50)):
            sky.image = tmp_path / name
            headless.draw(view)
            assert np.abs(headless.pixels()[..., :3].astype(int) - expected).max() <= 1
            textures.append(headless.device.live["texture"])
    assert len(set(textures)) == 1


@pytest.mark.gl
def test_a_picture_that_cannot_be_used_is_found_before_the_first_frame(tmp_path: Path) -> None:
    (tmp_path / "a.hdr").write_bytes(b"#?RADIANCE")
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), sky={"model": "image", "image": tmp_path / "a.hdr"})
    with pytest.raises(InputError, match=r"a\.hdr: the header has no end"):
        HeadlessRenderer(scene, ShapeLibrary([box(1, 1, 1)], resolution=16), SIZE)
