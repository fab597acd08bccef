"""The walk: a window, its loop, and what the keys do."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.library import SceneLibrary
from depthwalk.render.antialiasing import hardware_samples
from depthwalk.render.renderer import Renderer
from depthwalk.render.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene
from depthwalk.walk import hud
from depthwalk.walk.atlas_view import AtlasView
from depthwalk.walk.controls import Walker
from depthwalk.walk.input import Input
from depthwalk.walk.overlay import Overlay
from depthwalk.walk.panel import draw_atlas, draw_panel
from depthwalk.walk.playback import Playback
from depthwalk.walk.screenshot import save_screenshot
from depthwalk.walk.state import State
from depthwalk.walk.window import Window, open_window

_LINES = 8  # of the progress of loading
_UPLOADING = 0.008  # s of a frame, for assets that come into sight
_IDLE = 0.05  # s between looks at a window that shows nothing


class _Closed(Exception):
    """The window was closed while something was loading."""


def run(
    scene: Scene,
    library: SceneLibrary,
    *,
    path: CameraPath | None = None,
    fullscreen: bool = False,
    size: tuple[int, int] = (1280, 720),
    representation: Representation | None = None,
    first_camera: Callable[[Camera], Camera] = lambda camera: camera,
) -> None:
    """Open a window on `scene` and return when the user closes it.

    library: the scene's assets, loaded here while their progress is shown; path: played by P; size: of the window,
    (width, height); representation: of all objects, None as the scene says; first_camera: makes the first camera of the
    scene's, or of the one that sees every object.
    Raises NoDisplay where no window can be opened, InputError for assets that cannot be used.
    """
    window = open_window(f"{scene.path.name} \u2013 depthwalk", size, fullscreen)
    report = library.report
    try:
        walk = _Walk(window, scene, library)
        try:
            walk.load(path, representation, first_camera)
            walk.loop()
        except _Closed:
            pass
        finally:
            walk.release()
    finally:
        library.report = report
        window.destroy()


class _Walk:
    """Owns what lives as long as the window."""

    def __init__(self, window: Window, scene: Scene, library: SceneLibrary) -> None:
        self._window, self._scene, self._library = window, scene, library
        self._device = Device(window.ctx)
        self._overlay = Overlay(self._device)
        self._releases: list[Callable[[], None]] = [self._overlay.release]
        self._progress: list[str] = []
        window.key_event_func = self._close_by_escape  # until there is an `Input`
        self._report = library.report
        library.report = self._show_progress
        self._screenshot_wanted = False
        self._then = time.perf_counter()

    def load(
        self,
        path: CameraPath | None,
        representation: Representation | None,
        first_camera: Callable[[Camera], Camera],
    ) -> None:
        """Reads, bakes and uploads what the first frame needs."""
        self._draw_progress()
        renderer = Renderer(self._device, self._scene, self._library)
        self._releases.append(renderer.release)
        renderer.placed.representation = representation
        renderer.remembers = True
        renderer.placed.table()
        self._atlas_view = AtlasView(self._device)
        self._releases.append(self._atlas_view.release)
        width, height = self._window.size
        home = first_camera(self._scene.camera or renderer.frame_all(width / max(height, 1)))
        playback = Playback(path) if path is not None else None
        self._state = State(self._scene, renderer, Walker.at(home), home, playback)
        self._input = Input(self._window, self._state, self._actions())
        self._state.tell("H shows the keys")

    def loop(self) -> None:
        self._then = time.perf_counter()
        while not self._window.is_closing:
            now = time.perf_counter()
            dt, self._then = now - self._then, now
            self._state.advance(dt)
            self._state.pull_focus(dt)
            if min(*self._window.size, *self._window.buffer_size) > 0:
                self._state.times.add(dt)
                self._draw(dt)
            else:  # minimised
                time.sleep(_IDLE)
            self._window.swap_buffers()

    def release(self) -> None:
        for release in reversed(self._releases):
            release()

    def _actions(self) -> dict[str, Callable[[], None]]:
        state = self._state

        def toggle(name: str) -> Callable[[], None]:
            return lambda: setattr(state, name, not getattr(state, name))

        return {
            "ESCAPE": self._escape,
            "C": lambda: self._input.capture(not self._input.captured),
            "F": state.focus,
            "F12": self._want_screenshot,
            "G": state.toggle_walking,
            "H": toggle("help"),
            "P": state.toggle_path,
            "R": state.go_home,
            "TAB": toggle("panel"),
            "Z": toggle("hud"),
            "NUMBER_1": lambda: state.represent(None),
            "NUMBER_2": lambda: state.represent(Representation.DPCI),
            "NUMBER_3": lambda: state.represent(Representation.MESH),
        }

    def _escape(self) -> None:
        if self._input.captured:
            self._input.capture(False)
        else:
            self._window.close()

    def _close_by_escape(self, key: Any, action: Any, modifiers: Any) -> None:
        if key == self._window.keys.ESCAPE and action == self._window.keys.ACTION_PRESS:
            self._window.close()

    def _want_screenshot(self) -> None:
        self._screenshot_wanted = True

    def _draw(self, dt: float) -> None:
        self._load_missing()
        state, size = self._state, self._window.buffer_size
        renderer, screen = state.renderer, self._window.fbo
        screen.viewport = (0, 0, *size)
        camera = state.camera
        renderer.render(View(camera, size), screen)
        renderer.upload_seconds = _UPLOADING  # the first frame waited for all that it shows
        if state.atlas and renderer.targets is not None and renderer.plan is not None:
            self._atlas_view.draw(renderer.targets, renderer.plan)
        self._overlay.draw(screen, self._window.size, size, dt, self._widgets)
        if self._screenshot_wanted:
            self._screenshot_wanted = False
            self._take_screenshot(camera)

    def _load_missing(self) -> None:
        """Loads what a newly chosen representation needs; goes back to the scene's own where that fails, and to no
        anti-aliasing where the machine has not what was chosen."""
        start = time.perf_counter()
        renderer = self._state.renderer
        try:
            renderer.placed.table()
        except InputError as error:
            self._state.tell(str(error))
            renderer.placed.representation = None
            renderer.placed.table()
        try:
            hardware_samples(renderer.settings, self._device)
        except InputError as error:
            self._state.tell(str(error))
            renderer.settings.aa = "none"
        self._progress.clear()
        self._then += time.perf_counter() - start  # no time passes for the viewer meanwhile

    def _widgets(self) -> None:
        state = self._state
        areas = []
        left = hud.draw_hud(state) if state.hud else 0.0
        if state.hud and state.renderer.settings.dof.mode != "none":
            hud.draw_crosshair()
        if state.atlas:
            picture = self._overlay.renderer.show(self._atlas_view.texture)
            areas.append(draw_atlas(picture, self._atlas_view.aspect, left))
        right = self._overlay.io.display_size.x
        if state.panel:
            areas.append(panel := draw_panel(state))
            right = panel[0]
        if state.help:
            hud.draw_help(left, right)
        if state.toast and not self._screenshot_wanted:
            hud.draw_toast(state.toast)
        self._input.set_areas(areas)

    def _take_screenshot(self, camera: Camera) -> None:
        try:
            file = save_screenshot(self._read_window(), self._scene.path, camera)
            self._state.tell(f"Saved {file}")
        except OSError as error:
            self._state.tell(f"Screenshot failed: {error}")

    def _read_window(self) -> NDArray[np.uint8]:
        """What the window shows, (H, W, 3), top row first. The screen's own size is that of its making."""
        width, height = self._window.buffer_size
        data = self._window.fbo.read(viewport=(0, 0, width, height), components=3, alignment=1)
        _ = self._device.context.error  # moderngl also asks for an attachment, which a window's buffer has not
        return np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]

    def _show_progress(self, name: str, stage: str) -> None:
        """The library's report. Raises _Closed when the user closes the window meanwhile."""
        self._report(name, stage)
        self._progress = [*self._progress[1 - _LINES :], f"{name}: {stage} \u2026"]
        self._draw_progress()
        if self._window.is_closing:
            raise _Closed

    def _draw_progress(self) -> None:
        size = self._window.buffer_size
        if min(*self._window.size, *size) > 0:
            screen = self._window.fbo
            screen.viewport = (0, 0, *size)
            for _ in range(2):  # imgui measures a window in one frame and places it by that in the next
                screen.use()
                screen.clear(0.05, 0.055, 0.065, 1.0)
                self._overlay.draw(screen, self._window.size, size, 1 / 60, self._progress_widgets)
        self._window.swap_buffers()

    def _progress_widgets(self) -> None:
        hud.draw_progress(f"Loading {self._scene.path.name}", self._progress)
