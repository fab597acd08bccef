from types import SimpleNamespace

import numpy as np
import pytest

from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.environment import Environment, GroundParams
from depthwalk.scene.path import CameraPath
from depthwalk.walk.controls import EYE_HEIGHT, Move, Walker
from depthwalk.walk.playback import Playback
from depthwalk.walk.state import FrameTimes, State

HOME = Camera((0.0, 1.0, 5.0), (0.0, 1.0, 0.0), 1.0)


def state(path=True, **environment):
    views = np.array([(0, 0, 0, 0, 0, -1), (10, 0, 0, 10, 0, -1)], float)
    track = CameraPath(30.0, "step", np.array([0.0, 2.0]), views, np.array([0.5, 0.8]))
    scene = SimpleNamespace(environment=Environment(**environment))
    renderer = SimpleNamespace(placed=SimpleNamespace(representation=None))
    return State(scene, renderer, Walker.at(HOME), HOME, Playback(track) if path else None)


def test_a_path_leads_the_camera_until_a_key_takes_over():
    walk = state()
    walk.toggle_path()
    walk.advance(1.0)
    assert walk.camera.position == (0, 0, 0) and walk.camera.fov == 0.5
    walk.advance(5.0)
    assert walk.camera.position == (10, 0, 0) and walk.camera.fov == 0.8 and not walk.playback.playing
    walk.toggle_path()
    walk.advance(0.5)
    walk.held.press(Move.BACK)
    walk.advance(0.5)
    assert not walk.playback.playing and walk.camera.position[2] > 0.1


def test_the_mouse_takes_over_too_and_home_is_home():
    walk = state()
    walk.toggle_path()
    walk.advance(0.1)
    walk.look(10, 0)
    assert not walk.playback.playing
    walk.go_home()
    assert walk.camera.position == HOME.position and walk.camera.target == pytest.approx((0, 1, 4))


def test_seeking_looks_from_there():
    walk = state()
    walk.seek(2.0)
    assert walk.camera.position == (10, 0, 0)


def test_without_a_path_it_says_so():
    walk = state(path=False)
    walk.toggle_path()
    assert "--path" in walk.toast


def test_walking_stands_on_the_scenes_ground():
    walk = state(path=False, ground=GroundParams(height=3.0))
    walk.toggle_walking()
    walk.advance(1.0)
    walk.advance(1.0)
    assert walk.camera.position[1] == pytest.approx(3.0 + EYE_HEIGHT)


def test_a_representation_reaches_the_renderer():
    walk = state()
    walk.represent(Representation.MESH)
    assert walk.renderer.placed.representation is Representation.MESH and "mesh" in walk.toast


def test_frame_times_are_smoothed_over_half_a_second():
    times = FrameTimes(length=8)
    assert times.smoothed == 0
    for seconds in (9.0, 0.1, 0.2, 0.1, 0.2, 0.1):
        times.add(seconds)
    assert times.smoothed == pytest.approx(0.15)
    assert times.milliseconds == pytest.approx([9000, 100, 200, 100, 200, 100])
