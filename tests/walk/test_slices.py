"""What is drawn a slice at a time."""

import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from depthwalk.walk.slices import FrameSlices, Slices


class Clock:
    """A clock that only work moves on."""

    def __init__(self) -> None:
        self.now, self.waited = 0.0, 0
        self.device: Any = SimpleNamespace(context=SimpleNamespace(finish=self.finish))

    def finish(self) -> None:
        self.waited += 1

    def steps(self, *seconds: float) -> Iterator[str]:
        for spent in seconds:
            self.now += spent
            yield "pass"


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(time, "perf_counter", lambda: made.now)
    return made


def test_a_slice_ends_with_the_first_step_that_is_late(clock: Clock) -> None:
    slices = Slices(clock.device)
    slices.begin(clock.steps(1, 1, 1, 1))
    assert not slices.advance(1.5) and clock.now == 2 and clock.waited == 2 and slices.is_drawing
    assert slices.advance(9) and clock.now == 4 and not slices.is_drawing
    slices.begin(clock.steps(1))
    slices.drop()
    assert not slices.is_drawing


def test_a_frame_begins_no_step_that_was_late_in_the_one_before(clock: Clock) -> None:
    slices = FrameSlices(clock.device)
    for most in (9.0, 2.5):
        slices.begin(clock.steps(1, 2, 1))
        began = clock.now
        while not slices.advance(most):
            clock.now += 0.5  # something is shown
        shown = clock.now - began - 4
        assert slices.end() == 4 and slices.delay == 4 + shown
    assert shown == 1  # after the first step, as the second takes longer than is left; and after that


def test_steps_that_no_frame_had_before_are_taken_to_be_as_long_as_the_last(clock: Clock) -> None:
    slices = FrameSlices(clock.device)
    slices.begin(clock.steps(1, 1, 1, 3, 1))
    ends = []
    while not slices.advance(2.5):
        ends.append(clock.now)
    assert ends == [2, 6] and clock.now == 7  # the fourth is longer than could be known
