"""Say what is measured of a picture and what goals it has, and summarise it over several views."""

from collections.abc import Sequence
from dataclasses import dataclass
from operator import ge, le

import numpy as np

from depthwalk.quality.measure import ViewQuality
from depthwalk.quality.views import Viewpoint

GOAL_RESOLUTION, GOAL_LAYERS = 512, 3
BAKE_SECONDS, GPU_BYTES = 8.0, 16_000_000  # goals of an object baked so


@dataclass(frozen=True)
class Measure:
    """Describe a field of `ViewQuality`.

    Attributes
    ----------
    digits : shown after the decimal point.
    goal_mean : for the mean over the views.
    goal_worst : for every single view.
    """

    key: str
    title: str
    digits: int
    more_is_better: bool
    goal_mean: float | None
    goal_worst: float | None

    def reached(self, value: float, goal: float | None) -> bool | None:
        """Return whether a value reaches a goal; None where either is lacking."""
        if goal is None or np.isnan(value):
            return None
        return bool((ge if self.more_is_better else le)(value, goal))


MEASURES = (
    Measure("psnr", "PSNR, dB", 2, True, 33.0, 27.0),
    Measure("iou", "silhouette IoU", 4, True, 0.9985, 0.995),
    Measure("flip", "FLIP", 4, False, 0.020, 0.045),
    Measure("depth_median", "depth error, median", 5, False, 0.0005, None),
    Measure("depth_p99", "depth error, 99 %", 5, False, 0.01, None),
    Measure("holes", "hole pixels, %", 3, False, 0.02, 0.1),
)


SILHOUETTE = next(measure for measure in MEASURES if measure.key == "iou")


@dataclass(frozen=True)
class Summary:
    """Mean and worst of a measure, and the view that is worst; without a value NaN, NaN and None."""

    mean: float
    worst: float
    worst_view: Viewpoint | None


def summarise(measure: Measure, views: Sequence[ViewQuality]) -> Summary:
    """Return mean and worst of a measure over the views that have a value."""
    values = np.array([getattr(view, measure.key) for view in views], np.float64)
    valued = np.flatnonzero(~np.isnan(values))
    if not len(valued):
        return Summary(float("nan"), float("nan"), None)
    order = valued[np.argsort(values[valued], kind="stable")]
    worst = int(order[0] if measure.more_is_better else order[-1])
    return Summary(float(values[valued].mean()), float(values[worst]), views[worst].viewpoint)
