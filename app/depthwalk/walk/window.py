"""Open the window with GLFW through moderngl-window.

GLFW names keys by their position on the keyboard, distinguishes presses from repetitions, and releases keys when the
window loses the focus. moderngl-window's pyglet window fails in full screen with pyglet 2.1.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from depthwalk.walk import bundle as _bundle  # noqa: F401 - first, since it sets the libraries for those below

# isort: split
import glfw
import moderngl_window.context.glfw.window as glfw_window

from depthwalk.gpu.shader_cache import guard_shader_cache
from depthwalk.scene.scene import Scene

Window = glfw_window.Window
RIGHT_CTRL: int = glfw.KEY_RIGHT_CONTROL  # which moderngl-window does not name

_LEAST_ROOM = 200  # coordinates of the desktop: no screen has less room for windows


class PadState(NamedTuple):
    """Hold what a gamepad's sticks and buttons do, in the order of GLFW's numbers; see `gamepad.Axis` and `Button`.

    Attributes
    ----------
    axes : 6 float
        −1 to 1.
    buttons : 15 bool
        Whether each is held down.
    """

    axes: tuple[float, ...]
    buttons: tuple[bool, ...]

    @classmethod
    def resting(cls) -> "PadState":
        """Return the state of a gamepad that nobody touches."""
        return cls((0.0, 0.0, 0.0, 0.0, -1.0, -1.0), (False,) * 15)


class NoDisplayError(Exception):
    """Report that no window can be opened, as on a machine without display; the message says why in one line."""


def open_window(title: str, size: tuple[int, int], fullscreen: bool = False, fitted: bool = False) -> Window:
    """Return a window whose OpenGL 3.3 core context is current.

    Parameters
    ----------
    title
        The title of the window.
    size
        (width, height) of the window, in coordinates of the desktop.
    fullscreen
        Whether to use the whole screen.
    fitted
        Whether the window becomes as much larger as the desktop enlarges what it shows, as far as the screen has room,
        or smaller where it has less.

    Returns
    -------
    Window
        The window.

    Raises
    ------
    NoDisplayError
        If no window can be opened.
    """
    guard_shader_cache()
    reasons: list[str] = []

    def note(code: int, reason: Any) -> None:  # by default, GLFW's errors become warnings
        reasons.append(" ".join(reason.decode(errors="replace").split()))

    glfw.set_error_callback(note)
    try:
        if glfw.init():  # a hint: ignored if the driver offers no such contexts
            glfw.window_hint(glfw.CONTEXT_ROBUSTNESS, glfw.LOSE_CONTEXT_ON_RESET)
        window = Window(title=title, size=size, gl_version=(3, 3), resizable=True, vsync=True)
    except Exception as error:  # moderngl-window raises ValueError, glcontext bare Exception
        raise NoDisplayError(f"cannot open a window: {reasons[-1] if reasons else error}") from error
    else:
        if fullscreen:
            window.fullscreen = True
        else:
            # On a scaled desktop GLFW made it larger without telling moderngl-window.
            window.size = _fitted(window, size) if fitted else size
    finally:
        glfw.set_error_callback(None)  # type: ignore[arg-type] # the stubs forget this
    window.exit_key = None  # Esc releases the mouse first
    return window


def _fitted(window: Window, size: tuple[int, int]) -> tuple[int, int]:
    """Return `size` times what the desktop leaves to programs of its enlargement, within the room on its screen."""
    pixels = glfw.get_framebuffer_size(window._window)[0] / max(glfw.get_window_size(window._window)[0], 1)
    factor = desktop_density(window) / max(pixels, 1.0)  # 1 where a coordinate of the desktop stands for several pixels
    screen = glfw.get_primary_monitor()
    if not screen:
        return size
    *_, width, height = glfw.get_monitor_workarea(screen)
    left, top, right, bottom = glfw.get_window_frame_size(window._window)
    return fitted_size(size, factor, (width - left - right, height - top - bottom))


def fitted_size(size: tuple[int, int], factor: float, room: tuple[int, int]) -> tuple[int, int]:
    """Return a window's (width, height) `size` times `factor`, at least 1, or as much less as fits into `room`.

    A `room` that no screen has was not told by the desktop, and is ignored.
    """
    factor = max(factor, 1.0)
    fits = min(room[0] / size[0], room[1] / size[1])
    if min(room) < _LEAST_ROOM:
        fits = 1.0
    return int(size[0] * min(factor, fits)), int(size[1] * min(factor, fits))


def gl_address(name: str) -> int | None:
    """Return the address of the GL function `name` in the window's context; None if it does not exist."""
    return glfw.get_proc_address(name)  # type: ignore[return-value] # the stubs say otherwise


def opened_again(window: Window) -> Window:
    """Close `window`, whose context is lost, and return a new one of the same size.

    Raises NoDisplayError if that cannot be opened.
    """
    title, size, position, fullscreen = window.title, window.size, window.position, window.fullscreen
    window.destroy()
    again = open_window(title, size, fullscreen)
    if not fullscreen:
        again.position = position
    return again


def title_of(scene: Scene) -> str:
    """Return the text of the title bar while `scene` is shown."""
    return f"{scene.title} \u2013 depthwalk"


def on_files_dropped(window: Window, action: Callable[[list[Path]], None]) -> None:
    """Call `action` with the paths of files that the user drops on `window`.

    moderngl-window itself offers this only for pyglet's windows.
    """

    def dropped(handle: Any, names: Any) -> None:
        action([Path(name) for name in names])

    glfw.set_drop_callback(window._window, dropped)  # type: ignore[arg-type] # the stubs allow only one file


def on_refresh(window: Window, action: Callable[[], None]) -> None:
    """Call `action` when the desktop has lost the content of `window`, which must be redrawn."""
    glfw.set_window_refresh_callback(window._window, lambda handle: action())


def copy_text(window: Window, text: str) -> None:
    """Put `text` into the clipboard of the desktop, on which `window` is."""
    glfw.set_clipboard_string(window._window, text)


def read_gamepad(window: Window) -> PadState | None:
    """Return the state of the first gamepad; None if there is none. While `window` has no focus, it rests."""
    for number in range(glfw.JOYSTICK_LAST + 1):
        if glfw.joystick_is_gamepad(number) and (state := glfw.get_gamepad_state(number)) is not None:
            is_focused = glfw.get_window_attrib(window._window, glfw.FOCUSED)
            return PadState(tuple(state.axes), tuple(map(bool, state.buttons))) if is_focused else PadState.resting()
    return None


def wait_for_event(seconds: float) -> None:
    """Wait for the user's next event, such as a key press, for at most `seconds`, and handle it."""
    if seconds > 0:
        glfw.wait_events_timeout(seconds)


def desktop_density(window: Window) -> float:
    """Return by how much the desktop enlarges what it shows: 1 at 96 pixels an inch, 2 on most dense screens."""
    return max(glfw.get_window_content_scale(window._window))


def take_events() -> None:
    """Handle the events that have arrived."""
    glfw.poll_events()
