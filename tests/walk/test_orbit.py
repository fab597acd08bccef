import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyglm import glm

from depthwalk.scene.arrays import Camera
from depthwalk.scene.camera import clip_from_view, view_from_world
from depthwalk.types import Array
from depthwalk.walk import orbit
from depthwalk.walk.controls import MAX_PITCH
from walks import look

coordinate = st.floats(-1000, 1000)
drag = st.floats(-2000, 2000)
BEFORE = Camera((0.0, 1.0, 5.0), (0.0, 1.0, 0.0), 1.0)


@st.composite
def cameras(draw: Callable[..., Any]) -> Camera:
    """About any target, not near the poles."""
    yaw, pitch, distance = draw(st.floats(-7, 7)), draw(st.floats(-1.5, 1.5)), draw(st.floats(0.01, 100))
    look = np.array([-math.sin(yaw) * math.cos(pitch), math.sin(pitch), -math.cos(yaw) * math.cos(pitch)])
    target = np.array([draw(coordinate) for _ in range(3)])
    return Camera(tuple((target - distance * look).tolist()), tuple(target.tolist()), draw(st.floats(0.1, 2.5)))


def on_screen(camera: Camera, point: tuple[float, float, float]) -> Array:
    """Where a square picture shows `point`, −1 to 1, up and to the right."""
    x, y, _, w = clip_from_view(camera.fov, 1.0, 1e-3, 1e6) * view_from_world(camera) * glm.dvec4(*point, 1)
    return np.array([x, y]) / w


@given(cameras(), drag, drag)
def test_turning_keeps_target_and_distance(camera: Camera, right: float, down: float) -> None:
    turned = orbit.turn(camera, right, down)
    assert turned.target == camera.target and turned.fov == camera.fov
    assert orbit.distance(turned) == pytest.approx(orbit.distance(camera), rel=1e-6)
    assert on_screen(turned, turned.target) == pytest.approx([0, 0], abs=1e-6)


@given(cameras(), drag)
def test_turning_round_comes_back(camera: Camera, right: float) -> None:
    there_and_back = orbit.turn(orbit.turn(camera, right, 0), -right, 0)
    np.testing.assert_allclose(there_and_back.position, camera.position, atol=1e-6 * (1 + orbit.distance(camera)))


def test_what_is_in_front_follows_the_drag() -> None:
    nearer = (0.0, 1.0, 2.0)
    assert on_screen(orbit.turn(BEFORE, 20, 0), nearer)[0] > 0.01
    assert on_screen(orbit.turn(BEFORE, 0, 20), nearer)[1] < -0.01
    assert orbit.turn(BEFORE, 0, 1e4).position[1] == pytest.approx(1 + 5 * math.sin(MAX_PITCH))  # not over the top


@given(cameras(), st.floats(-2, 2), st.floats(-2, 2))
def test_panning_takes_the_target_along_with_the_mouse(camera: Camera, right: float, down: float) -> None:
    panned = orbit.pan(camera, right, down)
    look = np.subtract(panned.target, panned.position)
    np.testing.assert_allclose(look, np.subtract(camera.target, camera.position), atol=1e-9)
    # A height of the picture is 2 on the screen, whose y goes up.
    assert on_screen(panned, camera.target) == pytest.approx([2 * right, -2 * down], abs=1e-4)


@given(cameras(), st.floats(-200, 200))
def test_dollying_keeps_target_and_direction_and_never_arrives(camera: Camera, notches: float) -> None:
    nearer = orbit.dolly(camera, notches)
    low, high = orbit.DISTANCE_RANGE
    wanted = orbit.distance(camera) * orbit.CLOSER_PER_NOTCH**notches
    assert nearer.target == camera.target
    assert orbit.distance(nearer) == pytest.approx(min(max(wanted, low), high), rel=1e-4)
    if orbit.distance(nearer) > 0.01:
        assert look(nearer) == pytest.approx(look(camera), abs=1e-6)


@given(cameras(), st.floats(0.01, 1000))
def test_another_distance_is_the_same_view(camera: Camera, metres: float) -> None:
    other = orbit.with_distance(camera, metres)
    assert other.position == camera.position and orbit.distance(other) == pytest.approx(metres)
    assert on_screen(camera, other.target) == pytest.approx([0, 0], abs=1e-5)


@pytest.mark.parametrize("frames", [1, 7])
def test_aiming_takes_as_long_at_any_rate(frames: int) -> None:
    camera, point = BEFORE, glm.dvec3(2, 1, 1)
    for _ in range(frames):
        camera, arrived = orbit.aim(camera, point, 0.14 / frames)
        assert not arrived
    assert camera.target == pytest.approx(point + np.subtract(BEFORE.target, point) * math.exp(-0.14 / 0.08))
    assert orbit.aim(camera, point, 5.0) == (Camera(BEFORE.position, (2, 1, 1), 1.0), True)
