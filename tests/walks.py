"""What moves a camera and records it, without a window and with a renderer that draws nothing."""

import math
import threading
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from pyglm import glm

from depthwalk.render.view.bounds import Bounds
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import Environment, WalkParams
from depthwalk.scene.path import CameraPath
from depthwalk.walk.controls import Walker
from depthwalk.walk.loading import LoadingScreen
from depthwalk.walk.playback import Playback
from depthwalk.walk.state import State

HOME = Camera((0.0, 1.0, 5.0), (0.0, 1.0, 0.0), 1.0)


class FakeRenderer:
    """Shows one ball of radius 2 about (0, 1, 0); where a test says what is seen, at that point."""

    def __init__(self, seen=None):
        bounds = Bounds(np.array([[0.0, 1.0, 0.0]]), np.array([2.0]))
        self.world = SimpleNamespace(representation=None, bounds=lambda: bounds)
        self.seen = seen

    def distance_at(self, across=0.5, down=0.5):
        return float("inf") if self.seen is None else math.dist(self.seen, HOME.position)

    def point_at(self, across, down):
        return None if self.seen is None else glm.dvec3(*self.seen)

    def frame_all(self, aspect, fov=1.0, away=(0, 0, 1)):
        return Camera(tuple(np.add((0, 1, 0), 9 * np.array(away) / np.linalg.norm(away))), (0, 1, 0), fov)


def state(path=True, **environment):
    views = np.array([(0, 0, 0, 0, 0, -1), (10, 0, 0, 10, 0, -1)], float)
    track = CameraPath(
        fps=30.0, interpolation="step", times=np.array([0.0, 2.0]), views=views, fovs=np.array([0.5, 0.8])
    )
    scene = SimpleNamespace(environment=Environment(**environment), walk=WalkParams(), path=Path("scene.yaml"))
    return State(scene, FakeRenderer(), Walker.at(HOME), HOME, Playback(track) if path else None)


class FakeWindow(SimpleNamespace):
    """Counts what it shows."""

    def __init__(self):
        screen = SimpleNamespace(use=lambda: None, clear=lambda *colour: None)
        super().__init__(size=(64, 48), buffer_size=(64, 48), fbo=screen, is_closing=False, shown=0)

    def swap_buffers(self):
        self.shown += 1


def loading(drawn):
    told = []
    window = FakeWindow()
    overlay = SimpleNamespace(draw=lambda *arguments: drawn.append(threading.current_thread()))
    return window, told, LoadingScreen(window, overlay, lambda *line: told.append(line))
