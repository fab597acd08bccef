"""Where a camera will be."""

import math
from dataclasses import replace

import pytest

from depthwalk.scene.arrays import Camera
from depthwalk.walk.motion import Motion


def at(seconds: float) -> Camera:
    """A walk of 2 m/s to the right, with a turn of 90° a second to the left."""
    angle = math.radians(90) * seconds
    position = 1 + 2 * seconds, 1.5, 0.0
    return Camera(position, (position[0] - math.sin(angle), 1.5, -math.cos(angle)), 0.9)


def test_a_walk_goes_on_as_it_did() -> None:
    motion = Motion()
    for step in range(60):
        motion.follow(at(step * 0.02), 0.02)
    ahead, true = motion.ahead(0.3), at(59 * 0.02 + 0.3)
    assert ahead.position == pytest.approx(true.position, abs=1e-4)
    assert tuple(ahead.look) == pytest.approx(tuple(true.look), abs=1e-4)
    assert motion.ahead(0.0) == at(59 * 0.02)


def test_who_stands_still_stays() -> None:
    motion = Motion()
    for step in range(5):
        motion.follow(at(step * 0.02), 0.02)
    motion.follow(at(0.08), 0.02)
    assert motion.ahead(0.5) == at(0.08)


def test_the_moment_goes_on_only_while_animations_run() -> None:
    motion, still = Motion(), at(0)
    for step in range(5):
        motion.follow(replace(still, time=1 + step * 0.02), 0.02)
    assert motion.ahead(0.5).time == pytest.approx(1.58) and motion.ahead(0.5).position == still.position
    motion.follow(replace(still, time=1.08), 0.02)
    assert motion.ahead(0.5).time == 1.08


def test_before_the_first_camera_there_is_no_answer() -> None:
    with pytest.raises(ValueError, match="no camera"):
        Motion().ahead(0.1)


def test_a_look_straight_back_is_no_turn_about_nothing() -> None:
    motion = Motion()
    motion.follow(Camera((0, 0, 0), (0, 0, -1), 0.9), 0.1)
    motion.follow(Camera((0, 0, 0), (0, 0, -3), 0.9), 0.1)  # the same look, farther
    assert tuple(motion.ahead(1.0).look) == pytest.approx((0, 0, -3))
