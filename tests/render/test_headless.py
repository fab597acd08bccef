"""Renderers without a window: several at a time, and what a failing one leaves behind."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

import depthwalk.render.headless
from depthwalk.assets.library import SceneLibrary
from depthwalk.gpu.device import Device, Scope
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.headless_device import headless_device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.view import View
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.loader import load_scene
from depthwalk.types import Picture

SIZE = (96, 64)
NEAR = View(Camera((0.0, 1.0, 4.0), (0.0, 1.0, 0.0), 0.8), SIZE)
ASIDE = View(Camera((0.0, 1.0, 4.0), (1.5, 1.0, 0.0), 0.8), SIZE)

pytestmark = pytest.mark.usefixtures("gl_device")


@pytest.fixture
def make(tiny_scene: Path) -> Callable[..., Any]:
    scene = load_scene(tiny_scene)
    return lambda representation=None: HeadlessRenderer(scene, SceneLibrary(scene.assets), SIZE, representation)


def shot(headless: HeadlessRenderer, view: View) -> Picture:
    headless.draw(view)
    return headless.pixels()


def test_a_second_release_does_nothing(make: Callable[..., Any]) -> None:
    with make() as headless:
        headless.release()
    headless.release()


def test_finish_waits_for_its_own_context(make: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    current: list[moderngl.Context] = []
    waited_for: list[bool] = []
    enter: Any = moderngl.Context.__enter__
    leave: Any = moderngl.Context.__exit__

    def entered(context: moderngl.Context) -> moderngl.Context:
        current.append(context)
        enter(context)
        return context

    def left(context: moderngl.Context, *error: Any) -> None:
        assert current.pop() is context
        leave(context, *error)

    with make() as first, make(Representation.MESH) as second:
        monkeypatch.setattr(moderngl.Context, "__enter__", entered)
        monkeypatch.setattr(moderngl.Context, "__exit__", left)
        monkeypatch.setattr(moderngl.Context, "finish", lambda context: waited_for.append(current[-1:] == [context]))
        for headless in (first, second):
            headless.draw(NEAR)
            headless.finish()
    assert waited_for[-1] and len(waited_for) >= 2 and not current


def test_two_renderers_do_not_disturb_each_other(make: Callable[..., Any]) -> None:
    with make(Representation.MESH) as alone:
        other = shot(alone, ASIDE)
    with make() as first:
        expected, distance = shot(first, NEAR), first.distances()
        assert np.abs(expected.astype(int) - other).max() > 50
        with make(Representation.MESH) as second:
            assert np.array_equal(first.pixels(), expected)
            assert np.array_equal(shot(second, ASIDE), other)
            assert np.array_equal(first.pixels(), expected)
            assert np.array_equal(first.distances(), distance)
            assert np.abs(shot(first, NEAR).astype(int) - expected).max() <= 1
            assert np.array_equal(second.pixels(), other)
        assert np.abs(first.pixels().astype(int) - expected).max() <= 1
        assert np.abs(shot(first, NEAR).astype(int) - expected).max() <= 1


def test_a_picture_does_not_depend_on_those_before_it(make: Callable[..., Any]) -> None:
    steps = [View(Camera((0.02 * k, 1.0, 4.0), (0.0, 1.0, 0.0), 0.8), SIZE) for k in range(4)]
    with make(Representation.DPCI) as walked, make(Representation.DPCI) as fresh:
        walked.renderer.settings.lod.magnification = 0.0  # no mesh is to stand in; one scene, one group of settings
        assert walked.renderer.settings.warp.reuse_error > 0
        pictures = [shot(walked, view) for view in steps]
        assert np.array_equal(pictures[-1], shot(fresh, steps[-1]))
        walked.renderer.remembers = True
        for view in steps:
            walked.draw(view)
        assert walked.renderer.plan.counts["warped"] < walked.renderer.plan.counts["dpci"]


def test_the_parts_of_long_frames_are_submitted_one_by_one(
    make: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    with make() as headless:
        expected, finished = shot(headless, NEAR), list[str]()
        monkeypatch.setattr(moderngl.Context, "finish", lambda context: finished.append("waited"))
        for is_long in (False, True):
            monkeypatch.setattr(PassTimers, "may_be_long", is_long)
            with headless.device.context:
                steps = list(headless.renderer.steps(NEAR, headless.screen))
            assert len(finished) == is_long * len(steps) and len(steps) > 2
            assert np.array_equal(headless.pixels(), expected)


@pytest.mark.parametrize(("owner", "step"), [(Scope, "framebuffer"), (Renderer, "__init__"), (RenderWorld, "table")])
def test_a_failing_step_leaves_nothing_behind(
    make: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, owner: type[Scope] | type[Renderer], step: str
) -> None:
    devices = []

    def watched() -> Device:
        devices.append(make_device())
        return devices[-1]

    def fail(*arguments: object, **options: object) -> None:
        raise GpuError("the driver refused")

    make_device = headless_device
    monkeypatch.setattr(depthwalk.render.headless, "headless_device", watched)
    monkeypatch.setattr(owner, step, fail)
    with pytest.raises(GpuError, match="the driver refused"):
        make()
    (device,) = devices
    assert device.live.total() == 0
    with pytest.raises(AttributeError):  # as moderngl's contexts are once they are released
        device.context.finish()
