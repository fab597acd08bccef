"""Create GL contexts by EGL, without a window, that report when they are lost.

moderngl's own backend for EGL creates contexts that do not report it (EGL 1.5, §3.7.1.4: "No reset notification" is the
default). Everything else is left to that backend, which is told which device to use: the first that works. Drivers list
GPUs before software rasterisers, but also GPUs that this process may not use, as in a container that is lent one of
several.
"""

import ctypes
import logging
import os
from functools import cache
from typing import Any, NamedTuple

import moderngl

from depthwalk.gpu.failures import ContextLostError, GpuError

log = logging.getLogger(__name__)

DEVICE = "GLCONTEXT_DEVICE_INDEX"  # environment variable that chooses the device, as moderngl's backend reads it

_LIBRARY = "libEGL.so.1"
_GL_LIBRARY = "libGL.so.1"
_OPENGL_API = 0x30A2
_CONFIG_ID, _NONE = 0x3028, 0x3038
_DRAW, _READ = 0x3059, 0x305A
_CONTEXT_LOST = 0x300E
_MAJOR, _MINOR, _PROFILE, _CORE = 0x3098, 0x30FB, 0x30FD, 1
_RESET_NOTIFICATION, _LOSE_CONTEXT_ON_RESET = 0x31BD, 0x31BF

_Handle, _Int = ctypes.c_void_p, ctypes.c_int
_PROTOTYPES: dict[str, tuple[type | None, list[type]]] = {
    "eglBindAPI": (_Int, [ctypes.c_uint]),
    "eglChooseConfig": (_Int, [_Handle, _Handle, _Handle, _Int, _Handle]),
    "eglCreateContext": (_Handle, [_Handle, _Handle, _Handle, _Handle]),
    "eglDestroyContext": (_Int, [_Handle, _Handle]),
    "eglGetCurrentContext": (_Handle, []),
    "eglGetCurrentDisplay": (_Handle, []),
    "eglGetCurrentSurface": (_Handle, [_Int]),
    "eglGetError": (_Int, []),
    "eglGetProcAddress": (_Handle, [ctypes.c_char_p]),
    "eglMakeCurrent": (_Int, [_Handle, _Handle, _Handle, _Handle]),
    "eglQueryContext": (_Int, [_Handle, _Handle, _Int, _Handle]),
}


class _Current(NamedTuple):
    """Hold EGL's handles of what is current in a thread; None for what is not."""

    display: int | None
    draw: int | None
    read: int | None
    context: int | None


class RobustContext:
    """Own an OpenGL 3.3 core context that is lost, and reports it, when its GPU is reset.

    `moderngl.create_context(context=…)` takes it, within its `with` block, and releases it. The block makes it current
    in the thread, and restores the previous context afterwards. Blocks may be nested, in one thread at a time.

    Raises
    ------
    GpuError
        Where there is no EGL, or the driver does not create such a context.
    """

    def __init__(self) -> None:
        self._egl = _library()
        self._display, config = _display_and_config()
        self._egl.eglBindAPI(_OPENGL_API)
        wanted = _MAJOR, 3, _MINOR, 3, _PROFILE, _CORE, _RESET_NOTIFICATION, _LOSE_CONTEXT_ON_RESET, _NONE
        self._context = self._egl.eglCreateContext(self._display, config, None, (_Int * len(wanted))(*wanted))
        if not self._context:
            raise GpuError(f"EGL makes no robust context (error {self._egl.eglGetError():#x})")
        self._before: list[_Current] = []

    def load_opengl_function(self, name: str) -> int:
        """Return the address of the GL function called `name`, 0 where there is none."""
        return self._egl.eglGetProcAddress(name.encode()) or 0

    def __enter__(self) -> "RobustContext":
        before = _current(self._egl)
        if before.context != self._context:
            _make_current(self._egl, _Current(self._display, None, None, self._context))
        self._before.append(before)
        return self

    def __exit__(self, *error: object) -> None:
        before = self._before.pop()
        if before.context == self._context:
            return
        try:
            _make_current(self._egl, before._replace(display=before.display or self._display))
        except GpuError:  # it was released meanwhile
            self._make_none_current()

    def release(self) -> None:
        """Destroy the context; moderngl calls this once. If it was current, the thread has no current context then."""
        if _current(self._egl).context == self._context:
            self._make_none_current()
        self._egl.eglDestroyContext(self._display, self._context)

    def _make_none_current(self) -> None:
        _make_current(self._egl, _Current(self._display, None, None, None))


@cache
def _library() -> ctypes.CDLL:
    """Return EGL's library, with the functions of `_PROTOTYPES` declared. Raises GpuError where there is none."""
    try:
        egl = ctypes.CDLL(_LIBRARY)
        for name, (result, arguments) in _PROTOTYPES.items():
            function = getattr(egl, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise GpuError(f"no EGL: {error}") from error
    return egl


@cache
def _display_and_config() -> tuple[int, int]:
    """Return the display and the configuration that moderngl's own backend chooses, taken from a context of it.

    They stay valid, as the display is never terminated. Raises what that backend raises, and GpuError.
    """
    egl = _library()
    egl.eglBindAPI(_OPENGL_API)
    before = _current(egl)
    ordinary = ordinary_context()
    try:
        now, number, config, count = _current(egl), _Int(), _Handle(), _Int()
        egl.eglQueryContext(now.display, now.context, _CONFIG_ID, ctypes.byref(number))
        wanted = (_Int * 3)(_CONFIG_ID, number.value, _NONE)
        egl.eglChooseConfig(now.display, wanted, ctypes.byref(config), 1, ctypes.byref(count))
        if now.display is None or config.value is None:
            raise GpuError(f"{_LIBRARY} knows nothing of moderngl's context")
        _make_current(egl, before._replace(display=before.display or now.display))
        return now.display, config.value
    finally:
        ordinary.release()


def ordinary_context() -> moderngl.Context:
    """Create a context that does not report its loss, on the first device that works, or the one that `DEVICE` names.

    It is current afterwards. Raises what moderngl's backend raises, for the first device, where none works.
    """
    named: dict[str, Any] = {"backend": "egl", "libgl": _GL_LIBRARY, "libegl": _LIBRARY}  # else ldconfig is run twice
    failed: list[Exception] = []
    for number in range(1 if DEVICE in os.environ else max(_device_count(), 1)):
        named["device_index"] = number
        try:
            context = moderngl.create_context(require=330, standalone=True, **named)
        except Exception as error:  # glcontext raises bare Exception
            failed.append(error)
            continue
        if failed:
            log.warning("EGL device %d is used, as those before fail: %s", number, failed[0])
        return context
    raise failed[0]


@cache
def _device_count() -> int:
    """Return how many devices EGL lists; 0 where it cannot tell."""
    try:
        address = _library().eglGetProcAddress(b"eglQueryDevicesEXT")
    except GpuError:
        return 0
    count = _Int()
    if address and ctypes.CFUNCTYPE(_Int, _Int, _Handle, _Handle)(address)(0, None, ctypes.byref(count)):
        return count.value
    return 0


def _current(egl: ctypes.CDLL) -> _Current:
    """Return what is current in this thread."""
    return _Current(
        egl.eglGetCurrentDisplay(),
        egl.eglGetCurrentSurface(_DRAW),
        egl.eglGetCurrentSurface(_READ),
        egl.eglGetCurrentContext(),
    )


def _make_current(egl: ctypes.CDLL, wanted: _Current) -> None:
    """Make a context current in this thread, or none. Raises GpuError where that is refused."""
    egl.eglBindAPI(_OPENGL_API)  # per thread; otherwise the calls below would refer to OpenGL ES
    if egl.eglMakeCurrent(wanted.display, wanted.draw, wanted.read, wanted.context):
        return
    code = egl.eglGetError()
    if code == _CONTEXT_LOST:
        raise ContextLostError("the GL context is lost: EGL says so")
    raise GpuError(f"EGL makes no context current (error {code:#x})")
