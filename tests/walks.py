"""What moves a camera and records it, without a window and with a renderer that draws nothing."""

import math
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from pyglm import glm

from depthwalk.render.renderer import Renderer
from depthwalk.render.view.bounds import Bounds
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import Environment, WalkParams
from depthwalk.scene.path import CameraPath
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from depthwalk.walk.controls import Walker
from depthwalk.walk.loading import LoadingScreen
from depthwalk.walk.overlay import Overlay
from depthwalk.walk.playback import Playback
from depthwalk.walk.state import State
from depthwalk.walk.viewer import Mode
from depthwalk.walk.window import Window

HOME = Camera((0.0, 1.0, 5.0), (0.0, 1.0, 0.0), 1.0)


class FakeRenderer:
    """Shows one ball of radius 2 about (0, 1, 0); where a test says what is seen, at that point."""

    def __init__(self, seen: tuple[float, float, float] | None = None) -> None:
        bounds = Bounds(np.array([[0.0, 1.0, 0.0]]), np.array([2.0]))
        self.world = SimpleNamespace(representation=None, bounds=lambda: bounds)
        self.seen = seen

    def distance_at(self, across: float = 0.5, down: float = 0.5) -> float:
        return float("inf") if self.seen is None else math.dist(self.seen, HOME.position)

    def point_at(self, across: float, down: float) -> glm.dvec3 | None:
        return None if self.seen is None else glm.dvec3(*self.seen)

    def frame_all(
        self, aspect: float, fov: float = 1.0, away: tuple[float, float, float] = (0, 0, 1), turns: bool = False
    ) -> Camera:
        x, y, z = 9 * np.array(away) / np.linalg.norm(away)
        return Camera((x, 1 + y, z), (0, 1, 0), fov)


def look(camera: Camera) -> Array:
    """The unit vector (3,) along which `camera` looks."""
    return np.subtract(camera.target, camera.position) / math.dist(camera.target, camera.position)


def mode_of(walk: State) -> Mode:
    """The mode now: what an earlier `assert` saw of `walk.mode` is not held to last."""
    return walk.mode


def state(path: bool = True, **environment: Any) -> State:
    views = np.array([(0, 0, 0, 0, 0, -1), (10, 0, 0, 10, 0, -1)], float)
    track = CameraPath(
        fps=30.0, interpolation="step", times=np.array([0.0, 2.0]), views=views, fovs=np.array([0.5, 0.8])
    )
    scene = SimpleNamespace(
        environment=Environment(**environment),
        walk=WalkParams(),
        render=RenderSettings(),
        path=Path("scene.yaml"),
        files=(Path("scene.yaml"),),
        title="scene.yaml",
        camera=None,
        animations=None,
    )
    renderer = cast(Renderer, FakeRenderer())
    return State(cast(Scene, scene), renderer, Walker.at(HOME), HOME, Playback(track) if path else None)


def show_at(walk: State, point: tuple[float, float, float] | None) -> None:
    """Makes the fake renderer of `walk` see `point`, or nothing, wherever it is asked."""
    cast(FakeRenderer, walk.renderer).seen = point


class FakeWindow(SimpleNamespace):
    """Counts what it shows."""

    def __init__(self) -> None:
        screen = SimpleNamespace(use=lambda: None, clear=lambda *colour: None)
        super().__init__(size=(64, 48), buffer_size=(64, 48), fbo=screen, is_closing=False, shown=0)

    def swap_buffers(self) -> None:
        self.shown += 1


def loading(drawn: list[threading.Thread]) -> tuple[FakeWindow, list[tuple[str, str]], LoadingScreen]:
    """A window, what its loading screen tells, and that screen; `drawn` gets the thread of each frame it draws."""
    told: list[tuple[str, str]] = []
    window = FakeWindow()
    overlay = SimpleNamespace(draw=lambda *arguments: drawn.append(threading.current_thread()))
    screen = LoadingScreen(cast(Window, window), cast(Overlay, overlay), lambda *line: told.append(line))
    return window, told, screen
