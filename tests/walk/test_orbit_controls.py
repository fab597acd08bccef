"""A camera that orbits a target, by mouse, by keys and by itself."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from depthwalk.scene.arrays import Camera
from depthwalk.walk.controls import Move
from depthwalk.walk.orbit_controls import OrbitControls
from depthwalk.walk.state import State
from depthwalk.walk.viewer import Mode
from walks import HOME, look, mode_of, show_at, state


def orbit_of(walk: State) -> OrbitControls:
    assert walk.orbit is not None
    return walk.orbit


def test_orbit_begins_with_the_same_view_about_what_is_in_the_middle() -> None:
    walk = state(path=False)
    show_at(walk, (0.0, 1.0, 2.0))
    walk.toggle_orbit()
    assert mode_of(walk) is Mode.ORBIT
    assert walk.camera.position == HOME.position and walk.camera.target == pytest.approx((0, 1, 2))
    walk.look(100, 30)
    assert math.dist(walk.camera.position, (0, 1, 2)) == pytest.approx(3) and walk.camera.position[0] < -1
    assert walk.camera.target == pytest.approx((0, 1, 2))
    before = walk.camera
    walk.toggle_orbit()
    assert mode_of(walk) is Mode.FLY
    assert walk.camera.position == before.position and look(walk.camera) == pytest.approx(look(before))


def test_orbit_before_the_sky_is_about_all_objects_or_as_far() -> None:
    walk = state(path=False)
    walk.toggle_orbit()
    assert walk.camera.target == pytest.approx((0, 1, 0))
    away = state(path=False)
    away.walker.place(Camera((0, 1, 5), (0, 1, 9), 1.0))
    away.toggle_orbit()
    assert away.camera.target == pytest.approx((0, 1, 7))


def test_the_turntable_turns_once_in_twelve_seconds_until_somebody_moves() -> None:
    walk = state(path=False)
    walk.toggle_turntable()
    assert mode_of(walk) is Mode.ORBIT
    places = []
    for _ in range(120):
        walk.advance(0.1)
        places.append(walk.camera.position)
    assert walk.camera.target == pytest.approx((0, 1, 0)) and {round(math.dist(p, (0, 1, 0)), 6) for p in places} == {5}
    assert places[59] == pytest.approx((0, 1, -5)) and places[119] == pytest.approx(HOME.position, abs=1e-9)
    for stop in (walk.toggle_turntable, lambda: walk.look(1, 0), lambda: walk.held.press(Move.LEFT), walk.go_home):
        walk.turntable = True
        stop()
        walk.advance(0.1)
        assert not walk.turntable
    walk.toggle_turntable()
    walk.toggle_orbit()
    assert mode_of(walk) is Mode.FLY
    walk.toggle_orbit()
    assert not walk.turntable


def test_who_walks_looks_around_on_the_spot() -> None:
    walk = state(path=False)
    walk.set_mode(Mode.WALK)
    walk.advance(1.0)  # to the height of the eyes
    before = walk.camera
    walk.toggle_turntable()
    for step in range(240):
        walk.advance(0.1)
        assert walk.camera.position == pytest.approx(before.position)
        if step == 119:
            assert look(walk.camera) == pytest.approx([-x for x in look(before)], abs=1e-9)
    assert mode_of(walk) is Mode.WALK and look(walk.camera) == pytest.approx(look(before), abs=1e-9)
    walk.held.press(Move.FORWARD)
    walk.advance(0.1)
    assert not walk.turntable


def test_a_scene_after_a_model_on_the_turntable_is_put_on_it_at_the_first_wish() -> None:
    walk = state(path=False)
    scene = cast(SimpleNamespace, walk.scene)
    scene.path = Path("bust.obj")
    walk.arrive()
    walk.toggle_turntable()
    scene.path = Path("scene.yaml")
    walk.arrive()
    assert walk.orbit is None and not walk.turntable
    walk.toggle_turntable()
    assert walk.turntable


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
    show_at(walk, (2.0, 1.0, 1.0))
    walk.turn_about(0.7, 0.5)
    walk.advance(0.02)
    assert 0.1 < walk.camera.target[0] < 1.9 and walk.camera.position == HOME.position
    for _ in range(60):
        walk.advance(0.02)
    assert walk.camera.target == (2, 1, 1) and walk.camera.position == HOME.position and mode_of(walk) is Mode.ORBIT
    show_at(walk, None)
    walk.turn_about(0.1, 0.1)
    walk.advance(0.02)
    assert walk.camera.target == (2, 1, 1) and "No surface" in walk.toast


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
