import pytest

from depthwalk.walk.times import FrameTimes, PictureTimes


def test_frame_times_are_smoothed_over_half_a_second() -> None:
    times = FrameTimes(length=8)
    assert times.smoothed == 0
    for seconds in (9.0, 0.1, 0.2, 0.1, 0.2, 0.1):
        times.add(seconds)
    assert times.smoothed == pytest.approx(0.15)
    assert times.milliseconds == pytest.approx([9000, 100, 200, 100, 200, 100])


def test_a_picture_that_follows_none_tells_no_rate() -> None:
    """The window's first one would be shown at tens of thousands a second."""
    times = PictureTimes()
    times.note(1e-5, shows=True)
    assert times.smoothed == 0
    for seconds, shows in ((0.1, True), (0.2, True), (0.05, False), (1e-5, False), (1e-5, True), (0.3, True)):
        times.note(seconds, shows=shows)
    assert times.milliseconds == pytest.approx([100, 200, 300])
