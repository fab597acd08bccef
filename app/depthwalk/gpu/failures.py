"""Report failures of the GPU: the driver refuses an object or a shader, or the context is lost.

When the context is lost (the driver was reset, the device removed, a laptop changed its GPU), calls do nothing and
results are garbage. OpenGL reports it only for robust contexts (GL_ARB_robustness), and only when asked. The renderers
ask once per picture, and create context and objects again.
"""

import ctypes
from collections.abc import Callable

import moderngl


class GpuError(Exception):
    """Report that the driver refused an object or a program; the message says which, and its size."""


class ContextLostError(GpuError):
    """Report that the GL context is lost, with everything in it."""


GPU_FAILURES = (GpuError, moderngl.Error)
"""What drawing raises when the GPU fails; it may work again with a new context and new objects."""

_RESETS = {0x8253: "by this program", 0x8254: "by another program", 0x8255: "for an unknown reason"}
_EXTENSIONS = {"GL_KHR_robustness": "glGetGraphicsResetStatus", "GL_ARB_robustness": "glGetGraphicsResetStatusARB"}

ResetStatus = Callable[[], int]
"""Returns a GL code: 0 while the context is alive, else the reason of the GPU's reset."""

AddressOf = Callable[[str], int | None]
"""Returns the address of the GL function of a name; 0 or None where there is none."""


def reset_status(context: moderngl.Context, address_of: AddressOf) -> ResetStatus:
    """Return the GL function that reports whether the GPU was reset.

    Parameters
    ----------
    context
        The current context.
    address_of
        Returns the address of the GL function of a name.

    Returns
    -------
    ResetStatus
        The function; one that always returns 0 if the driver cannot tell.
    """
    for extension, name in _EXTENSIONS.items():
        if extension in context.extensions and (address := address_of(name)):
            function: ResetStatus = ctypes.CFUNCTYPE(ctypes.c_uint)(address)
            return function
    return never_reset


def never_reset() -> int:
    """Return 0: the driver cannot tell whether the GPU was reset."""
    return 0


def check_reset(status: ResetStatus) -> None:
    """Raise ContextLostError if the GPU was reset, according to `status`."""
    if code := status():
        raise ContextLostError(f"the GL context is lost: the GPU was reset {_RESETS.get(code, f'(code {code:#x})')}")
