"""Define the measures of a picture and their goals, and summarise them over several views."""

from collections.abc import Sequence
from dataclasses import dataclass
from operator import ge, le

import numpy as np

from depthwalk.quality.measure import ViewQuality
from depthwalk.quality.views import Viewpoint

GOAL_RESOLUTION, GOAL_LAYERS = 512, 3
BAKE_SECONDS, GPU_BYTES = 8.0, 16_000_000  # goals of an object baked this way


@dataclass(frozen=True, kw_only=True)
class Measure:
    """Describe a field of `ViewQuality`, and its goals.

    Attributes
    ----------
    key
        Name of the field.
    title
        Its name in tables.
    digits
        Number of digits that are shown after the decimal point.
    more_is_better
        Whether larger values are better.
    goal_mean
        Goal for the mean over the views; None if there is none.
    goal_worst
        Goal for every single view; None if there is none.
    """

    key: str
    title: str
    digits: int
    more_is_better: bool
    goal_mean: float | None
    goal_worst: float | None

    def reached(self, value: float, goal: float | None) -> bool | None:
        """Return whether `value` reaches `goal`; None if there is no goal, or the value is not a number."""
        if goal is None or np.isnan(value):
            return None
        return bool((ge if self.more_is_better else le)(value, goal))


MEASURES = (
    Measure(key="psnr", title="PSNR, dB", digits=2, more_is_better=True, goal_mean=33.0, goal_worst=27.0),
    Measure(key="iou", title="silhouette IoU", digits=4, more_is_better=True, goal_mean=0.9985, goal_worst=0.995),
    Measure(key="flip", title="FLIP", digits=4, more_is_better=False, goal_mean=0.020, goal_worst=0.045),
    Measure(
        key="depth_median",
        title="depth error, median",
        digits=5,
        more_is_better=False,
        goal_mean=0.0005,
        goal_worst=None,
    ),
    Measure(
        key="depth_p99", title="depth error, 99 %", digits=5, more_is_better=False, goal_mean=0.01, goal_worst=None
    ),
    Measure(key="holes", title="hole pixels, %", digits=3, more_is_better=False, goal_mean=0.02, goal_worst=0.1),
)


SILHOUETTE = next(measure for measure in MEASURES if measure.key == "iou")


@dataclass(frozen=True)
class Summary:
    """Hold the mean and the worst value of a measure over several views.

    Attributes
    ----------
    mean
        Mean over the views; NaN if no view has a value.
    worst
        Value of the worst view; NaN if no view has one.
    worst_view
        The worst view; None if no view has a value.
    """

    mean: float
    worst: float
    worst_view: Viewpoint | None


def summarise(measure: Measure, views: Sequence[ViewQuality]) -> Summary:
    """Return the mean and the worst value of a measure over several views.

    Parameters
    ----------
    measure
        The field of `ViewQuality` to summarise; it also defines whether larger values are better.
    views
        The measures of each view; views whose value is NaN do not count.

    Returns
    -------
    Summary
        Mean and worst value, and the view of the worst; NaN and None if no view has a value.
    """
    values = np.array([getattr(view, measure.key) for view in views], np.float64)
    valued = np.flatnonzero(~np.isnan(values))
    if not len(valued):
        return Summary(float("nan"), float("nan"), None)
    order = valued[np.argsort(values[valued], kind="stable")]
    worst = int(order[0] if measure.more_is_better else order[-1])
    return Summary(float(values[valued].mean()), float(values[worst]), views[worst].viewpoint)
