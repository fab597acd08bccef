"""Whether a context lives, and pictures that go on after the GPU has failed."""

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import moderngl
import numpy as np
import pytest
from tools.gpu_faults import faulty_contexts

from depthwalk.commands.frame_drawing import draw_frames
from depthwalk.commands.output import Output
from depthwalk.gpu.device import Device
from depthwalk.gpu.egl import RobustContext
from depthwalk.gpu.failures import ContextLostError, GpuError, check_reset, never_reset, reset_status
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.scene.arrays import Camera
from shapes import ShapeLibrary, bake, box, scene_of

CAMERAS = [Camera((right, 1.2, 4.0), (right, 0.6, 0.0), 0.8) for right in (0.0, 0.3)]


def headless() -> HeadlessRenderer:
    crate = box(1.0, 1.0, 1.0, (0, 0.5, 0))
    scene = scene_of((0, (-0.6, 0, 0), 0.4, 1.0), (0, (0.9, 0, 0.8), 0.0, 1.0))
    return HeadlessRenderer(scene, ShapeLibrary([crate], [bake(crate)]), (48, 32))


def drawn(renderer: HeadlessRenderer, folder: Path, suffix: str = "png") -> list[bytes]:
    folder.mkdir(exist_ok=True)
    draw_frames(renderer, CAMERAS, Output(str(folder / f"{{frame}}.{suffix}")), 25)
    return [(folder / f"{frame}.{suffix}").read_bytes() for frame in range(len(CAMERAS))]


@pytest.mark.gl
@pytest.mark.slow
def test_a_series_goes_on_at_the_frame_where_the_gpu_failed(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with faulty_contexts() as fault:
        with headless() as renderer:
            fault.after(-1)
            before = drawn(renderer, tmp_path / "before")
            creations, live = fault.created, dict(renderer.device.live)
        for place in range(0, creations, max(1, creations // 2)):
            with headless() as renderer:
                fault.after(place)
                assert drawn(renderer, tmp_path / "after") == before
                assert renderer.device.live == live
    assert caplog.messages[0].startswith("frame 0: ") and caplog.messages[0].endswith(
        "; recreating everything on the GPU"
    )


@pytest.mark.gl
@pytest.mark.parametrize("suffix", ["png", "exr"])
def test_a_picture_of_a_lost_context_is_drawn_again(tmp_path: Path, suffix: str) -> None:
    with headless() as renderer:
        before, lost = drawn(renderer, tmp_path / "before", suffix), renderer.device
        lost._status = lambda: 0x8253
        assert drawn(renderer, tmp_path / "after", suffix) == before
        assert renderer.device is not lost


@pytest.mark.gl
def test_a_context_that_egl_calls_lost_gives_way_to_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def enter(context: RobustContext) -> RobustContext:
        if context is lost:
            raise ContextLostError("the GL context is lost: EGL says so")
        return whole(context)

    with headless() as renderer:
        before, device = drawn(renderer, tmp_path / "before"), renderer.device
        lost, whole = device.context.mglo._context, RobustContext.__enter__
        monkeypatch.setattr(RobustContext, "__enter__", enter)
        assert drawn(renderer, tmp_path / "after") == before
        assert renderer.device is not device


@pytest.mark.gl
def test_a_gpu_that_fails_again_and_again_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with headless() as renderer:
        monkeypatch.setattr(Device, "check", refuse)
        with pytest.raises(GpuError, match=r"^frame 0: no memory$"):
            drawn(renderer, tmp_path / "none")
    assert not list((tmp_path / "none").iterdir())


def refuse(device: Device) -> None:
    raise GpuError("no memory")


def test_who_reset_the_gpu_is_told() -> None:
    check_reset(lambda: 0)
    for code, who in ((0x8253, "by this program"), (0x8254, "by another program"), (0x99, "code 0x99")):
        with pytest.raises(ContextLostError, match=who):
            check_reset(lambda code=code: code)  # type: ignore[misc]


def test_drivers_that_cannot_tell_are_not_asked() -> None:
    context = cast(moderngl.Context, SimpleNamespace(extensions={"GL_ARB_robustness"}))
    assert reset_status(context, lambda name: None) is never_reset and never_reset() == 0
    context = cast(moderngl.Context, SimpleNamespace(extensions=set()))
    assert reset_status(context, lambda name: 1) is never_reset


@pytest.mark.gl
def test_a_device_frees_what_all_its_scopes_own(gl_device: Device) -> None:
    device = Device(gl_device.context)
    scopes = [device.scope(name) for name in "ab"]
    for scope in scopes:
        scope.buffer(np.zeros(4, np.uint8))
    device.release()
    assert not +device.live
    scopes[0].release()
