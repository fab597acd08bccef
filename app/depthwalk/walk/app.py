"""Walk through a scene in a window: everything that lives as long as the window, and the frame loop."""

import gc
import logging
import time
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Any

from pyglm import glm

from depthwalk.assets.library import SceneLibrary
from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.gpu.failures import GPU_FAILURES
from depthwalk.ingest.formats import is_model_file
from depthwalk.render.up_axis import ModelTurn
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.path import is_path_file, load_path
from depthwalk.scene.scene import Scene
from depthwalk.walk.atlas_view import AtlasView
from depthwalk.walk.background_work import BackgroundWork
from depthwalk.walk.clock import WalkClock, WidgetRounds
from depthwalk.walk.controls import Walker
from depthwalk.walk.file_watch import OwnChange, SceneWatch
from depthwalk.walk.files import opened_of
from depthwalk.walk.framing import home_in
from depthwalk.walk.gamepad import Gamepad
from depthwalk.walk.input import Input
from depthwalk.walk.inspected import NOTHING_HERE
from depthwalk.walk.keeping import keep
from depthwalk.walk.key_actions import key_actions
from depthwalk.walk.loading import LoadingScreen, StoppedError
from depthwalk.walk.overlay import Overlay
from depthwalk.walk.playback import Playback
from depthwalk.walk.recovery import GpuRecovery
from depthwalk.walk.scene_loader import SceneLoader
from depthwalk.walk.screenshot import Screenshots, read_window
from depthwalk.walk.shares import LateShares
from depthwalk.walk.shown_frames import ShownFrames
from depthwalk.walk.state import State
from depthwalk.walk.walk_options import WalkOptions
from depthwalk.walk.widgets import draw_widgets
from depthwalk.walk.window import (
    Window,
    desktop_density,
    gl_address,
    on_files_dropped,
    on_refresh,
    opened_again,
    read_gamepad,
    take_events,
    title_of,
)

log = logging.getLogger(__name__)

_UPLOAD_SECONDS = 0.008  # per frame, for uploading assets that come into sight
_STILL_SECONDS = 0.25  # from frame to frame while nothing happens and assets are baked on the same cores
_IDLE_SECONDS = 0.05  # between checks of a minimised window
_RESTING_SECONDS = 0.5  # most time between checks for changes while nothing is drawn


def walk_in(window: Window, scene: Scene, library: SceneLibrary, options: WalkOptions) -> None:
    """Show a scene in a window until the user closes it, and destroy the window.

    Raises
    ------
    InputError
        If an asset cannot be used.
    GpuError
        If the GPU fails repeatedly.
    """
    report = library.report
    walk = Walk(window, library, options)
    try:
        walk.start(scene)
        walk.loop()
    except StoppedError:
        pass
    finally:
        walk.release()
        library.report = report


class Walk:
    """Own everything that lives as long as the window, and draw its frames.

    Attributes
    ----------
    window : the window; it is replaced if the GL context is lost.
    device : the GPU that draws.
    renderer : draws the frames of the scene.
    model_turn : turns a model that is shown without a scene upright.
    frames : decides which picture the window shows.
    state : everything that keys and panel change.
    input : receives the window's events.
    gamepad : moves the viewer, too.
    loading : shows the progress of loading.
    recovery : restarts after failures of the GPU.
    background : the library of the scene, and its work in the background.
    next_files : a scene, models or a camera path to open before the next frame; () for none.
    """

    def __init__(self, window: Window, library: SceneLibrary, options: WalkOptions) -> None:
        self.window, self.background, self._options = window, BackgroundWork(library), options
        self._watch = SceneWatch(options.watched)
        self._on_stage = library.report
        self.recovery = GpuRecovery(self._restart)
        self._on_gpu = ExitStack()
        self._screenshot_due, self._screenshots = False, Screenshots()
        self.next_files: tuple[Path, ...] = ()  # to be opened before the next frame
        self._left_out = ""  # what to tell of dropped files that are not opened, once the first is
        self._clock = WalkClock()
        self._camera_before: Camera | None = None  # of the last frame
        self._widget_rounds = WidgetRounds()

    def start(self, scene: Scene) -> None:
        """Read, bake and upload everything that the first frame of `scene` needs."""
        self._begin()
        path, first_camera = self._options.path, self._options.first_camera
        self.renderer = self._loader.open(scene, self.background.library, self._options.representation)
        self._on_gpu.callback(lambda: self.renderer.release())
        self.model_turn = ModelTurn(scene, self.renderer)
        framed = home_in(scene, self.renderer, self.aspect)
        turns = is_model_file(scene.path)
        home = first_camera(
            framed, lambda fov, along: self.renderer.frame_all(self.aspect, fov, -glm.dvec3(*along), turns)
        )
        playback = Playback(path) if path is not None else None
        self.state = State(scene, self.renderer, Walker.at(home), home, playback)
        self.state.home_is_framed = scene.camera is None and home == framed
        self._show_renderer()
        self._watch.watch(scene)
        self.state.arrive()
        self.loading.end()
        tour = "P plays the tour, " if playback else ""
        moves = "W A S D move, right drag looks around" if self.state.orbit is None else "Drag turns, the wheel zooms"
        self.state.tell(self.model_turn.message or f"{moves}; {tour}H shows all keys")

    def _begin(self) -> None:
        """Create everything that the loading screen needs, in the window's context."""
        self.device = Device(self.window.ctx, gl_address)
        self._overlay = Overlay(self.device, partial(desktop_density, self.window))
        self._on_gpu.callback(self._overlay.release)
        self.loading = LoadingScreen(self.window, self._overlay, self._on_stage)
        self._loader = SceneLoader(self.device, self.window, self.loading, self._clock)
        self.window.key_event_func = self._close_by_escape  # until there is an `Input`
        on_files_dropped(self.window, self._drop)

    def _show_renderer(self) -> None:
        """Create everything that shows the renderer's pictures, and listen to the window's events."""
        self._atlas_view = AtlasView(self.device)
        self._on_gpu.callback(self._atlas_view.release)
        self.frames = self.state.shown_surfaces = ShownFrames(self.renderer, self.state.reachable)
        self._on_gpu.callback(lambda: self.frames.release())
        self.state.obstacles = self.background.obstacles(self.renderer)
        actions, before_change = key_actions(self), lambda: self.frames.finish()
        self.input = Input(self.window, self.state, actions, before_change)
        self.gamepad = Gamepad(lambda: read_gamepad(self.window), actions, before_change)
        on_refresh(self.window, self.input.note_event)

    def _open(self, files: tuple[Path, ...]) -> None:
        """Load a camera path, or show a scene or models; change nothing if a file cannot be used."""
        self.next_files, (file, *_) = (), files
        left_out, self._left_out = self._left_out, ""
        with self._loader.clock_stopped():
            try:
                if not is_model_file(file) and is_path_file(file):
                    self.state.playback = Playback(load_path(file))
                    self.state.tell(f"P plays {file.name}")
                else:
                    self._watch.begin_reading()
                    with self.loading.over(self.device, self.frames):
                        self._show(self._options.read(files))
                if left_out:
                    self.state.tell(left_out)
            except InputError as error:
                if files == self.state.scene.files:
                    log.warning("%s", error)  # bare: for who edits the file and looks at a terminal
                    self.state.complain(str(error))
                else:
                    self.state.tell(str(error))
            except StoppedError:
                if self.window.is_closing:
                    raise
                self.state.tell(f"Stopped loading {file.name}")

    def _show(self, scene: Scene) -> None:
        """Show another scene, or reload this one, which keeps camera and path. Raises InputError, StoppedError."""
        again, library = scene.files == self.state.scene.files, self.background.library.sibling(scene.assets)
        if again:  # also if it cannot be shown: a file that it lacks may come
            self._watch.watch(scene)
        renderer = self._loader.open(scene, library, self.renderer.world.representation if again else None)
        model_turn = ModelTurn(scene, renderer)
        self.frames.release()
        self.frames = self.state.shown_surfaces = ShownFrames(renderer, self.state.reachable)
        self.state.show(scene, renderer, self.aspect)
        if model_turn.message and not again:  # then it was told before
            self.state.tell(model_turn.message)
        self.renderer.release()
        self.background.replace(library)
        self.state.obstacles = self.background.obstacles(renderer)
        self.renderer, self.model_turn = renderer, model_turn
        self.window.title = title_of(scene)
        if not again:
            self._watch.watch(scene)
        # The scene before, and its renderer, refer to themselves, and may be frozen since the program started.
        gc.unfreeze()

    def loop(self) -> None:
        """Draw frames until the window closes or a callback raises; then save what is being recorded."""
        first_scene, change = self.state.scene, self._options.change
        self._clock.tick()
        try:
            while not self.window.is_closing:
                self._options.before_frame()
                try:
                    if change is not None and self.state.scene is first_scene and not self.frames.is_drawing:
                        for objects in change():
                            self.renderer.world.moved(objects)
                    self.step()
                except GPU_FAILURES as error:
                    self.recover(error)
        finally:
            if self.state.recorder is not None:
                self.state.end_recording()
                print(self.state.toast)

    def recover(self, error: Exception) -> None:
        """Recreate everything on the GPU after a failure; camera, settings and recording are kept.

        Raises `error`, or that of a further attempt, if failures come too often (see `GpuRecovery`).
        """
        self.state.tell(f"The GPU failed: {self.recovery.recover(error)}")

    def _restart(self) -> None:
        """Free everything on the GPU, also the window if its context is lost, and recreate it for the same walk."""
        state = self.state
        representation = self.renderer.world.representation
        with self._loader.clock_stopped():
            self._drop_gpu()
            self._begin()
            self.background.replace(self.background.library.sibling(state.scene.assets))
            self.renderer = state.renderer = self._loader.open(state.scene, self.background.library, representation)
            self._on_gpu.callback(lambda: self.renderer.release())
            self.model_turn.renderer, state.shares = self.renderer, LateShares()
            self._show_renderer()
            self._widget_rounds.begin()

    def _drop_gpu(self) -> None:
        """Free everything on the GPU, whatever its state; a window whose context is lost is replaced."""
        with suppress(Exception):  # owners may be half constructed, or run into the next failure
            self._on_gpu.pop_all().close()
        try:
            self.device.check()
            self.device.release()
        except GPU_FAILURES:
            self.window = opened_again(self.window)

    def step(self) -> None:
        """Advance the walk by the time since the last frame, not counting loading, and draw a frame."""
        self.device.check()  # in every iteration, even at rest: the window's content may be lost
        if not self.next_files and self._watch.take_news():
            self.next_files = self.state.scene.files
        if self.next_files:
            self.frames.finish()
            self._open(self.next_files)
        dt = self._clock.tick()
        if self.renderer.plan is not None and self.gamepad.advance(self.state, dt):  # not before the first picture
            self.input.note_event()
        self.state.advance(dt)
        self.state.record(dt)
        self.state.pull_focus(dt)
        self._report_background()
        if min(*self.window.size, *self.window.buffer_size) > 0:
            self.state.follow_window(self.aspect)
            unchanged = self._is_unchanged(dt)
            rests = unchanged and self.frames.is_current
            shows = not (unchanged and (rests or self.frames.is_shown))
            self.state.times.note(dt, shows=shows)
            if rests:
                self._clock.wait(self.gamepad.patience(_RESTING_SECONDS))
                return
            if not shows:
                self._go_on()
                return
            self._draw(dt)
        else:  # minimised
            self.state.times.note(dt, shows=False)
            time.sleep(_IDLE_SECONDS)
        self.window.swap_buffers()
        self._go_on()

    def _go_on(self) -> None:
        """Continue with the next frame, and with what is prepared in the background."""
        self.frames.work()
        take_events()
        self.background.begin_deferred()
        camera, self._camera_before = self._camera_before, self.state.camera
        if self.background.progress is not None and self._camera_before == camera and self.state.recorder is None:
            self._clock.wait(self._clock.now + _STILL_SECONDS - time.perf_counter())  # leaves the cores to baking

    def _is_unchanged(self, dt: float) -> bool:
        """Return whether nothing but a further frame could change what the window shows."""
        state = self.state
        self.frames.note(state.camera, dt, self.window.buffer_size, state.jumps)
        content = (
            self.window.size,
            state.toast,
            state.complaint,
            state.hud,
            state.panel,
            state.help,
            state.atlas,
            state.inspected.report is not None,
            self.background.progress,
        )
        widgets_rest = self._widget_rounds.are_over(content, self.input.had_events())
        return widgets_rest and not self._screenshot_due and state.recorder is None

    def _report_background(self) -> None:
        """Report what was done or failed in the background; set the walking speed once the whole scene is shown."""
        if news := self._screenshots.news():
            self.state.tell(news)
        unread, unbaked = self.renderer.assets.meshes.reader.failures, self.background.failures
        if unread:  # so that objects are missing
            self.state.complain("\n".join(dict.fromkeys([*self.state.complaint.splitlines(), *unread])))
        if unbaked:
            self.state.tell("\n".join(dict.fromkeys(unbaked)))
        for failures in (unread, unbaked):
            failures.clear()
        self.state.adjust_speed()

    @property
    def aspect(self) -> float:
        """Return width / height of the window."""
        width, height = self.window.size
        return width / max(height, 1)

    def release(self) -> None:
        """Free every GL object in reverse order of creation, then the window, and stop background work."""
        self._watch.end()
        self._screenshots.close()
        try:
            self._on_gpu.close()
        finally:
            self.background.close()
            self.window.destroy()

    def _close_by_escape(self, key: Any, action: Any, modifiers: Any) -> None:
        if key == self.window.keys.ESCAPE and action == self.window.keys.ACTION_PRESS:
            self.window.close()

    def want_screenshot(self) -> None:
        """Save the next picture to a file."""
        self._screenshot_due = True

    def inspect(self, across: float, down: float) -> None:
        """Inspect the object that the window shows at a place: parts of its width and height, 0 to 1."""
        point, inspected = self.frames.point_at(across, down), self.state.inspected
        if point is not None:
            self.frames.redraw()
        elif inspected.number is None:
            self.state.tell(NOTHING_HERE)
        inspected.seek(self.renderer, point)

    def note_own_change(self, change: OwnChange) -> None:
        """Take a change of a file for the walk's own, after which the scene need not be read again."""
        self._watch.accept(change)

    def _drop(self, files: list[Path]) -> None:
        """Open what was dropped on the window before the next frame, and tell then of what is left out."""
        self.next_files, self._left_out = opened_of(files)

    def _draw(self, dt: float) -> None:
        """Draw a frame with its widgets; `dt` is the time since the last one, seconds."""
        if not self.frames.is_drawing and not self._loader.load_missing(self.state.renderer, self.state.tell):
            self.state.do_without_samples()
        state, size = self.state, self.window.buffer_size
        renderer, screen = state.renderer, self.window.fbo
        screen.viewport = (0, 0, *size)
        camera = state.camera
        self.frames.refines = not state.atlas
        if self._screenshot_due and not self.frames.is_current:
            self.frames.finish()
            renderer.render(View(camera, size), screen)
        elif self.frames.draw(View(camera, size), screen):
            state.scene_times.add(self.frames.scene_seconds)
            state.scene_scale = self.frames.scale
            if state.hud:
                state.shares.update(renderer, dt)
            if state.inspected.update(renderer, self._atlas_view):
                state.tell(NOTHING_HERE)
        renderer.upload_seconds = _UPLOAD_SECONDS  # only the first frame waited for everything that it shows
        if state.atlas and renderer.targets is not None and renderer.plan is not None:
            self._atlas_view.draw(renderer.targets, renderer.plan)
        if self.input.is_editing:
            self.frames.finish()  # widgets may change the settings
        self._overlay.draw(screen, size, dt, self._widgets)
        if state.asked is not None:
            asked, state.asked = state.asked, None
            keep(self, asked)
        if self._screenshot_due:
            self._screenshot_due = False
            self._screenshots.save(read_window(self.window), state.scene.path, camera)

    def _widgets(self) -> None:
        """Draw the widgets, and tell the input which parts of the window they cover."""
        shown = self.state, self._overlay, self._atlas_view, self.background.progress
        self.input.set_areas(draw_widgets(*shown, in_screenshot=self._screenshot_due))
