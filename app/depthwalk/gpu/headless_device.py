"""Create a device without a window, in the best way that the platform offers."""

import logging
from functools import partial
from typing import Any

import moderngl

from depthwalk.gpu.device import Device
from depthwalk.gpu.egl import RobustContext
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.shader_cache import guard_shader_cache

log = logging.getLogger(__name__)


def headless_device() -> Device:
    """Create a device without a window: by EGL if possible, else in the platform's own way.

    Its context is robust if the driver offers that. It is current only within `with device.context`; the caller
    releases it.

    Returns
    -------
    Device
        The device.

    Raises
    ------
    GpuError
        Where no OpenGL 3.3 context can be created; the message has the reasons of all attempts.
    """
    guard_shader_cache()
    reasons: dict[str, None] = {}
    for make in (_robust_device, partial(_ordinary_device, backend="egl"), _ordinary_device):
        try:
            device = make()
        except Exception as error:  # glcontext raises bare Exception
            reasons[str(error)] = None
            continue
        if reasons:
            log.info("the driver will not tell of a lost context: %s", "; ".join(reasons))
        return device
    raise GpuError(f"no OpenGL 3.3 context: {'; '.join(reasons)}")


def _robust_device() -> Device:
    """Return a device that notices when its context is lost. Raises GpuError, and what moderngl raises."""
    robust = RobustContext()
    try:
        with robust:
            context = moderngl.create_context(require=330, standalone=True, context=robust)  # type: ignore[arg-type]
            return Device(context, robust.load_opengl_function)
    except BaseException:
        robust.release()
        raise


def _ordinary_device(**settings: Any) -> Device:
    """Return a device whose context moderngl creates with these `settings`. Raises what moderngl raises."""
    context = moderngl.create_context(require=330, standalone=True, **settings)
    with context:
        return Device(context)
