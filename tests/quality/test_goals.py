"""Mean, worst view and goals of a measure."""

import math

import pytest

from depthwalk.quality.goals import MEASURES, Summary, summarise
from depthwalk.quality.measure import ViewQuality
from depthwalk.quality.views import Viewpoint

BY_KEY = {measure.key: measure for measure in MEASURES}


def views_of(key: str, *values: float) -> list[ViewQuality]:
    others = dict.fromkeys(BY_KEY, 0.0)
    return [
        ViewQuality(viewpoint=Viewpoint(0.0, float(number)), pixels=9, **others | {key: value})
        for number, value in enumerate(values)
    ]


@pytest.mark.parametrize(("key", "worst"), [("psnr", 20.0), ("flip", 40.0)])
def test_the_worst_is_the_least_or_the_most(key: str, worst: float) -> None:
    values = 30.0, 20.0, 40.0
    summary = summarise(BY_KEY[key], views_of(key, *values))
    assert summary == Summary(30.0, worst, Viewpoint(0.0, float(values.index(worst))))


def test_views_without_a_value_do_not_count() -> None:
    summary = summarise(BY_KEY["depth_p99"], views_of("depth_p99", math.nan, 0.5, math.nan))
    assert (summary.mean, summary.worst, summary.worst_view) == (0.5, 0.5, Viewpoint(0.0, 1.0))


def test_no_value_at_all() -> None:
    summary = summarise(BY_KEY["psnr"], [])
    assert math.isnan(summary.mean) and math.isnan(summary.worst) and summary.worst_view is None


@pytest.mark.parametrize(
    ("key", "value", "goal", "reached"),
    [
        ("psnr", 33.0, 33.0, True),
        ("psnr", 32.9, 33.0, False),
        ("flip", 0.02, 0.02, True),
        ("flip", 0.03, 0.02, False),
        ("flip", 0.03, None, None),
        ("psnr", math.nan, 33.0, None),
    ],
)
def test_goals(key: str, value: float, goal: float, reached: bool) -> None:
    assert BY_KEY[key].reached(value, goal) is reached
