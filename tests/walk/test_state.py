import math
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from pyglm import glm

from depthwalk.render.renderer import Renderer
from depthwalk.render.view.bounds import Bounds
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.environment import Environment, GroundParams, WalkParams
from depthwalk.scene.path import CameraPath, load_path
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from depthwalk.walk.controls import EYE_HEIGHT, Move, Walker
from depthwalk.walk.playback import Playback
from depthwalk.walk.state import State
from depthwalk.walk.times import FrameTimes
from depthwalk.walk.viewer import Mode

HOME = Camera((0.0, 1.0, 5.0), (0.0, 1.0, 0.0), 1.0)


class FakeRenderer:
    """Shows one ball of radius 2 about (0, 1, 0); where a test says what is seen, at that point."""

    def __init__(self, seen: None = None) -> None:
        bounds = Bounds(np.array([[0.0, 1.0, 0.0]]), np.array([2.0]))
        self.world = SimpleNamespace(representation=None, bounds=lambda: bounds)
        self.seen = seen

    def distance_at(self, across: float = 0.5, down: float = 0.5) -> float:
        return float("inf") if self.seen is None else math.dist(self.seen, HOME.position)

    def point_at(self, across: float, down: float) -> glm.dvec3:
        return None if self.seen is None else glm.dvec3(*self.seen)

    def frame_all(self, aspect: float, fov: float = 1.0, away: tuple[int, int, int] = (0, 0, 1)) -> Camera:
        return Camera(tuple(np.add((0, 1, 0), 9 * np.array(away) / np.linalg.norm(away))), (0, 1, 0), fov)


def state(path: bool = True, **environment: GroundParams) -> State:
    views = np.array([(0, 0, 0, 0, 0, -1), (10, 0, 0, 10, 0, -1)], float)
    track = CameraPath(
        fps=30.0, interpolation="step", times=np.array([0.0, 2.0]), views=views, fovs=np.array([0.5, 0.8])
    )
    scene = SimpleNamespace(
        environment=Environment.model_validate({**environment}), walk=WalkParams(), path=Path("scene.yaml")
    )
    return State(
        cast(Scene, scene), cast(Renderer, FakeRenderer()), Walker.at(HOME), HOME, Playback(track) if path else None
    )


def test_a_path_leads_the_camera_until_a_key_takes_over() -> None:
    walk = state()
    walk.toggle_path()
    walk.advance(1.0)
    assert walk.camera.position == (0, 0, 0) and walk.camera.fov == 0.5
    walk.advance(5.0)
    assert walk.playback is not None
    assert walk.camera.position == (10, 0, 0) and walk.camera.fov == 0.8 and not walk.playback.playing
    walk.toggle_path()
    walk.advance(0.5)
    walk.held.press(Move.BACK)
    walk.advance(0.5)
    assert walk.playback is not None
    assert not walk.playback.playing and walk.camera.position[2] > 0.1


def test_the_mouse_takes_over_too_and_home_is_home() -> None:
    walk = state()
    walk.toggle_path()
    walk.advance(0.1)
    walk.look(10, 0)
    assert walk.playback is not None
    assert not walk.playback.playing
    walk.go_home()
    assert walk.camera.position == HOME.position and walk.camera.target == pytest.approx((0, 1, 4))


def test_seeking_looks_from_there() -> None:
    walk = state()
    walk.seek(2.0)
    assert walk.camera.position == (10, 0, 0)


def test_without_a_path_it_says_so() -> None:
    walk = state(path=False)
    walk.toggle_path()
    assert "--path" in walk.toast


def test_walking_stands_on_the_scenes_ground() -> None:
    walk = state(path=False, ground=GroundParams(height=3.0))
    walk.toggle_walking()
    walk.advance(1.0)
    walk.advance(1.0)
    assert walk.camera.position[1] == pytest.approx(3.0 + EYE_HEIGHT)


def test_a_representation_reaches_the_renderer() -> None:
    walk = state()
    walk.represent(Representation.MESH)
    assert walk.renderer.world.representation is Representation.MESH and "mesh" in walk.toast


def test_frame_times_are_smoothed_over_half_a_second() -> None:
    times = FrameTimes(length=8)
    assert times.smoothed == 0
    for seconds in (9.0, 0.1, 0.2, 0.1, 0.2, 0.1):
        times.add(seconds)
    assert times.smoothed == pytest.approx(0.15)
    assert times.milliseconds == pytest.approx([9000, 100, 200, 100, 200, 100])


def look(camera: Camera) -> Array:
    difference = np.subtract(camera.target, camera.position)
    return difference / np.linalg.norm(difference)


def test_orbit_begins_with_the_same_view_about_what_is_in_the_middle() -> None:
    walk = state(path=False)
    walk.renderer.seen = (0.0, 1.0, 2.0)
    walk.toggle_orbit()
    assert walk.mode is Mode.ORBIT
    assert walk.camera.position == HOME.position and walk.camera.target == pytest.approx((0, 1, 2))
    walk.look(100, 30)
    assert math.dist(walk.camera.position, (0, 1, 2)) == pytest.approx(3) and walk.camera.position[0] < -1
    assert walk.camera.target == pytest.approx((0, 1, 2))
    before = walk.camera
    walk.toggle_orbit()
    assert walk.mode is Mode.FLY
    assert walk.camera.position == before.position and look(walk.camera) == pytest.approx(look(before))


def test_orbit_before_the_sky_is_about_all_objects_or_as_far() -> None:
    walk = state(path=False)
    walk.toggle_orbit()
    assert walk.camera.target == pytest.approx((0, 1, 0))
    away = state(path=False)
    away.walker.place(Camera((0, 1, 5), (0, 1, 9), 1.0))
    away.toggle_orbit()
    assert away.camera.target == pytest.approx((0, 1, 7))


def test_keys_take_the_target_along() -> None:
    walk = state(path=False)
    walk.toggle_orbit()
    walk.held.press(Move.RIGHT)
    for _ in range(20):
        walk.advance(0.05)
        walk.look(0, 1)  # does not brake
    moved = walk.camera.target[0]
    assert walk.walker.speed * 0.8 < moved < walk.walker.speed
    assert math.dist(walk.camera.position, walk.camera.target) == pytest.approx(5)
    assert walk.walker.camera.position == walk.camera.position


def test_the_wheel_nears_in_orbit_and_speeds_up_else() -> None:
    walk = state(path=False)
    speed = walk.walker.speed
    walk.wheel(1)
    assert walk.walker.speed > speed and walk.camera.position == HOME.position
    walk.toggle_orbit()
    walk.wheel(1)
    assert math.dist(walk.camera.position, walk.camera.target) == pytest.approx(4.5)
    assert walk.walker.speed < 1.3 * speed


def test_turning_to_a_target_takes_a_moment() -> None:
    walk = state(path=False)
    walk.renderer.seen = (2.0, 1.0, 1.0)
    walk.turn_about(0.7, 0.5)
    walk.advance(0.02)
    assert 0.1 < walk.camera.target[0] < 1.9 and walk.camera.position == HOME.position
    for _ in range(60):
        walk.advance(0.02)
    assert walk.camera.target == (2, 1, 1) and walk.camera.position == HOME.position and walk.mode is Mode.ORBIT
    walk.renderer.seen = None
    walk.turn_about(0.1, 0.1)
    walk.advance(0.02)
    assert walk.camera.target == (2, 1, 1) and "No surface" in walk.toast


@pytest.mark.parametrize("orbit", [False, True])
def test_framing_all_keeps_the_direction(orbit: bool) -> None:
    walk = state()
    walk.toggle_path()
    walk.advance(0.1)
    if orbit:
        walk.toggle_orbit()
    walk.look(50, 20)
    before = look(walk.camera)
    walk.frame_all(1.5)
    assert walk.playback is not None
    assert look(walk.camera) == pytest.approx(before) and not walk.playback.playing
    assert np.add(walk.camera.position, 9 * before) == pytest.approx([0, 1, 0])


def test_a_path_that_plays_in_orbit_leaves_the_target_as_far() -> None:
    walk = state()
    walk.toggle_orbit()
    walk.toggle_path()
    walk.advance(0.5)
    walk.look(10, 0)
    assert math.dist(walk.camera.position, walk.camera.target) == pytest.approx(5)


def test_home_is_home_in_orbit_too() -> None:
    walk = state(path=False)
    walk.toggle_orbit()
    walk.look(300, 40)
    walk.pan(0.3, 0.2)
    walk.go_home()
    assert walk.camera == HOME


def test_a_mesh_alone_is_turned_about_and_a_scene_walked_through() -> None:
    walk = state()
    walk.arrive()
    assert walk.mode is Mode.FLY and walk.walker.speed == pytest.approx(4 / 5)  # 4 m across, in 5 s
    walk.scene.path, walk.scene.walk = Path("bust.OBJ"), WalkParams(speed=7.0)
    walk.arrive()
    assert walk.mode is Mode.ORBIT and walk.camera == HOME and walk.walker.speed == 7


def test_what_is_recorded_is_saved_and_played(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    walk = state(path=False)
    walk.toggle_recording()
    walk.held.press(Move.FORWARD)
    for _ in range(50):
        walk.advance(0.04)
        walk.record(0.04)
    end = walk.camera
    walk.toggle_recording()
    (file,) = tmp_path.iterdir()
    assert file.name in walk.toast and walk.recorder is None
    path = load_path(file)
    assert path.times[-1] == pytest.approx(49 * 0.04)
    assert path.sample(9.0).position == pytest.approx(end.position, abs=1e-6)
    walk.toggle_path()
    assert walk.playback is not None
    assert walk.playback.playing and walk.camera.position == pytest.approx((0, 1, 5 - 0.12), abs=0.1)


@pytest.mark.parametrize("name", ["scene.yaml", "other.yaml"])
def test_another_scene_ends_the_recording_and_tells_where_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """It begins at home; the same, read again, goes on where one is, with the path."""
    monkeypatch.chdir(tmp_path)
    walk = state()
    walk.toggle_recording()
    walk.held.press(Move.FORWARD)
    for _ in range(9):
        walk.advance(0.1)
        walk.record(0.1)
    before, home = walk.camera, Camera((7, 8, 9), (0, 0, 0), 1.0)
    scene = SimpleNamespace(environment=Environment(), walk=WalkParams(speed=2.0), path=Path(name), camera=home)
    walk.show(cast(Scene, scene), cast(Renderer, FakeRenderer()), 1.5)
    (file,) = tmp_path.iterdir()
    assert file.name in walk.toast and walk.recorder is None and walk.home == home
    again = name == "scene.yaml"
    assert walk.camera.position == (before.position if again else home.position)
    assert (walk.playback is not None) == again and (walk.walker.speed == 2) == (not again)


def test_a_recording_that_cannot_be_saved_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.walk.recorder.Path.cwd", lambda: tmp_path / "gone")
    monkeypatch.setattr("depthwalk.walk.recorder.user_documents_path", lambda: tmp_path / "gone too")
    walk = state(path=False)
    walk.toggle_recording()
    walk.record(0.1)
    walk.record(0.1)
    walk.toggle_recording()
    assert "gone too" in walk.toast and walk.playback is None
