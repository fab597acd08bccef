"""What the window shows while assets are read and baked."""

import threading

from depthwalk.assets.library import Report
from depthwalk.walk import hud
from depthwalk.walk.overlay import Overlay
from depthwalk.walk.window import Window

_LINES = 8  # of the progress


class Stopped(Exception):
    """The user stopped the loading, perhaps by closing the window."""


class LoadingScreen:
    """The progress of loading. told: the report that is told of it as well; busy: something loads for which the frames
    wait."""

    def __init__(self, window: Window, overlay: Overlay, told: Report) -> None:
        self._window, self._overlay, self._told = window, overlay, told
        self._title = ""
        self._stopped = False
        self.busy = False
        self._lines: list[str] = []

    def begin(self, title: str) -> None:
        """Clears the screen for the progress of loading `title`."""
        self._title = f"Loading {title}"
        self.busy = True
        self._draw()

    def stop(self) -> None:
        """Ends what is loading at its next stage."""
        self._stopped = True

    def end(self) -> None:
        """What comes later begins with no lines."""
        self._lines.clear()
        self.busy = self._stopped = False

    def report(self, name: str, stage: str) -> None:
        """The library's report. Raises Stopped when the user wants no more of it, or closes the window.

        What a thread reads beside the frames is told on and no more: window and GL are those of the main thread.
        """
        self._told(name, stage)
        if threading.current_thread() is not threading.main_thread():
            return
        self.busy = True
        self._lines = [*self._lines[1 - _LINES :], f"{name}: {stage} \u2026"]
        self._draw()
        if self._stopped or self._window.is_closing:
            raise Stopped

    def _draw(self) -> None:
        size = self._window.buffer_size
        if min(*self._window.size, *size) > 0:
            screen = self._window.fbo
            screen.viewport = (0, 0, *size)
            for _ in range(2):  # imgui measures a window in one frame and places it by that in the next
                screen.use()
                screen.clear(0.05, 0.055, 0.065, 1.0)
                self._overlay.draw(screen, self._window.size, size, 1 / 60, self._widgets)
        self._window.swap_buffers()

    def _widgets(self) -> None:
        hud.draw_progress(self._title, self._lines)
