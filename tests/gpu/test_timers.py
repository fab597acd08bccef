"""Time per pass, and that it is taken of few frames where taking it costs time."""

import time
from types import SimpleNamespace
from typing import cast

import pytest

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import LONGEST_SUBMISSION, PassTimers


class Clocked:
    """A context that counts how often it is drained, and whose queries know their own numbers, in nanoseconds."""

    def __init__(self) -> None:
        self.drained, self.queries = 0, 0

    def finish(self) -> None:
        self.drained += 1

    def query(self, time: bool) -> "Query":
        self.queries += 1
        return Query(1e6 * self.queries)


class Query:
    def __init__(self, elapsed: float) -> None:
        self.elapsed = elapsed

    def __enter__(self) -> None:
        pass

    def __exit__(self, *error: None) -> None:
        pass


@pytest.fixture
def context() -> Clocked:
    return Clocked()


def draw(timers: PassTimers) -> int:
    with timers.measure_cpu("plan"):
        pass
    for name in ("warp", "light", "warp"):
        with timers.measure(name):
            pass
    timers.end_frame()
    return timers.of_frame


def test_software_rasterisers_are_drained_in_few_frames(context: Clocked) -> None:
    timers = PassTimers(cast(Device, SimpleNamespace(context=context, software=True)))
    assert timers.kind == "finish"
    # The first frame compiles shaders: to wait for each pass there would keep a core idle, and time compilers.
    assert [draw(timers) for _ in range(3)] == [-1] * 3 and context.drained == 0
    assert [draw(timers) for _ in range(10)] == [3] * 8 + [11] * 2
    assert context.drained == 2 * 3 and set(timers.milliseconds) == {"plan", "warp", "light"}
    timers.time_next()
    assert draw(timers) == 13 and not timers.awaited(13)
    assert [draw(timers) for _ in range(8)] == [13] * 7 + [21]


def test_queries_are_read_some_frames_later(context: Clocked) -> None:
    timers = PassTimers(cast(Device, SimpleNamespace(context=context, software=False)))
    assert [draw(timers) for _ in range(7)] == [-1] * 4 + [0, 1, 2]
    assert timers.awaited(6) and not timers.awaited(2) and context.drained == 0
    assert timers.milliseconds["warp"] == 7 + 9 and context.queries == 3 * 5  # the third frame's; used again


@pytest.mark.parametrize("software", [True, False])
def test_waiting_for_a_gpu_is_not_counted_besides_its_work(software: bool, context: Clocked) -> None:
    timers = PassTimers(cast(Device, SimpleNamespace(context=context, software=software)))
    with timers.measure_cpu("occlusion"):
        with timers.measure_within("occlusion_depth"):
            pass
        with timers.waiting():
            time.sleep(0.02)
    timers.time_next()
    timers.end_frame()
    assert (timers.by_clock["occlusion"] > 20) == software and context.drained == 0
    for _ in range(4):
        timers.end_frame()
    assert set(timers.milliseconds) == ({"occlusion"} if software else {"occlusion", "occlusion_depth"})


def test_frames_are_taken_for_long_until_their_times_are_known(context: Clocked) -> None:
    timers = PassTimers(cast(Device, SimpleNamespace(context=context, software=False)))
    expected = []
    for _ in range(5):
        expected.append(timers.may_be_long)
        draw(timers)
    assert all(expected) and not timers.may_be_long
    timers.milliseconds |= {"warp": LONGEST_SUBMISSION / 2, "light": LONGEST_SUBMISSION / 2}
    assert timers.may_be_long


def test_no_watchdog_ends_what_the_cpu_draws(context: Clocked) -> None:
    timers = PassTimers(cast(Device, SimpleNamespace(context=context, software=True)))
    assert not timers.may_be_long
    timers.milliseconds["warp"] = 2 * LONGEST_SUBMISSION
    assert not timers.may_be_long
