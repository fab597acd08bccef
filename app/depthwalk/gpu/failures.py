"""Tell where the GPU fails: the driver refuses an object or a shader, or the context is lost.

After a lost context (the driver was reset, the device removed, a laptop changed its GPU) every call does nothing and
what is read is garbage. OpenGL tells of it only where the context was made robust (GL_ARB_robustness), and only who
asks. Whoever draws asks once for each picture, and makes context and objects anew.
"""

import ctypes
from collections.abc import Callable

import moderngl


class GpuError(Exception):
    """Report that the driver refused an object or a program; the message says which and how large it was."""


class ContextLostError(GpuError):
    """Report that the GL context is lost with all that was made in it."""


GPU_FAILURES = (GpuError, moderngl.Error)
"""What drawing raises where the GPU fails, after which it may work again with objects made anew."""

_RESETS = {0x8253: "by this program", 0x8254: "by another program", 0x8255: "for an unknown reason"}
_EXTENSIONS = {"GL_KHR_robustness": "glGetGraphicsResetStatus", "GL_ARB_robustness": "glGetGraphicsResetStatusARB"}

ResetStatus = Callable[[], int]
"""Returns a code of GL: 0 while the context is well, else why the GPU was reset."""

AddressOf = Callable[[str], int | None]
"""Returns the address of the GL function of a name; 0 or None where there is none."""


def reset_status(context: moderngl.Context, address_of: AddressOf) -> ResetStatus:
    """Return the function of GL that tells whether the GPU was reset.

    Parameters
    ----------
    context
        The current context.
    address_of
        Returns the address of the GL function of a name.

    Returns
    -------
    ResetStatus
        The function. It returns 0 for ever where the driver cannot tell.
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
    """Ask whether the context still lives. Raises ContextLostError where the GPU was reset."""
    if code := status():
        raise ContextLostError(f"the GL context is lost: the GPU was reset {_RESETS.get(code, f'(code {code:#x})')}")
