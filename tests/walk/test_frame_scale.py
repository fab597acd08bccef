"""How many pixels frames get, by how long they take."""

import pytest

from depthwalk.walk.frame_scale import LEAST, STEP, FrameScale


def settled(seconds_of_whole: float, fixed: float = 0.0, limit: float = 0.3) -> list[float]:
    """The factors of frames that take this long at full scale, `fixed` of it whatever the scale."""
    scale, factors = FrameScale(), []
    for _ in range(40):
        factors.append(scale.factor)
        scale.note(fixed + (seconds_of_whole - fixed) * scale.factor**2, limit)
    return factors


def test_quick_frames_keep_all_pixels() -> None:
    assert set(settled(0.29)) == {1.0}


@pytest.mark.parametrize("seconds", [0.31, 0.5, 0.8, 1.2])
@pytest.mark.parametrize("fixed", [0.0, 0.1])
def test_slow_frames_come_to_rest_within_the_limit(seconds: float, fixed: float) -> None:
    factors = settled(seconds, fixed)
    assert len(set(factors[10:])) == 1  # no wavering
    assert fixed + (seconds - fixed) * factors[-1] ** 2 <= 0.3


def test_it_stops_at_the_least() -> None:
    assert settled(30.0)[-1] == pytest.approx(STEP**LEAST)
