import pytest

from depthwalk.walk.times import FrameTimes


def test_frame_times_are_smoothed_over_half_a_second() -> None:
    times = FrameTimes(length=8)
    assert times.smoothed == 0
    for seconds in (9.0, 0.1, 0.2, 0.1, 0.2, 0.1):
        times.add(seconds)
    assert times.smoothed == pytest.approx(0.15)
    assert times.milliseconds == pytest.approx([9000, 100, 200, 100, 200, 100])
