"""What a walk knows of the time, and how long its widgets are drawn."""

import time

import pytest

from depthwalk.walk.clock import WalkClock, WidgetRounds


def test_rounds_last_as_long_as_they_do_less_what_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [10.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    clock = WalkClock()
    now[0] = 11.0
    assert clock.tick() == 1 and clock.now == 11

    def waits(seconds: float) -> None:
        now[0] += seconds

    monkeypatch.setattr("depthwalk.walk.clock.wait_for_event", waits)
    with clock.stopped():
        now[0] += 5
    clock.wait(2.5)
    assert clock.left_out == 7.5
    now[0] += 0.25
    assert clock.tick() == 0.25
    assert clock.tick() == 0


def test_widgets_are_drawn_for_three_rounds_after_a_change() -> None:
    rounds = WidgetRounds()
    assert [rounds.are_over(("a",), news) for news in (False, False, False, False, True)] == [0, 0, 0, 1, 0]
    assert [rounds.are_over(("a",), False) for _ in range(3)] == [0, 0, 1]
    assert not rounds.are_over(("b",), False)
    for _ in range(3):
        rounds.are_over(("b",), False)
    assert rounds.are_over(("b",), False)
    rounds.begin()
    assert not rounds.are_over(("b",), False)
