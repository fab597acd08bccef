import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyglm import glm

from depthwalk.scene.arrays import Camera
from depthwalk.types import Array
from depthwalk.walk.controls import (
    EYE_HEIGHT,
    FAST,
    LONGEST_STEP,
    MAX_PITCH,
    SPEED_RANGE,
    TAP,
    HeldKeys,
    Move,
    Walker,
    direction,
    heading,
    natural_speed,
    orientation,
)

AHEAD = Camera((1.0, 2.0, 3.0), (1.0, 2.0, 0.0), 1.0)


def walk(
    *moves: Move,
    steps: int = 300,
    seconds: float = 1.0,
    camera: Camera = AHEAD,
    walking: bool = False,
    settle: float = 3.0,
    fast: bool = False,
    ground: float = 0.0,
) -> Walker:
    """Where a second of holding the keys for these moves, in so many steps, and the run-out after it end."""
    walker = Walker.at(camera)
    walker.walking = walking
    dt = seconds / steps
    for _ in range(steps):
        walker.advance(dict.fromkeys(moves, dt), dt, fast=fast, ground=ground)
    for _ in range(math.ceil(settle)):
        walker.advance({}, 1.0, fast=fast, ground=ground)
    return walker


def shift(walker: Walker, camera: Camera = AHEAD) -> Array:
    return np.subtract(walker.position, camera.position)


@pytest.mark.parametrize(
    ("move", "direction"),
    [
        (Move.FORWARD, (0, 0, -1)),
        (Move.BACK, (0, 0, 1)),
        (Move.RIGHT, (1, 0, 0)),
        (Move.LEFT, (-1, 0, 0)),
        (Move.UP, (0, 1, 0)),
        (Move.DOWN, (0, -1, 0)),
    ],
)
def test_a_second_of_a_key_moves_by_the_speed_in_its_direction(move: Move, direction: tuple[int, int, int]) -> None:
    walker = walk(move)
    assert shift(walker) == pytest.approx(np.multiply(direction, walker.speed), abs=1e-6)


@pytest.mark.parametrize("walking", [False, True])
@pytest.mark.parametrize("moves", [(Move.FORWARD,), (Move.FORWARD, Move.LEFT), (Move.BACK, Move.RIGHT, Move.UP)])
@pytest.mark.parametrize("settle", [0.0, 3.0])
def test_three_frames_a_second_move_like_three_hundred(moves: tuple[Move], walking: bool, settle: float) -> None:
    down = Camera((1.0, 2.0, 3.0), (4.0, 1.0, 1.0), 1.0)
    fine, coarse = (
        walk(*moves, steps=steps, camera=down, walking=walking, settle=settle).position for steps in (300, 3)
    )
    moved = np.linalg.norm(fine - down.position)
    assert moved > 1
    assert np.linalg.norm(fine - coarse) < 0.01 * moved


@pytest.mark.parametrize(
    "moves",
    [(Move.FORWARD, Move.RIGHT), (Move.BACK, Move.LEFT, Move.UP), (Move.FORWARD, Move.UP), (Move.DOWN, Move.LEFT)],
)
def test_diagonals_are_not_faster(moves: tuple[Move, ...]) -> None:
    walker = walk(*moves, camera=Camera((0.0, 0.0, 0.0), (1.0, 1.0, -1.0), 1.0))
    assert np.linalg.norm(walker.position) == pytest.approx(walker.speed, rel=1e-6)


def test_opposite_keys_cancel() -> None:
    assert shift(walk(Move.FORWARD, Move.BACK, Move.UP, Move.DOWN)) == pytest.approx(np.zeros(3))


def test_shift_is_fast() -> None:
    walker = walk(Move.FORWARD, fast=True)
    assert np.linalg.norm(shift(walker)) == pytest.approx(FAST * walker.speed)


def test_an_absurd_step_is_cut() -> None:
    walker = walk(Move.FORWARD, steps=1, seconds=3600.0)
    assert np.linalg.norm(shift(walker)) == pytest.approx(walker.speed * LONGEST_STEP)


def test_nothing_moves_in_no_time() -> None:
    walker = walk(Move.FORWARD, steps=1, seconds=0.0)
    assert shift(walker) == pytest.approx(np.zeros(3))


def test_walking_keeps_the_eyes_above_the_ground_whatever_the_pitch() -> None:
    down = Camera((0.0, 30.0, 0.0), (0.0, 0.0, -5.0), 1.0)
    walker = walk(Move.FORWARD, Move.UP, camera=down, walking=True, ground=4.0)
    assert tuple(walker.position) == pytest.approx([0.0, 4.0 + EYE_HEIGHT, -walker.speed], abs=1e-4)


def test_flying_follows_the_look() -> None:
    down = Camera((0.0, 0.0, 0.0), (0.0, -1.0, -1.0), 1.0)
    walker = walk(Move.FORWARD, camera=down)
    assert tuple(walker.position) == pytest.approx(np.array([0, -1, -1]) / math.sqrt(2) * walker.speed)


@pytest.mark.parametrize(("down", "pitch"), [(1e5, -MAX_PITCH), (-1e5, MAX_PITCH)])
def test_pitch_stops_short_of_the_vertical(down: float, pitch: float) -> None:
    walker = Walker.at(AHEAD)
    walker.look(0.0, down)
    assert walker.pitch == pitch == pytest.approx(math.copysign(math.radians(89), pitch))
    look = np.subtract(walker.camera.target, walker.camera.position)
    assert np.hypot(look[0], look[2]) > 0.01


def test_the_mouse_to_the_right_turns_to_the_right() -> None:
    walker = Walker.at(AHEAD)
    walker.look(100.0, 0.0)
    assert walker.camera.target[0] > AHEAD.position[0]


def test_the_wheel_multiplies_the_speed_and_turns_back() -> None:
    walker = Walker.at(AHEAD)
    first = walker.speed
    walker.change_speed(2)
    assert walker.speed == pytest.approx(1.44 * first)
    walker.change_speed(-2)
    assert walker.speed == pytest.approx(first)
    walker.change_speed(1000)
    assert walker.speed == SPEED_RANGE[1]
    walker.change_speed(-1000)
    assert walker.speed == SPEED_RANGE[0]


@pytest.mark.parametrize(
    ("radius", "speed"), [(0.05, 0.02), (1.0, 0.4), (10.0, 3.0), (150.0, 3.0), (5000.0, 10_000 / 120), (1e9, 10_000.0)]
)
def test_a_scene_is_crossed_neither_in_no_time_nor_in_hours(radius: float, speed: float) -> None:
    assert natural_speed(radius) == pytest.approx(speed)


@given(st.floats(-3.14, 3.14), st.floats(-1.5, 1.5))
def test_a_heading_is_that_of_its_direction(yaw: float, pitch: float) -> None:
    assert heading(direction(yaw, pitch)) == pytest.approx((yaw, pitch), abs=1e-6)


@given(st.floats(-7, 7), st.floats(-1.5, 1.5))
def test_who_looks_there_has_level_shoulders_and_the_head_up(yaw: float, pitch: float) -> None:
    right, up, back = np.array([orientation(yaw, pitch) * glm.dvec3(*axis) for axis in np.eye(3)])
    np.testing.assert_allclose(right, (math.cos(yaw), 0, -math.sin(yaw)), atol=1e-12)
    ahead = -math.sin(yaw) * math.cos(pitch), math.sin(pitch), -math.cos(yaw) * math.cos(pitch)
    np.testing.assert_allclose(-back, ahead, atol=1e-12)
    np.testing.assert_allclose(up, np.cross(back, right), atol=1e-12)
    np.testing.assert_allclose(direction(yaw, pitch), ahead, atol=1e-12)


@given(st.floats(-3, 3), st.floats(-1.5, 1.5), st.lists(st.sampled_from(Move), max_size=6, unique=True))
def test_no_keys_are_faster_than_one(yaw: float, pitch: float, moves: Sequence[Move]) -> None:
    walker = Walker(glm.dvec3(), yaw, pitch, 1.0)
    walker.advance(dict.fromkeys(moves, 0.1), 0.1)
    assert glm.length(walker.velocity) <= walker.speed * (1 + 1e-12)


@pytest.mark.parametrize("target", [(4.0, 2.0, -3.0), (1.0, 8.0, 2.0), (-3.0, -1.0, 9.0)])
def test_a_camera_survives(target: tuple[float, float, float]) -> None:
    camera = Walker.at(Camera((1.0, 2.0, 3.0), target, 0.7)).camera
    looks = [np.subtract(each, (1.0, 2.0, 3.0)) for each in (camera.target, target)]
    assert camera.position == (1.0, 2.0, 3.0) and camera.fov == 0.7
    assert np.dot(*looks) == pytest.approx(np.linalg.norm(looks[0]) * np.linalg.norm(looks[1]))


def test_looking_straight_down_keeps_a_heading() -> None:
    walker = Walker.at(Camera((0.0, 5.0, 0.0), (0.0, 0.0, 0.0), 1.0))
    assert walker.pitch == -MAX_PITCH and walker.yaw == 0.0


def test_held_keys_count_the_frame_until_they_are_released() -> None:
    held = HeldKeys()
    held.press(Move.FORWARD)
    assert held.take(0.25) == {Move.FORWARD: 0.25}
    assert held.take(0.5) == {Move.FORWARD: 0.5}
    held.release(Move.FORWARD)
    assert held.take(0.25) == {}


@pytest.mark.parametrize(("dt", "seconds"), [(1 / 3, TAP), (1 / 300, 1 / 300)])
def test_a_key_pressed_and_released_within_a_frame_still_moves(dt: float, seconds: float) -> None:
    held = HeldKeys()
    held.press(Move.FORWARD)
    held.release(Move.FORWARD)
    share = held.take(dt)
    assert share == {Move.FORWARD: seconds}
    assert held.take(dt) == {}
    walker = Walker.at(AHEAD)
    walker.advance(share, dt)
    walker.advance({}, 1.0)
    assert np.linalg.norm(shift(walker)) == pytest.approx(seconds * walker.speed, rel=1e-4)


def test_a_viewer_comes_to_rest() -> None:
    """So that a picture need not be drawn again."""
    walker = Walker(glm.dvec3(1, 3, 2), 0.3, 0.1, 0.9, 2.0, walking=True)
    walker.advance({Move.FORWARD: 0.5}, 0.5)
    for _ in range(60):
        walker.advance({}, 0.03)
    before = walker.camera
    walker.advance({}, 0.03)
    assert walker.camera == before and walker.position.y == EYE_HEIGHT
