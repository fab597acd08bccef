"""The finished picture: sRGB of linear light, exposed, and the mean of samples."""

from typing import Literal

import numpy as np
import pytest

from alone import VIEW, MakeAlone
from depthwalk.colour import linear_from_srgb, srgb_from_linear
from depthwalk.reference.dither import dithered
from depthwalk.render.image import read_pixels
from depthwalk.render.passes.output import OutputPass
from depthwalk.render.view.view import View
from depthwalk.scene.effect_settings import OutputParams
from depthwalk.scene.environment import Environment, SkyParams
from depthwalk.scene.render_settings import RenderSettings

SKY = Environment(sky=SkyParams())


def test_linear_light_becomes_srgb(alone: MakeAlone) -> None:
    output = alone(OutputPass())
    light = np.linspace(0, 1, 8 * 12 * 3).reshape(8, 12, 3)
    output.fill_lit(np.dstack([light, np.ones((8, 12))]))
    output.draw(OutputParams(tone_mapping="none"))
    expected = 255 * srgb_from_linear(light.astype(np.float16).astype(float))
    assert np.abs(read_pixels(output.targets.screen)[::-1, :, :3] - expected).max() <= 1


@pytest.mark.parametrize("tone_mapping", ["none", "reinhard", "aces", "agx"])
def test_infinite_light_is_white(alone: MakeAlone, tone_mapping: Literal["none", "reinhard", "aces", "agx"]) -> None:
    """Where translucent surfaces glow in front of each other, the sum may be more than `lit` can hold."""
    output = alone(OutputPass())
    output.fill_lit((np.inf, np.inf, np.inf, 1.0))
    output.draw(OutputParams(tone_mapping=tone_mapping))
    assert (read_pixels(output.targets.screen)[0, 0, :3] >= 250).all()


def test_exposure_doubles_light_per_stop(alone: MakeAlone) -> None:
    output = alone(OutputPass())
    output.fill_lit((0.1, 0.2, 0.05, 1.0))
    output.draw(OutputParams(tone_mapping="none", exposure=2.0))
    expected = 255 * srgb_from_linear(np.array([0.4, 0.8, 0.2]))
    assert read_pixels(output.targets.screen)[0, 0, :3] == pytest.approx(expected, abs=1)


def test_a_transparent_picture_keeps_its_colours(alone: MakeAlone) -> None:
    """Light is premultiplied, the picture is not."""
    output = alone(OutputPass())
    output.fill_lit((0.25, 0.1, 0.0, 0.5))
    output.draw(OutputParams(tone_mapping="none"))
    *colour, alpha = read_pixels(output.targets.screen)[0, 0].astype(int).tolist()
    assert colour == pytest.approx(255 * srgb_from_linear(np.array([0.5, 0.2, 0.0])), abs=1)
    assert alpha == pytest.approx(127.5, abs=1)


def test_supersampled_it_is_the_mean_of_what_a_screen_can_show(alone: MakeAlone) -> None:
    """Of four samples three are black and one is far too bright: that one counts as white."""
    settings = RenderSettings(aa="ssaa")
    output = alone(OutputPass())
    light = np.zeros((8, 12, 4))
    light[..., 3] = 1
    light[::2, ::2, :3] = 100.0
    output.fill_lit(light)
    output.targets.screen = output.scope.framebuffer([output.scope.texture((6, 4), 4)])
    output.draw(OutputParams(tone_mapping="none"), settings=settings)
    expected = 255 * srgb_from_linear(np.full(3, 0.25))
    assert np.abs(read_pixels(output.targets.screen)[..., :3] - expected).max() <= 1


def test_the_noise_is_that_of_the_twin(alone: MakeAlone) -> None:
    view = View(VIEW.camera, (64, 48), near=0.1, far=50.0)
    output = alone(OutputPass(), view)
    screen = np.linspace(0.1, 0.3, 48 * 64 * 3).reshape(48, 64, 3)
    output.fill_lit(np.dstack([linear_from_srgb(screen), np.ones((48, 64))]))
    output.draw(OutputParams(dither=True), environment=SKY)
    found = read_pixels(output.targets.screen)[::-1, :, :3].astype(int)
    expected = np.round(255 * dithered(screen))
    assert np.abs(found - expected).max() <= 1
    assert (found != expected).mean() < 0.05  # half floats are not exact
    assert (found != np.round(255 * screen)).mean() > 0.15


def test_nothing_stays_nothing(alone: MakeAlone) -> None:
    """In a transparent picture, whose alpha has no noise either."""
    output = alone(OutputPass())
    for lit, expected in (((0.0,) * 4, [0, 0, 0, 0]), ((0.5, 0.5, 0.5, 0.5), [255, 255, 255, 128])):
        output.fill_lit(lit)
        output.draw(OutputParams(dither=True), environment=SKY)
        assert (read_pixels(output.targets.screen) == expected).all()


def test_colours_that_8_bits_hold_stay_as_they_are(alone: MakeAlone) -> None:
    """Whatever the noise, and though `lit` has half floats."""
    output = alone(OutputPass(), View(VIEW.camera, (64, 64), near=0.1, far=50.0))
    for step in range(256):
        output.fill_lit((*linear_from_srgb(np.full(3, step / 255)).tolist(), 1.0))
        output.draw(OutputParams(dither=True), environment=SKY)
        assert (read_pixels(output.targets.screen)[..., :3] == step).all(), step
