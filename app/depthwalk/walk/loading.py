"""Show in the window which assets are being read and baked, and let the user stop this."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl

from depthwalk.assets.mesh_library import Report
from depthwalk.gpu.device import Device
from depthwalk.walk import hud
from depthwalk.walk.overlay import Overlay
from depthwalk.walk.shown_frames import ShownFrames
from depthwalk.walk.window import Window

_LINES = 8  # most lines of progress
_REDRAW_SECONDS = 0.06


class StoppedError(Exception):
    """Report that the user stopped loading, perhaps by closing the window."""


class LoadingScreen:
    """Show the progress of loading in the window.

    Parameters
    ----------
    window
        The window to draw into.
    overlay
        Draws the text.
    on_stage
        Called for every stage of loading, before the window shows it, with the name of the asset and of the stage that
        begins; it may print them, as the command line does.

    Attributes
    ----------
    busy
        Whether frames must wait because something is being loaded.
    backdrop
        The picture behind the progress, of the window's size or another; None: a dark surface.
    """

    def __init__(self, window: Window, overlay: Overlay, on_stage: Report) -> None:
        self._window, self._overlay, self._on_stage = window, overlay, on_stage
        self._title = ""
        self._stopped = False
        self._shown = 0.0
        self.busy = False
        self.backdrop: moderngl.Texture | None = None
        self._lines: list[str] = []

    @contextmanager
    def over(self, device: Device, frames: ShownFrames) -> Iterator[None]:
        """Show the last picture of `frames`, which `device` draws, behind the progress during the `with` block."""
        gl = device.scope("last picture")
        try:
            if frames.view is not None:
                picture = gl.texture(frames.view.size, 3)
                frames.show_again(gl.framebuffer([picture]))
                self.backdrop = picture
            yield
        finally:
            self.backdrop = None
            gl.release()

    def begin(self, title: str) -> None:
        """Clear the window but for the backdrop, and show that the file called `title` is being loaded."""
        self._title = f"Loading {title}"
        self.busy = True
        self._draw()

    def stop(self) -> None:
        """Request the end of loading, which raises `StoppedError` at its next stage."""
        self._stopped = True

    def end(self) -> None:
        """Clear the progress once loading is over, and forget a request to stop."""
        self._lines.clear()
        self.busy = self._stopped = False

    def report(self, name: str, stage: str) -> None:
        """Show a stage of loading an asset; the library calls this.

        From other threads it only calls `on_stage`, since window and GL belong to the main thread.

        Parameters
        ----------
        name
            The name of the asset.
        stage
            The step that begins, such as "baking".

        Raises
        ------
        StoppedError
            If the user pressed Esc or closed the window.
        """
        self._on_stage(name, stage)
        if threading.current_thread() is not threading.main_thread():
            return
        self.busy = True
        self._lines = [*self._lines[1 - _LINES :], f"{name}: {stage} \u2026"]
        self._draw()
        if self._stopped or self._window.is_closing:
            raise StoppedError

    def wait(self, line: str) -> None:
        """Show what is being waited for; a waiting loop must call this repeatedly.

        The window is redrawn only a few times per second.

        Parameters
        ----------
        line
            A text that describes it.

        Raises
        ------
        StoppedError
            If the user pressed Esc or closed the window.
        """
        now = time.perf_counter()
        if now - self._shown > _REDRAW_SECONDS:
            self._shown, self.busy, self._lines = now, True, [line]
            self._draw()
        if self._stopped or self._window.is_closing:
            raise StoppedError

    def _draw(self) -> None:
        size = self._window.buffer_size
        if min(*self._window.size, *size) > 0:
            screen = self._window.fbo
            screen.viewport = (0, 0, *size)
            for _ in range(2):  # imgui measures a window in one frame and centres it in the next
                screen.use()
                screen.clear(0.05, 0.055, 0.065, 1.0)
                self._overlay.draw(screen, size, 1 / 60, self._widgets)
        self._window.swap_buffers()

    def _widgets(self) -> None:
        if self.backdrop is not None:
            hud.draw_backdrop(self._overlay.renderer.show(self.backdrop))
        hud.draw_progress(self._title, self._lines)
