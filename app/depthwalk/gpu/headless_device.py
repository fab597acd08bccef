"""Create a device without a window, in the best way that the platform offers."""

import logging
from collections.abc import Callable
from functools import partial

import moderngl

from depthwalk.gpu.device import Device
from depthwalk.gpu.egl import RobustContext, ordinary_context
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
    in_own_way = partial(moderngl.create_context, require=330, standalone=True)
    for make in (_robust_device, partial(_device_of, ordinary_context), partial(_device_of, in_own_way)):
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


def _device_of(create: Callable[[], moderngl.Context]) -> Device:
    """Return a device whose context `create` creates. Raises what that raises."""
    context = create()
    with context:
        return Device(context)
