"""Open the window, by GLFW through moderngl-window.

GLFW names keys by their place on the keyboard, tells a press from a repetition and releases keys when the window
loses the focus. moderngl-window's pyglet window fails in full screen with pyglet 2.1.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pyglm import glm

from depthwalk.walk.bundle import name_glfw

name_glfw()
sys.modules.setdefault("glm", glm)  # moderngl-window imports PyGLM by its old name, which warns
# isort: split
import glfw
import moderngl_window.context.glfw.window as glfw_window

Window = glfw_window.Window


class NoDisplayError(Exception):
    """Report that no window can be opened, as on a machine without display; the message says why in one line."""


def open_window(title: str, size: tuple[int, int], fullscreen: bool = False) -> Window:
    """Return a window whose OpenGL 3.3 core context is current.

    Parameters
    ----------
    title
        The title of the window.
    size
        (width, height) of the window, in coordinates of the desktop.
    fullscreen
        Whether to use the whole screen.

    Returns
    -------
    Window
        The window.

    Raises
    ------
    NoDisplayError
        Where no window can be opened.
    """
    reasons: list[str] = []
    glfw.set_error_callback(lambda code, reason: reasons.append(" ".join(reason.decode(errors="replace").split())))
    try:
        window = Window(title=title, size=size, gl_version=(3, 3), resizable=True, vsync=True)
    except Exception as error:  # moderngl-window raises ValueError, glcontext bare Exception
        raise NoDisplayError(f"cannot open a window: {(reasons or [error])[-1]}") from error
    else:
        if fullscreen:
            window.fullscreen = True
        else:
            window.size = size  # on a scaled desktop GLFW made it larger, unnoticed by moderngl-window
    finally:
        glfw.set_error_callback(None)
    window.exit_key = None  # Esc releases the mouse first
    return window


def title_of(file: Path) -> str:
    """Return what the title bar says while the scene of `file` is shown."""
    return f"{file.name} \u2013 depthwalk"


def on_files_dropped(window: Window, action: Callable[[list[Path]], None]) -> None:
    """Have `action` called with the paths of files that the user drops on `window`.

    moderngl-window itself offers this only for windows of pyglet.
    """

    def dropped(handle: Any, names: Any) -> None:
        action([Path(name) for name in names])

    glfw.set_drop_callback(window._window, dropped)  # type: ignore[arg-type] # the stubs know one file only


def wait_for_event(seconds: float) -> None:
    """Wait until the user does something, such as pressing a key, and handle it; at most for `seconds`."""
    if seconds > 0:
        glfw.wait_events_timeout(seconds)
