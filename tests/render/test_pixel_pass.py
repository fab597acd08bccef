"""Passes that need no other pixel: drawn by one program they show what they show apart."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.gpu.failures import GpuError
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.image import has_texture, read_pixels
from depthwalk.render.passes import default_passes, light
from depthwalk.render.passes.sun import SunPass
from depthwalk.render.pixel_pass import PixelInputs, PixelPass, PixelPrograms
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene
from shapes import ShapeLibrary, box, scene_of, sphere
from stage import OnScreen, set_all

SIZE = (161, 120)
# From here no pixel lies on a threshold of FXAA's, where the least difference would decide.
VIEW = View(Camera((0.05, 1.4, 4.0), (0.1, 0.7, 0.0), 0.9), SIZE)
LAMP = {"position": (0.5, 2.0, 1.5), "direction": (0, -1, -0.2), "intensity": 4.0, "range": 6.0}
OUTDOORS: dict[str, Any] = {"sky": {"model": "preetham"}, "ground": {"height": 0.0}, "fog": {"density": 0.05}}
INVERTED = """// Inverts the picture.
#include "common/pixel.glsl"
uniform float strength;
void draw_inverted(inout Pixel pixel) { pixel.lit.rgb = mix(pixel.lit.rgb, 1.0 - pixel.lit.rgb, strength); }
"""


class Inverted(PixelPass[Params]):
    name = "inverted"
    reads = ("lit",)
    writes = ("lit",)

    def inputs(self, frame: Frame, params: Params) -> PixelInputs:
        return PixelInputs(uniforms={"strength": 1.0})


class ReadsLight(Pass[Params]):
    """Draws nothing, after the picture is finished."""

    name = "reads_light"
    reads = ("lit",)

    def setup(self, gl: Any) -> None:
        pass

    def draw(self, frame: Frame, params: Params) -> None:
        assert frame.targets.lit_texture is not None


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([sphere(0.6, 32, 16), box(0.8, 0.8, 0.8, (0, 0.4, 0))], resolution=64)


def still_life(**environment: Any) -> Scene:
    scene = scene_of((0, (-0.8, 0.6, 0), 0.0, 1.0), (1, (0.9, 0, 0.3), 0.5, 1.0), **environment)
    scene.objects.representation[1:] = Representation.MESH
    scene.render.shadows.enabled = True
    return scene


def names(stage: OnScreen) -> list[str]:
    """What `steps` calls the passes of a frame, each once."""
    return list(dict.fromkeys(stage.renderer.steps(VIEW, stage.screen)))


def modes() -> Iterator[tuple[dict[str, Any], dict[str, Any], str]]:
    """Environments and settings, with the passes that share a program."""
    yield OUTDOORS, {}, "sun + light + fog + output"
    yield OUTDOORS | {"fog": {"density": 0.2, "colour": (0.3, 0.6, 0.9)}}, {}, "sun + light + fog + output"
    yield OUTDOORS | {"lights": [LAMP]}, {}, "sun + light + fog + output"
    yield {"lights": [LAMP]}, {"shadows.enabled": False}, "light + output"
    yield OUTDOORS, {"aa": "ssaa"}, "sun + light + fog"
    yield OUTDOORS, {"aa": "fxaa"}, "sun + light + fog"
    yield OUTDOORS, {"aa": "msaa"}, "sun + light + fog"
    yield OUTDOORS, {"light.mode": "forward"}, "fog + output"


@pytest.mark.slow
@pytest.mark.parametrize("transparent", [False, True])
@pytest.mark.parametrize(("environment", "settings", "expected"), list(modes()))
def test_pictures_are_those_of_the_passes_apart(
    gl_device: Device,
    library: ShapeLibrary,
    environment: dict[str, Any],
    settings: dict[str, Any],
    expected: str,
    transparent: bool,
) -> None:
    """To a step or two of 8 bits: light is not rounded in between."""
    pictures: list[NDArray[np.int_]] = []
    for fused in (True, False):
        scene = still_life(**environment)
        scene.render.fused = fused
        set_all(scene.render, settings)
        with OnScreen(gl_device, scene, library, SIZE) as stage:
            stage.draw(VIEW, transparent)
            pictures.append(read_pixels(stage.screen).astype(int))
            drawn = names(stage)
        assert (expected in drawn) == fused
        assert not any(" + " in name for name in drawn) or fused
    assert np.abs(pictures[0] - pictures[1]).max() <= 2
    assert len(np.unique(pictures[0].reshape(-1, 4), axis=0)) > 200  # there is something to see


@pytest.mark.parametrize("settings", [{}, {"light.mode": "forward"}, {"aa": "fxaa"}])
def test_a_gpu_which_may_not_test_what_it_reads_draws_the_same(
    gl_device: Device, library: ShapeLibrary, monkeypatch: pytest.MonkeyPatch, settings: dict[str, Any]
) -> None:
    pictures = []
    for software in (gl_device.software, False):
        monkeypatch.setattr(gl_device, "software", software)
        scene = still_life(**OUTDOORS, lights=[LAMP])
        set_all(scene.render, settings)
        with OnScreen(gl_device, scene, library, SIZE) as stage:
            stage.draw(VIEW)
            pictures.append(read_pixels(stage.screen))
    np.testing.assert_array_equal(pictures[0], pictures[1])


@pytest.mark.parametrize("transparent", [False, True])
@pytest.mark.parametrize("settings", [{}, {"aa": "fxaa"}, {"fused": False, "output.tone_mapping": "aces"}])
def test_an_even_sky_is_cleared_to_the_colour_that_would_be_drawn(
    gl_device: Device,
    library: ShapeLibrary,
    monkeypatch: pytest.MonkeyPatch,
    settings: dict[str, Any],
    transparent: bool,
) -> None:
    """By software; also when it changes."""
    asked: list[bool] = []
    sky_colour = PixelPrograms._sky_colour
    monkeypatch.setattr(PixelPrograms, "_sky_colour", lambda *given: asked.append(True) or sky_colour(*given))
    pictures = []
    for cleared in (True, False):
        if not cleared:
            monkeypatch.setattr(light, "_even_background", lambda frame: False)
            own = SunPass.inputs
            monkeypatch.setattr(SunPass, "inputs", lambda *given, own=own: replace(own(*given), even_sky=False))
        scene = still_life(background=(0.31, 0.12, 0.77))
        set_all(scene.render, settings)
        with OnScreen(gl_device, scene, library, SIZE) as stage:
            for exposure in (0.0, 0.7):
                scene.render.output.exposure = exposure
                stage.draw(VIEW, transparent)
                pictures.append(read_pixels(stage.screen))
        assert bool(asked) == (cleared and gl_device.software)
        asked.clear()
    np.testing.assert_array_equal(pictures[:2], pictures[2:])
    assert transparent or (pictures[0][0, 0] != pictures[1][0, 0]).any()


def test_a_sky_that_is_not_even_is_drawn(
    gl_device: Device, library: ShapeLibrary, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One with a gradient, fog before a background, and light that comes forward, which leaves pixels as they are."""
    monkeypatch.setattr(PixelPrograms, "_sky_colour", lambda *given: pytest.fail("cleared"))
    fog = {"density": 0.1, "colour": (0.9, 0.2, 0.1)}
    for environment, mode in (({"sky": {}}, "deferred"), ({"fog": fog}, "deferred"), ({}, "forward")):
        scene = still_life(**environment)
        set_all(scene.render, {"light.mode": mode, "shadows.enabled": False})
        with OnScreen(gl_device, scene, library, SIZE) as stage:
            stage.draw(VIEW)
            assert np.ptp(read_pixels(stage.screen)[..., :3]) > 50


@pytest.mark.parametrize("targets", [(), ("lit", "shadow"), ("surface",), ("depth",)])
def test_it_writes_one_target_that_it_can(targets: tuple[str, ...]) -> None:
    with pytest.raises(
        TypeError, match="pass wrong: a pixel pass must write exactly one of the targets shadow, lit, screen"
    ):
        type("Wrong", (Inverted,), {"name": "wrong", "writes": targets})


def test_a_program_is_compiled_once(gl_device: Device, library: ShapeLibrary) -> None:
    with OnScreen(gl_device, still_life(**OUTDOORS), library, SIZE) as stage:
        stage.draw(VIEW)
        before = gl_device.live["program"]
        stage.draw(VIEW)
        assert gl_device.live["program"] == before


def test_what_somebody_reads_is_written(gl_device: Device, library: ShapeLibrary) -> None:
    """By a pass that follows, and when the frame is over."""
    with OnScreen(gl_device, still_life(**OUTDOORS), library, SIZE) as stage:
        stage.renderer.keeps = frozenset({"lit"})
        assert names(stage)[-2:] == ["sun + light + fog", "output"]
        stage.renderer.keeps = frozenset({"shadow"})
        assert names(stage)[-2:] == ["sun", "light + fog + output"]
    passes = [*default_passes(), ReadsLight()]
    with OnScreen(gl_device, still_life(**OUTDOORS), library, SIZE, passes) as stage:
        assert names(stage)[-3:] == ["sun + light + fog", "output", "reads_light"]


def test_a_pass_from_outside_joins_its_neighbours(gl_device: Device, library: ShapeLibrary, tmp_path: Path) -> None:
    file = tmp_path / "inverted.glsl"
    file.write_text(INVERTED)
    pictures = []
    for fused in (True, False):
        own = Inverted()
        own.shader = file  # type: ignore[misc]  # of this object alone
        passes = default_passes()
        passes.insert(-1, own)
        scene = still_life(**OUTDOORS)
        scene.render.fused = fused
        with OnScreen(gl_device, scene, library, SIZE, passes) as stage:
            stage.draw(VIEW)
            pictures.append(read_pixels(stage.screen)[..., :3].astype(int))
            assert ("sun + light + fog + inverted + output" in names(stage)) == fused
    with OnScreen(gl_device, still_life(**OUTDOORS), library, SIZE) as stage:
        stage.draw(VIEW)
        plain = read_pixels(stage.screen)[..., :3].astype(int)
    assert np.abs(pictures[0] - pictures[1]).max() <= 2
    assert np.corrcoef(pictures[0].ravel(), plain.ravel())[0, 1] < -0.8


def test_a_picture_in_strips_has_no_seams(
    gl_device: Device, library: ShapeLibrary, monkeypatch: pytest.MonkeyPatch
) -> None:
    pictures = []
    for pixels in (1 << 18, 1000):
        inputs = PixelInputs(strip_pixels=pixels)
        monkeypatch.setattr(
            "depthwalk.render.passes.fog.PixelInputs", lambda inputs=inputs, **values: _with(inputs, values)
        )
        with OnScreen(gl_device, still_life(**OUTDOORS), library, SIZE) as stage:
            stage.draw(VIEW)
            steps = list(stage.renderer.steps(VIEW, stage.screen))
            pictures.append(read_pixels(stage.screen))
        assert steps.count("sun + light + fog + output") == -(-SIZE[0] * SIZE[1] // pixels)
    np.testing.assert_array_equal(pictures[0], pictures[1])


def _with(inputs: PixelInputs, values: dict[str, Any]) -> PixelInputs:
    return PixelInputs(strip_pixels=inputs.strip_pixels, **values)


def test_a_mistake_in_a_function_is_located(gl_device: Device, library: ShapeLibrary, tmp_path: Path) -> None:
    file = tmp_path / "inverted.glsl"
    file.write_text(INVERTED.replace("strength);", "strenth);"))
    own = Inverted()
    own.shader = file  # type: ignore[misc]  # of this object alone
    passes = default_passes()
    passes.insert(-1, own)
    stage = OnScreen(gl_device, still_life(**OUTDOORS), library, SIZE, passes)
    with stage, pytest.raises(GpuError, match=r"inverted\.glsl:4"):
        stage.draw(VIEW)


def test_only_textures_of_the_right_size_can_be_tested(gl_device: Device) -> None:
    scope = gl_device.scope("test")
    drawn = scope.framebuffer([scope.texture(SIZE, 4)])
    assert has_texture(drawn, SIZE) and not has_texture(drawn, (SIZE[0], 7))
    several = scope.framebuffer([scope.texture(SIZE, 4), scope.texture(SIZE, 4)])
    assert not has_texture(several, SIZE)
    buffer: moderngl.Renderbuffer = gl_device.context.renderbuffer(SIZE)
    unread = gl_device.context.framebuffer([buffer])
    assert not has_texture(unread, SIZE)
    unread.release()
    buffer.release()
    scope.release()
