"""Dithering: gradients have no bands in 8 bits, and colours that 8 bits hold exactly stay as they are."""

from typing import Any

import numpy as np
import pytest

from depthwalk.colour import srgb_from_linear
from depthwalk.gpu.device import Device
from depthwalk.reference.dither import dither_noise
from depthwalk.reference.tone import TONES
from depthwalk.render.image import read_pixels
from depthwalk.render.passes.output import DITHER_AMPLITUDE
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.types import Array
from shapes import ShapeLibrary, box, scene_of
from stage import OnScreen, set_all

SIZE = (96, 64)
# A narrow part of the sky, in which no channel changes by more than some steps of 8 bits.
UP = View(Camera((0.0, 1.0, 0.0), (0.0, 2.6, -2.0), 0.12), SIZE)
NIGHT: dict[str, Any] = {"sky": {"zenith": (0.02, 0.04, 0.1), "horizon": (0.13, 0.19, 0.31)}}
LAMP: dict[str, Any] = {"lights": [{"position": (0, 3, 0), "intensity": 1.0}]}
LENS = {"dof.mode": "gather", "dof.f_number": 0.5, "dof.focal_length": 200.0, "dof.focus_distance": 1.0}


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([box(0.4, 0.4, 0.4, (0, 0, -3))], resolution=64)


def means(pixels: Array) -> Array:
    """The mean of each 8 × 8 pixels of a picture (H, W, 3 or 4)."""
    return np.asarray(pixels[..., :3].reshape(SIZE[1] // 8, 8, SIZE[0] // 8, 8, 3).mean((1, 3)))


def picture(
    device: Device, library: ShapeLibrary, environment: dict[str, Any], settings: dict[str, Any], view: View = UP
) -> Array:
    """The picture (H, W, 4) in steps of 8 bits, row 0 at the bottom."""
    scene = scene_of((0, (0, 0, 0), 0, 1.0), **environment)
    set_all(scene.render, settings)
    with OnScreen(device, scene, library, SIZE) as stage:
        stage.draw(view)
        return read_pixels(stage.screen)[::-1].astype(float)


def light(device: Device, library: ShapeLibrary, environment: dict[str, Any], settings: dict[str, Any]) -> Array:
    """What such a picture is made of (H, W, 3), linear."""
    scene = scene_of((0, (0, 0, 0), 0, 1.0), **environment)
    set_all(scene.render, settings)
    with OnScreen(device, scene, library, SIZE) as stage:
        stage.renderer.keeps = frozenset({"lit"})
        stage.draw(UP)
        assert stage.renderer.targets is not None
        lit = stage.renderer.targets.lit_texture.read(alignment=1)
    return np.frombuffer(lit, np.float16).astype(float).reshape(*SIZE[::-1], 4)[..., :3]


def test_the_noise_is_even_in_any_part_of_a_picture() -> None:
    noise = dither_noise((257, 190)) / DITHER_AMPLITUDE
    assert np.abs(noise).max() <= 1
    windows = np.lib.stride_tricks.sliding_window_view(noise, (8, 8)).reshape(-1, 64)
    assert np.abs(windows.mean(1)).max() < 0.1  # of 64 independent random numbers it would be about 0.3
    assert np.abs(windows.std(1) - 1 / 3**0.5).max() < 0.05


@pytest.mark.parametrize(
    ("environment", "settings"),
    [
        (NIGHT, {}),
        (NIGHT, {"aa": "ssaa"}),
        (NIGHT, {"aa": "fxaa"}),
        ({"sky": {"model": "preetham"}}, {"output.tone_mapping": "aces"}),
        (NIGHT | {"fog": {"density": 0.03}}, {"output.tone_mapping": "agx"}),
        (NIGHT, LENS),
    ],
)
def test_gradients_are_exact_on_average(
    gl_device: Device, library: ShapeLibrary, environment: dict[str, Any], settings: dict[str, Any]
) -> None:
    """Over 8 × 8 pixels, where rounding alone is off by half a step in the middle of a band's border."""
    linear = light(gl_device, library, environment, {}).reshape(-1, 3)
    tone = TONES[settings.get("output.tone_mapping", "none")]
    exact = means(255 * srgb_from_linear(np.clip(tone(linear), 0, 1)).reshape(*SIZE[::-1], 3))
    on, off = (
        np.abs(means(picture(gl_device, library, environment, settings | {"output.dither": dither})) - exact).max()
        for dither in (True, False)
    )
    assert on < 0.15 and off > 0.25


@pytest.mark.parametrize("settings", [{}, {"aa": "ssaa"}, {"aa": "fxaa"}, {"fused": False}, LENS])
def test_a_plain_background_is_the_colour_that_was_asked_for(
    gl_device: Device, library: ShapeLibrary, settings: dict[str, Any]
) -> None:
    for step in range(3, 256, 28):
        colour = np.array([step, 255 - step, step // 2])
        pixels = picture(gl_device, library, {"background": tuple((colour / 255).tolist()), **LAMP}, settings)
        np.testing.assert_array_equal(pixels, np.broadcast_to([*colour, 255], pixels.shape))


def test_a_scene_without_sky_fog_and_lamps_has_no_noise(gl_device: Device, library: ShapeLibrary) -> None:
    view = View(Camera((0.0, 1.0, 0.0), (0.0, 0.0, -3.0), 0.9), SIZE)
    for environment, noisy in (({}, False), (LAMP, True)):
        pictures = [
            picture(gl_device, library, environment | {"ground": {"height": 0.0}}, {"output.dither": dither}, view)
            for dither in (True, False)
        ]
        assert (pictures[0] != pictures[1]).any() == noisy


def test_linear_pictures_have_no_noise(gl_device: Device, library: ShapeLibrary) -> None:
    """As EXR files hold them."""
    dithered, plain = (light(gl_device, library, NIGHT, {"output.dither": dither}) for dither in (True, False))
    np.testing.assert_array_equal(dithered, plain)
