"""What a window shows of a scene that moves by itself."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.gpu.device import Device
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.walk.shown_frames import ShownFrames
from files import write_ply
from shapes import sphere
from stage import OnScreen

SIZE = (160, 120)
CAMERA = Camera((0.0, 1.2, 4.0), (0.0, 0.4, 0.0), 0.8)
SCENE = """
version: 1
assets: {ball: {mesh: ball.ply}}
objects:
  - {asset: ball, position: [0, 0, 9]}
  - asset: ball
    animation: {interpolation: linear, keyframes: [{time: 0, position: [-1, 0, 0]}, {time: 4, position: [3, 0, 0]}]}
environment: {ground: {}, sky: {}}
"""


class Window(OnScreen):
    """What a window does, round by round, of 25 ms each."""

    def __init__(self, device: Device, folder: Path, mode: str) -> None:
        write_ply(folder / "ball.ply", sphere(0.4, 48, 24))
        (folder / "scene.yaml").write_text(SCENE)
        scene = load_scene(folder / "scene.yaml", overrides={"render.reprojection.mode": mode})
        scene.render.reprojection.slice = 1.0
        super().__init__(device, scene, SceneLibrary(scene.assets), SIZE)
        self.renderer.remembers = True
        self.frames = ShownFrames(self.renderer)
        self.moment, self.finished = 0.0, 0

    def __exit__(self, *_: object) -> None:
        self.frames.release()
        super().__exit__()

    def round(self, seconds: float = 0.025) -> None:
        self.moment += seconds
        camera = replace(CAMERA, time=self.moment)
        self.frames.note(camera, 0.025, SIZE)
        self.finished += self.frames.draw(View(camera, SIZE), self.screen)
        self.frames.work()

    def rest(self) -> None:
        for _ in range(500):
            self.round(0)
            if self.frames.is_current:
                return
        raise AssertionError("never at rest")

    def ball(self) -> float:
        """Where the ball is that moves, in metres along x: the middle of the bright pixels at its height."""
        bright = np.flatnonzero((self.pixels()[60:70].min(-1) > 150).any(0))
        return float((bright.mean() + 0.5 - 80) / 120 * 2 * np.tan(0.4) * np.hypot(4, 0.8))


@pytest.fixture(params=["on", "off"])
def window(gl_device: Device, tmp_path: Path, request: Any, small_surround: None) -> Iterator[Window]:
    with Window(gl_device, tmp_path, request.param) as shown:
        yield shown


def test_pictures_show_the_moment_whether_a_frame_is_finished_or_not(window: Window) -> None:
    """In slices most are the last frame; a ball of 1 m/s is where it is by now, to two pixels."""
    for _ in range(40):  # the first frames take long
        window.round()
    places = []
    for _ in range(24):
        window.round()
        places.append(window.ball() - (window.moment % 4 - 1))
    assert np.median(np.abs(places)) < 0.06
    assert (window.finished < 24) == window.frames.in_slices


def test_it_never_rests_until_animations_stop(window: Window) -> None:
    for _ in range(40):
        window.round()
        assert not window.frames.is_current
    window.rest()
    drawn, before = window.finished, window.pixels()
    window.round(0)
    assert window.finished == drawn and (window.pixels() == before).all()
    window.round()
    assert not window.frames.is_current


def test_time_is_no_change_of_the_scene(window: Window) -> None:
    """What was seen around stays known, whatever moves."""
    window.round()
    world = window.renderer.world
    edits, changes = world.edits, world.changes
    for _ in range(12):
        window.round(0.2)
    assert world.edits == edits and world.changes > changes
    world.moved(slice(0, 1))
    assert world.edits == edits + 1
