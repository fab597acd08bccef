"""Contexts without a window: that they notice their loss, what is current when, and what becomes of refusals."""

import ctypes
import logging
import sys
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any, cast

import moderngl
import pytest

from depthwalk.gpu import egl
from depthwalk.gpu.device import Device
from depthwalk.gpu.egl import RobustContext
from depthwalk.gpu.failures import ContextLostError, GpuError
from depthwalk.gpu.headless_device import headless_device

_RESET_NOTIFICATION_STRATEGY, _LOSE_CONTEXT_ON_RESET = 0x8256, 0x8252  # of GL, where EGL says 0x31BD, 0x31BF
linux = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is seldom EGL")


def current() -> int | None:
    """The handle of the thread's current context."""
    return egl._current(egl._library()).context


def cleared(device: Device, red: float) -> int:
    """Red of a texel that a framebuffer of `device` was cleared to, 0 to 255."""
    with device.context:
        scope = device.scope("test")
        try:
            target = scope.framebuffer([scope.texture((1, 1), 4)])
            target.clear(red)
            return target.read(components=1)[0]
        finally:
            scope.release()


@linux
@pytest.mark.gl
def test_a_context_without_a_window_is_lost_where_its_gpu_is_reset() -> None:
    device = headless_device()
    if not {"GL_ARB_robustness", "GL_KHR_robustness"} & set(device.context.extensions):
        device.context.release()
        pytest.skip("no robust contexts")
    assert device.notices_loss
    robust, strategy = device.context.mglo._context, ctypes.c_int()
    with device.context:
        address = robust.load_opengl_function("glGetIntegerv")
        ctypes.CFUNCTYPE(None, ctypes.c_uint, ctypes.c_void_p)(address)(
            _RESET_NOTIFICATION_STRATEGY, ctypes.byref(strategy)
        )
        device.check()
    device.context.release()
    assert strategy.value == _LOSE_CONTEXT_ON_RESET
    number = ctypes.c_int()  # that it is destroyed, EGL alone can tell
    assert not egl._library().eglQueryContext(robust._display, robust._context, 0x3028, ctypes.byref(number))


@linux
@pytest.mark.gl
def test_what_was_current_before_is_so_again() -> None:
    with ThreadPoolExecutor(1) as thread:  # in which nothing is current
        thread.submit(_nest).result()


def _nest() -> None:
    outer, inner = headless_device(), headless_device()
    assert current() is None
    with outer.context:
        of_outer = current()
        with inner.context:
            of_inner = current()
            with outer.context:
                assert current() == of_outer
            assert current() == of_inner != of_outer
            assert cleared(outer, 1.0) == 255 and current() == of_inner
        assert current() == of_outer
    outer.context.mglo.__enter__()
    with inner.context:
        outer.context.release()
    assert current() is None  # what was current before is gone
    inner.context.release()


@linux
@pytest.mark.gl
def test_a_context_may_be_used_in_one_thread_after_the_other() -> None:
    device = headless_device()
    with ThreadPoolExecutor(1) as thread:
        assert [cleared(device, 1.0), thread.submit(cleared, device, 0.2).result(), cleared(device, 0.4)] == [
            255,
            51,
            102,
        ]
        with device.context:
            refused = thread.submit(cleared, device, 1.0).exception()
    assert isinstance(refused, GpuError) and "makes no context current" in str(refused)
    device.context.release()


@pytest.mark.gl
def test_a_driver_without_robust_contexts_gives_ordinary_ones(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(egl, "_RESET_NOTIFICATION", 0x3333)  # an attribute that no driver knows
    with pytest.raises(GpuError, match=r"^EGL makes no robust context \(error 0x300[0-9a-f]\)$"):
        RobustContext()
    with caplog.at_level(logging.INFO):
        device = headless_device()
    assert caplog.messages[0].startswith("the driver will not tell of a lost context: EGL makes no robust context")
    assert not device.notices_loss and cleared(device, 1.0) == 255
    device.check()
    device.context.release()


@linux
@pytest.mark.gl
def test_the_first_device_that_works_is_used(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """As in a container that is lent the second of two GPUs, both of which the driver lists."""
    create, tried = moderngl.create_context, []

    def create_on_second(**settings: Any) -> moderngl.Context:
        tried.append(settings["device_index"])
        if tried[-1] == 0:
            raise Exception("eglInitialize failed (0x3001)")
        return create(**settings | {"device_index": 0})

    assert egl._device_count() >= 1
    monkeypatch.delenv(egl.DEVICE, raising=False)
    monkeypatch.setattr(egl, "_device_count", lambda: 2)
    monkeypatch.setattr(moderngl, "create_context", create_on_second)
    egl.ordinary_context().release()
    assert tried == [0, 1]
    assert caplog.messages == ["EGL device 1 is used, as those before fail: eglInitialize failed (0x3001)"]
    monkeypatch.setattr(egl, "_device_count", lambda: 1)
    with pytest.raises(Exception, match="eglInitialize failed"):
        egl.ordinary_context()
    monkeypatch.setattr(egl, "_device_count", lambda: 2)
    monkeypatch.setenv(egl.DEVICE, "0")  # whoever names a device gets no other
    with pytest.raises(Exception, match="eglInitialize failed"):
        egl.ordinary_context()
    assert tried == [0, 1, 0, 0]


@linux
@pytest.mark.gl
def test_a_context_that_cannot_be_entered_is_destroyed(monkeypatch: pytest.MonkeyPatch) -> None:
    released = []

    def refuse(context: RobustContext) -> RobustContext:
        raise GpuError("EGL makes no context current (error 0x3002)")

    release = RobustContext.release
    monkeypatch.setattr(RobustContext, "__enter__", refuse)
    monkeypatch.setattr(RobustContext, "release", lambda context: (released.append(context), release(context)))
    device = headless_device()
    assert not device.notices_loss and len(released) == 1
    device.context.release()


@pytest.mark.parametrize(("code", "error"), [(0x300E, ContextLostError), (0x3002, GpuError)])
def test_a_refusal_to_make_a_context_current_is_told(code: int, error: type[GpuError]) -> None:
    refusing = SimpleNamespace(eglBindAPI=lambda api: 1, eglMakeCurrent=lambda *handles: 0, eglGetError=lambda: code)
    with pytest.raises(error) as told:
        egl._make_current(cast(ctypes.CDLL, refusing), egl._Current(1, None, None, 2))
    assert type(told.value) is error


def test_a_machine_without_egl_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(egl, "_LIBRARY", "libnone.so.7")
    with pytest.raises(GpuError, match=r"^no EGL: libnone\.so\.7"):
        egl._library.__wrapped__()
