"""The contract of a pass, by passes that keep to it or fail."""

from typing import cast

import pytest

from depthwalk.gpu.device import Device, Scope
from depthwalk.params import Params, param
from depthwalk.render.frame import Frame, Pass, common_settings
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.render_settings import RenderSettings


class TintParams(Params):
    strength: float = param(0.5, "How much", ge=0, le=1)


class Tint(Pass[TintParams]):
    name = "tint"

    def setup(self, gl: Scope) -> None:
        self.buffer = gl.buffer(reserve=16)

    def draw(self, frame: Frame, params: TintParams) -> None:
        pass


class Broken(Tint):
    def setup(self, gl: Scope) -> None:
        super().setup(gl)
        raise ValueError("no such shader")


def test_defaults_of_a_pass() -> None:
    tint, view = Tint(), View(Camera((0, 0, 0), (0, 0, -1), 1.0), (4, 3))
    assert Tint.Params is TintParams and tint.params == TintParams()
    assert list(tint.views(view, tint.params)) == [view]
    assert tint.enabled(cast(Frame, None), tint.params)
    assert not Tint.draws_objects and not Tint.per_sample and Tint.reads == Tint.writes == ()


def test_what_is_common_comes_from_the_groups_that_declare_it() -> None:
    settings = RenderSettings.model_validate(
        {"light": {"mode": "forward"}, "warp": {"wireframe": True}, "composite": {"show_tiles": True}, "aa": "ssaa"}
    )
    shared = common_settings(settings)
    assert shared.forward and shared.wireframe and shared.show_tiles
    assert shared.aa.mode == "ssaa" and shared.aa.samples == 2
    assert shared.lod is settings.lod
    assert not common_settings(RenderSettings()).forward


def test_what_a_failing_pass_made_is_freed(gl_device: Device) -> None:
    before = dict(+gl_device.live)
    broken = Broken()
    with pytest.raises(ValueError, match="no such shader"):
        broken.attach(gl_device)
    assert dict(+gl_device.live) == before
    assert not hasattr(broken, "gl")


def test_a_released_pass_may_be_attached_again(gl_device: Device) -> None:
    tint = Tint()
    for _ in range(2):
        tint.attach(gl_device)
        tint.release()
    tint.release()  # nothing is left to free
