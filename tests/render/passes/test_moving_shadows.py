"""Shadows of what moves by itself: as if drawn anew, though the shadows of all else are kept."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.assets.library import SceneLibrary
from depthwalk.gpu.device import Device
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from files import write_ply
from shapes import box, sphere
from stage import OnScreen

SIZE = (160, 120)
CAMERA = Camera((0.0, 3.0, 5.0), (0.0, 0.0, 0.0), 0.8)
SCENE = """
version: 1
assets: {ball: {mesh: ball.ply}, post: {mesh: post.ply}}
objects:
  - asset: ball
    animation: {interpolation: linear, keyframes: [{time: 0, position: [-1, 0.4, 0]}, {time: 2, position: [1, 0.4, 0]}]}
  - {asset: post, position: [1.2, 0, -0.8]}
  - {asset: post, position: [-0.4, 0, 1]}
"""
SUN = "environment: {ground: {}, sun: {direction: [-0.3, -1, -0.4]}}\nrender: {shadows: {enabled: true}}\n"
LAMP = (
    "environment: {ground: {}, sun: {intensity: 0}, lights: [{position: [0.5, 3, 1], direction: [-0.1, -1, -0.3], "
    "angle: 90, intensity: 20, shadow: true}]}\nrender: {shadows: {enabled: false}}\n"
)


@contextmanager
def stage(device: Device, folder: Path, light: str, remembers: bool) -> Iterator[OnScreen]:
    write_ply(folder / "ball.ply", sphere(0.3, 32, 16))
    write_ply(folder / "post.ply", box(0.2, 1.0, 0.2, (0, 0.5, 0)))
    (folder / "scene.yaml").write_text(SCENE + light)
    scene = load_scene(folder / "scene.yaml")
    with OnScreen(device, scene, SceneLibrary(scene.assets), SIZE) as made:
        made.renderer.remembers = remembers
        yield made


def picture(shown: OnScreen, moment: float) -> NDArray[np.int64]:
    shown.draw(View(replace(CAMERA, time=moment), SIZE))
    return shown.pixels()


@pytest.mark.parametrize("light", [SUN, LAMP], ids=["sun", "lamp"])
def test_a_moving_shadow_is_where_a_new_picture_has_it(gl_device: Device, tmp_path: Path, light: str) -> None:
    moments = [0.0, 0.3, 0.6, 0.6, 1.5, 0.1]
    with stage(gl_device, tmp_path, light, remembers=True) as window:
        window.draw(View(replace(CAMERA, time=moments[0]), SIZE))
        shown, drawn = [], []
        for moment in moments:
            shown.append(picture(window, moment))
            drawn.append(window.counts.get("shadow_maps", 0))
    with stage(gl_device, tmp_path, light, remembers=False) as anew:
        true = [picture(anew, moment) for moment in moments]
    assert (np.abs(true[1] - true[4]).max(-1) > 20).mean() > 0.01  # the ball and its shadow move
    assert max((np.abs(one - other).max(-1) > 8).mean() for one, other in zip(shown, true, strict=True)) < 0.001
    assert sum(drawn) < 3  # the maps of what stays are kept, unless all shadows reach farther


def test_what_no_frame_has_time_for_is_late_and_comes(gl_device: Device, tmp_path: Path) -> None:
    """A frame draws one of the maps at least, and goes on with those that wait."""
    with stage(gl_device, tmp_path, SUN, remembers=True) as window:
        for moment in (0.0, 0.1):
            picture(window, moment)
        window.renderer.upload_seconds = 0.01
        window.renderer.warp_limit = 2
        for _ in range(6):
            late = picture(window, 1.0)
    with stage(gl_device, tmp_path, SUN, remembers=False) as anew:
        true = picture(anew, 1.0)
    assert (np.abs(late - true).max(-1) > 8).mean() < 0.001
