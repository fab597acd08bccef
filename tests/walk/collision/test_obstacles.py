"""A viewer who walks is stopped, slides, climbs, and is never trapped."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyglm import glm

from barriers import Barriers, among, box, go, place, sheet, walker
from depthwalk.walk.collision.body import RADIUS, STEP
from depthwalk.walk.collision.obstacles import Obstacles
from depthwalk.walk.controls import Move

WALL = box([-5, 0, -3.2], [5, 3, -3])  # ahead of who stands at the origin
ROOM = box([-3, 0, -3], [3, 3, 3], inward=True)


@pytest.mark.parametrize("rate", [20.0, 60.0, 144.0])
def test_a_wall_stops_who_walks_at_it(rate: float) -> None:
    who = walker()
    go(among(WALL), who, 4.0, rate=rate)
    assert who.position.z == pytest.approx(-3 + RADIUS, abs=1e-3) and abs(who.position.x) < 1e-6
    assert glm.length(who.velocity) < 0.1


def test_a_thin_wall_stops_from_both_sides() -> None:
    wall = sheet([-5, 0, 0], [5, 0, 0], [5, 3, 0], [-5, 3, 0])
    for side, toward in ((2.0, 0.0), (-2.0, 180.0)):
        who = walker(z=side, toward=toward)
        go(among(wall), who, 4.0)
        assert abs(who.position.z) == pytest.approx(RADIUS, abs=1e-3) and who.position.z * side > 0


def test_one_slides_along_a_wall_with_the_tangential_part() -> None:
    who = walker(z=-2.5, toward=60.0, speed=1.5)
    obstacles = among(WALL)
    go(obstacles, who, 1.5)
    before = glm.dvec3(who.position)
    go(obstacles, who, 1.0)
    moved = who.position - before
    assert moved.x == pytest.approx(1.5 * math.sin(math.radians(60)), rel=0.01) and abs(moved.z) < 1e-6
    assert moved.y == 0


def test_a_corner_stops_and_lets_go() -> None:
    corner = among(WALL, box([2, 0, -5], [2.2, 3, 5]))
    who = walker(toward=40.0)
    go(corner, who, 5.0)
    assert (who.position.x, who.position.z) == pytest.approx((2 - RADIUS, -3 + RADIUS), abs=1e-3)
    who.yaw = math.radians(180 - 40.0)
    go(corner, who, 1.0)
    assert who.position.z > -2 and who.position.x < 1.8


@pytest.mark.parametrize(("width", "passes"), [(0.8, True), (0.6, True), (0.3, False)])
def test_a_doorway_is_passed_if_it_is_wide_enough(width: float, passes: bool) -> None:
    half = width / 2
    left, right = box([-5, 0, -2.1], [-half, 3, -2]), box([half, 0, -2.1], [5, 3, -2])
    who = walker(x=0.04)
    go(among(left, right), who, 4.0)
    assert (who.position.z < -3) == passes


def test_a_door_is_entered_along_the_wall_beside_it() -> None:
    left, right = box([-5, 0, -2.1], [-0.4, 3, -2]), box([0.4, 0, -2.1], [5, 3, -2])
    who = walker(x=-1.5, z=-1.9, toward=70.0)
    way = go(among(left, right), who, 4.0)
    assert way[-1].z < -2.2 or way[-1].x > 0.5


@pytest.mark.parametrize(("height", "climbed"), [(0.2, True), (STEP - 0.01, True), (0.6, False)])
def test_steps_are_climbed_and_walls_are_not(height: float, climbed: bool) -> None:
    who = walker()
    way = go(among(box([-2, 0, -6], [2, height, -2])), who, 2.5)
    if climbed:
        assert who.position.z < -3 and who.position.y == pytest.approx(1.7 + height, abs=1e-3)
    else:
        assert who.position.z == pytest.approx(-2 + RADIUS, abs=1e-3) and who.position.y == 1.7
    rises = np.diff([place.y for place in way])
    assert (rises >= 0).all() and rises.max(initial=0) < 3.0 / 60  # smoothly: at 3 m/s at most


def test_one_steps_down_again() -> None:
    who = walker()
    way = go(among(box([-2, 0, -4], [2, 0.3, -2])), who, 5.0)
    assert max(place.y for place in way) == pytest.approx(2.0, abs=1e-3) and who.position.y == pytest.approx(1.7)


def test_a_stair_leads_up() -> None:
    stair = [box([-1, 0, -2 - 0.28 * (k + 1)], [1, 0.18 * (k + 1), -2 - 0.28 * k]) for k in range(10)]
    stair.append(box([-1, 0, -9], [1, 1.8, -4.8]))
    who = walker()
    way = go(among(*stair), who, 4.5)
    assert who.position.y == pytest.approx(1.7 + 1.8, abs=1e-3) and who.position.z < -5
    assert np.diff([place.y for place in way]).min() >= 0
    go(among(*stair), who, 0.1)


def test_a_slope_is_followed_but_not_a_cliff() -> None:
    ramp = sheet([-2, 0, -1], [2, 0, -1], [2, 3, -6], [-2, 3, -6])
    who = walker()
    go(among(ramp), who, 3.0)
    assert who.position.z < -4 and who.position.y == pytest.approx(1.7 - 0.6 * (who.position.z + 1), abs=0.2)
    cliff = sheet([-2, 0, -1], [2, 0, -1], [2, 6, -2], [-2, 6, -2])
    who = walker()
    go(among(cliff), who, 3.0)
    assert who.position.z > -1.5


def test_one_walks_under_a_table_only_if_it_is_high() -> None:
    for height, passes in ((0.7, False), (2.1, True)):
        who = walker()
        go(among(box([-1, height, -3], [1, height + 0.05, -2])), who, 4.0)
        assert (who.position.z < -4) == passes


def test_nobody_is_lifted_into_a_ceiling() -> None:
    who = walker()
    go(among(box([-2, 0, -6], [2, 0.3, -2]), box([-2, 1.9, -6], [2, 2.2, -2.0])), who, 3.0)
    assert who.position.y == pytest.approx(1.7, abs=1e-6)


@pytest.mark.parametrize("toward", [0.0, 90.0, 200.0])
@pytest.mark.parametrize("size", [0.3, 1.0, 4.0])
def test_who_starts_inside_gets_out_unpushed(size: float, toward: float) -> None:
    block = box([-size, 0, -size], [size, 3, size])
    obstacles, who = among(block), walker(x=0.1, toward=toward)
    obstacles.walk(who, {}, 1 / 60)
    assert who.position == glm.dvec3(0.1, 1.7, 0)
    go(obstacles, who, 1 + size * 1.5)
    assert max(abs(who.position.x), abs(who.position.z)) > size + RADIUS
    who.yaw += math.pi
    go(obstacles, who, 4.0)  # outside, it is solid again
    assert max(abs(who.position.x), abs(who.position.z)) > size + RADIUS - 1e-3


def test_who_starts_under_a_table_gets_out() -> None:
    obstacles, who = among(box([-1, 0.7, -1], [1, 0.75, 1])), walker()
    go(obstacles, who, 2.0)
    assert who.position.z < -1.2


def test_who_overlaps_a_wall_slides_and_leaves_but_does_not_enter() -> None:
    obstacles, who = among(WALL), walker(z=-2.85)
    go(obstacles, who, 0.5)
    assert who.position.z == pytest.approx(-2.85, abs=1e-6)
    who.yaw = math.radians(-90)
    go(obstacles, who, 1.0)
    assert who.position.x > 1 and who.position.z == pytest.approx(-2.85, abs=1e-6)
    who.yaw = math.pi
    go(obstacles, who, 1.0)
    assert who.position.z > -2


def test_a_moving_wall_does_not_push_or_trap() -> None:
    barriers = Barriers(WALL)
    obstacles, who = Obstacles(barriers, 0.0), walker(z=-2)
    go(obstacles, who, 1.0)
    for step in range(60):  # it passes over the viewer
        barriers.placed = [place(WALL, (0, 0, step * 0.05))]
        barriers.changes += 1
        before = glm.dvec3(who.position)
        obstacles.walk(who, {}, 1 / 60)
        assert who.position == before
    barriers.placed = [place(WALL, (0, 0, 0.35))]  # the viewer stands in it
    barriers.changes += 1
    go(obstacles, who, 2.0)
    assert who.position.z < -3.5


def test_a_door_that_closes_stops() -> None:
    barriers = Barriers(place(WALL, (0, 10, 0)))
    obstacles, who = Obstacles(barriers, 0.0), walker()
    go(obstacles, who, 1.0)
    barriers.placed = [place(WALL)]
    barriers.changes += 1
    go(obstacles, who, 3.0)
    assert who.position.z == pytest.approx(-3 + RADIUS, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [3.0, 30.0, 1000.0])
@pytest.mark.parametrize("rate", [1.0, 10.0, 60.0])
def test_nobody_is_too_fast_for_a_thin_wall(speed: float, rate: float) -> None:
    wall = sheet([-9e3, 0, -9], [9e3, 0, -9], [9e3, 3, -9], [-9e3, 3, -9])
    who = walker(speed=speed, toward=10.0)
    go(among(wall), who, 4.0 if speed < 100 else 1.0, rate=rate, fast=True)
    assert who.position.z == pytest.approx(-9 + RADIUS, abs=0.3) and who.position.z >= -9 + RADIUS - 1e-6


def test_turned_and_scaled_objects_stop_where_they_are() -> None:
    cube = box([-0.5, 0, -0.5], [0.5, 1, 0.5])
    who = walker()
    go(among(place(cube, (0, 0, -5), yaw=math.radians(45), scale=2.0)), who, 6.0)
    assert who.position.z == pytest.approx(-5 + math.sqrt(2) + RADIUS, abs=2e-3)


@pytest.mark.parametrize(("half", "is_stepped_on"), [(0.15, True), (0.4, False)])
def test_a_fallen_column_is_stepped_on_or_stops(half: float, is_stepped_on: bool) -> None:
    """Only there where it lies, not where it stood."""
    column = box([-half, 0, -half], [half, 4, half])
    fallen = place(column, (2, half, -3), roll=math.radians(90))  # lies towards −x
    who, aside = walker(), walker(x=3.0)
    way = go(among(fallen), who, 4.0)
    go(among(fallen), aside, 4.0)
    assert aside.position.z < -5.5 and aside.position.y == pytest.approx(1.7, abs=1e-3)
    if is_stepped_on:
        assert who.position.z < -5.5 and who.position.y == pytest.approx(1.7, abs=1e-3)
        assert max(place.y for place in way) == pytest.approx(1.7 + 2 * half, abs=0.06)
    else:
        assert who.position.z == pytest.approx(-3 + half + RADIUS, abs=2e-3)


def test_a_leaning_ladder_is_passed_under_where_it_is_high() -> None:
    """Its foot is at x = 0; at x = 3 it is 3 m above the ground."""
    ladder = place(box([-0.05, 0, -0.3], [0.05, 8, 0.3]), (0, 0, -3), roll=math.radians(-45))
    under, at = walker(x=3.0), walker(x=0.8)
    go(among(ladder), under, 4.0)
    go(among(ladder), at, 4.0)
    assert under.position.z < -5.5
    assert at.position.z == pytest.approx(-3 + 0.3 + RADIUS, abs=2e-3)


def test_who_is_in_a_leaning_object_is_told() -> None:
    tower = place(box([-1, 0, -1], [1, 8, 1]), (0, 0, 0), roll=math.radians(45))
    heights = np.array([1.0, 1.5, 2.0])
    assert tower.holds(np.array([-1.5, 0, 0]), heights) and not tower.holds(np.array([1.5, 0, 0]), heights)


def test_standing_still_asks_for_nothing() -> None:
    barriers = Barriers(WALL)
    obstacles, who = Obstacles(barriers, 0.0), walker()
    for _ in range(600):
        obstacles.walk(who, {}, 1 / 60)
    assert barriers.asked == 1 and who.position == glm.dvec3(0, 1.7, 0)


def test_who_begins_on_a_floor_above_the_ground_keeps_the_height_of_the_eyes() -> None:
    obstacles, who = among(box([-3, 0, -3], [3, 0.1, 3])), walker()
    obstacles.walk(who, {}, 1 / 60)
    assert who.position.y == 1.7 and who.eye_height == pytest.approx(1.6)
    go(obstacles, who, 4.0)
    assert who.position.y == pytest.approx(1.6, abs=1e-3)


def test_who_begins_in_the_air_comes_down_on_what_is_below() -> None:
    obstacles, who = among(box([-3, 0, -3], [3, 2, 3])), walker(feet=2.5)
    for _ in range(120):
        obstacles.walk(who, {}, 1 / 60)
    assert who.position.y == pytest.approx(3.7, abs=1e-3)
    who.position = glm.dvec3(8, 9, 0)
    for _ in range(120):
        obstacles.walk(who, {}, 1 / 60)
    assert who.position.y == pytest.approx(1.7, abs=1e-3)


def test_nobody_falls_through_a_floor_that_is_not_known_yet() -> None:
    barriers = Barriers()
    barriers.is_waiting = True
    obstacles, who = Obstacles(barriers, None), walker(feet=5.0)
    go(obstacles, who, 1.0)
    assert who.position.y == pytest.approx(6.7)
    barriers.is_waiting, barriers.changes = False, 1
    go(obstacles, who, 1.0)
    assert who.position.y == pytest.approx(1.7, abs=1e-3)


TURNS = st.lists(st.tuples(st.floats(-180, 180), st.floats(0.05, 1.0), st.floats(0.5, 60.0)), min_size=1, max_size=12)


@pytest.mark.slow
@settings(deadline=None, max_examples=25)
@given(turns=TURNS, rate=st.sampled_from([5.0, 20.0, 60.0]))
def test_nobody_leaves_a_closed_room(turns: list[tuple[float, float, float]], rate: float) -> None:
    furniture = [
        place(box([-0.4, 0, -0.4], [0.4, 0.9, 0.4]), (1.5, 0, 1), yaw=0.4),
        place(box([-0.2, 0, -1], [0.2, 2.5, 1]), (-1, 0, -1.2), yaw=1.0),
        place(box([0, 0, 0], [1, 0.3, 1]), (-2.9, 0, 1.5)),
    ]
    obstacles, who = among(ROOM, *furniture), walker()
    for toward, seconds, speed in turns:
        who.yaw, who.speed = math.radians(toward), speed
        for place_ in go(obstacles, who, seconds, rate=rate):
            assert max(abs(place_.x), abs(place_.z)) <= 3 - RADIUS + 1e-6 and 1.7 <= place_.y <= 2.0 + 1e-6
    before = glm.dvec3(who.position)
    ways = []
    for toward in range(0, 360, 30):  # some way is always open
        who.yaw, who.speed, who.velocity = math.radians(toward), 2.0, glm.dvec3()
        go(obstacles, who, 0.5)
        ways.append(glm.distance(who.position, before))
        before = glm.dvec3(who.position)
    assert max(ways) > 0.2


def test_keys_are_measured_as_without_obstacles() -> None:
    free, held = walker(), walker()
    obstacles = among(WALL)
    for _ in range(30):
        free.advance({Move.RIGHT: 0.01}, 1 / 60)
        obstacles.walk(held, {Move.RIGHT: 0.01}, 1 / 60)
    assert held.position == free.position and held.velocity == free.velocity


def test_a_guess_of_where_the_viewer_will_be_stops_at_walls() -> None:
    obstacles, who = among(WALL), walker(z=-2.4)
    obstacles.walk(who, {}, 1 / 60)
    soon = who.camera.moved(glm.dvec3(0.1, 0.02, -0.6))
    x, y, z = obstacles.reachable(who, soon).position
    assert (x, y, z) == pytest.approx((0.1, 1.72, -3 + RADIUS), abs=1e-3)
    free = who.camera.moved(glm.dvec3(0, 0, 0.6))
    assert obstacles.reachable(who, free) == free
