"""How frames of the scene are drawn for a window: whole or in slices, and of how many pixels."""

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.walk.frame_scale import LEAST, STEP
from shown_windows import SIZE, Window

pytestmark = pytest.mark.usefixtures("small_surround")


def test_quick_frames_are_drawn_whole_and_slow_ones_in_slices(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Window(gl_device, "auto") as window:
        for slow in (1e9, 0.0):
            monkeypatch.setattr("depthwalk.walk.scene_frames._SLOW", slow)
            monkeypatch.setattr("depthwalk.walk.scene_frames._QUICK", slow)
            for step in range(40):
                window.round(0.01 * step)
            assert window.frames.in_slices == (slow == 0)


def test_the_first_frame_is_moved_while_the_second_is_drawn_if_it_took_long(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("depthwalk.walk.scene_frames._SLOW", 0.0)
    monkeypatch.setattr("depthwalk.walk.scene_frames._QUICK", 0.0)
    with Window(gl_device, "auto") as window:
        assert window.round()
        first = window.pixels()
        monkeypatch.setattr(window.frames, "_catch_up", lambda view: pytest.fail("waited"))
        monkeypatch.setattr(window.frames, "_draw_whole", lambda view, screen: pytest.fail("drew a whole frame"))
        assert not window.round() and window.frames.in_slices
        assert np.array_equal(window.pixels(), first)
        right, rounds = 0.0, 0
        while not window.finished > 1:  # the second frame, which has a margin
            before, right, rounds = window.pixels(), right + 0.01, rounds + 1
            window.round(right)
            assert np.abs(window.pixels() - before).mean() > 0
        assert rounds > 2
        window.draw(View(Camera((right, 1.2, 4.0), (right, 0.6, 0.0), 0.8), SIZE))
        assert np.abs(before - window.pixels()).mean() < 8


def test_the_second_frame_is_drawn_whole_if_the_first_was_quick(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("depthwalk.walk.scene_frames._SLOW", 1e9)
    with Window(gl_device, "auto") as window:
        assert window.round() and window.round(0.01) and not window.frames.in_slices


def test_frames_of_a_viewer_who_moves_have_fewer_pixels_and_those_at_rest_all(sliced: Window) -> None:
    settings = sliced.renderer.settings.reprojection
    settings.refine, settings.scale, settings.frame_limit = False, 0.75, 60_000.0  # however busy the machine is

    def height() -> int:
        source = sliced.frames._scene_frames.source  # of the last frame
        assert source is not None
        return source.size[1]

    sliced.rest()
    whole = height()
    assert whole >= SIZE[1]
    for step in range(1, 40):
        sliced.round(0.01 * step)
    assert height() == round(0.75 * whole)
    assert sliced.renderer.warp_limit is not None
    sliced.rest()
    assert height() == whole and sliced.renderer.warp_limit is None


def test_a_frame_is_reduced_if_the_viewer_moves_when_it_is_begun(sliced: Window) -> None:
    settings = sliced.renderer.settings.reprojection
    settings.refine, settings.scale, settings.frame_limit = False, 0.75, 60_000.0  # however busy the machine is
    sliced.rest()
    for right, scale in ((0.1, 0.75), (0.1, 1.0), (0.2, 0.75)):
        sliced.round(right)
        while not sliced.frames.is_drawing:
            sliced.round(right)
        source = sliced.frames._scene_frames.source
        assert source is not None and source.scale == pytest.approx(scale, abs=0.01)
        while sliced.frames.is_drawing and not sliced.frames._unshown:
            sliced.round(right)


def test_frames_that_take_too_long_get_smaller_and_larger_again(sliced: Window) -> None:
    settings = sliced.renderer.settings.reprojection
    settings.scale = 0.75
    sliced.rest()
    assert sliced.frames.scale == 1

    def walk() -> float:
        for step in range(1, 100):  # each change of a setting makes the surround outdated, too
            sliced.round(0.01 * step)
        return sliced.frames.scale

    settings.frame_limit = 1  # ms: none is so quick
    assert walk() == pytest.approx(0.75 * STEP**LEAST, abs=0.005)
    settings.frame_limit = 60_000
    assert walk() == pytest.approx(0.75, abs=0.005)
    sliced.rest()
    assert sliced.frames.scale == 1
