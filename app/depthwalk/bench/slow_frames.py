"""Explain why the slowest frames of a run took longer than the others.

Passes are not timed in every frame, because timing itself costs time. But the work in each frame is known: triangles
warped, shadow maps redrawn, shaders compiled. The cost of each kind of work is estimated from all frames of the run
together, by non-negative least squares; CPU-only work is measured in each frame. The share of a cause in a slow frame
is its cost there beyond that in a usual frame.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

_MOST = 5  # frames that are reported
_TOLD = 0.1  # part of the excess that a cause must explain to be reported
_OTHER = "something not counted, such as shading or other programs"

# Work that is measured in milliseconds, and its description.
_MEASURED = {
    "cull_ms": "culling",
    "plan_ms": "planning",
    "upload_ms": "uploading assets",
    "garbage_ms": "Python's garbage collector",
}
# Work that is counted, and its description.
_COUNTED = {
    "warped_triangles": "warping {:,.0f} triangles",
    "mesh_triangles": "drawing {:,.0f} triangles of meshes",
    "shadow_triangles": "shadow maps of {:,.0f} triangles",
    "shadow_maps": "{:.0f} shadow maps",
    "dpci": "drawing {:,.0f} impostors",
    "programs": "compiling {:.0f} shader programs",
}


@dataclass(frozen=True, kw_only=True)
class Cause:
    """Name one reason why a frame took longer than the median frame.

    Attributes
    ----------
    what
        A description.
    ms
        Milliseconds beyond its time in a usual frame.
    """

    what: str
    ms: float


@dataclass(frozen=True, kw_only=True)
class SlowFrame:
    """Hold one of the slowest frames.

    Attributes
    ----------
    frame
        Its number, from 0.
    ms
        Its time, milliseconds.
    causes
        Why it took longer than the median frame, the largest cause first.
    """

    frame: int
    ms: float
    causes: tuple[Cause, ...]


def slowest_frames(
    times: Sequence[float], work: Mapping[str, Sequence[float]], frames: Sequence[int]
) -> tuple[SlowFrame, ...]:
    """Find the slowest frames of a run, and why they took longer.

    Parameters
    ----------
    times
        (n,) time of each frame, milliseconds.
    work
        Work done in each, by name, (n,) each, see `bench.measure.Trace.work`. Names unknown here are ignored.
    frames
        Numbers of the frames to consider.

    Returns
    -------
    tuple[SlowFrame, ...]
        Up to five frames that took longer than the median one, the slowest first.
    """
    total = np.asarray(times, np.float64)[list(frames)]
    extra, words = _extra_costs(total, {name: np.asarray(column)[list(frames)] for name, column in work.items()})
    median = np.median(total)
    slow = [int(k) for k in np.argsort(-total)[:_MOST] if total[k] > median]
    return tuple(
        SlowFrame(frame=frames[k], ms=round(float(total[k]), 3), causes=_causes(total[k] - median, extra[k], words[k]))
        for k in slow
    )


def _extra_costs(
    total: NDArray[np.float64], work: Mapping[str, NDArray[np.generic]]
) -> tuple[list[list[float]], list[list[str]]]:
    """Return for each frame the milliseconds of each cause beyond the median frame's, and the causes in words."""
    columns = {name: column.astype(np.float64) for name, column in work.items()}
    measured = {name: columns[name] for name in _MEASURED if name in columns}
    counted = {name: columns[name] for name in _COUNTED if name in columns and np.ptp(columns[name]) > 0}
    drawing = np.maximum(total - sum(measured.values(), np.zeros(len(total))), 0)
    scale = {name: column.max() for name, column in counted.items()}
    terms = np.stack([np.ones(len(total)), *(counted[name] / scale[name] for name in counted)], axis=1)
    prices, _ = nnls(terms, drawing)
    costs = [*measured.values(), *(price * column for price, column in zip(prices[1:], terms.T[1:], strict=True))]
    extra = np.stack([cost - np.median(cost) for cost in costs], axis=1) if costs else np.zeros((len(total), 0))
    words = [
        [*(_MEASURED[name] for name in measured), *(_COUNTED[name].format(counted[name][k]) for name in counted)]
        for k in range(len(total))
    ]
    return extra.tolist(), words


def _causes(excess: float, extra: Sequence[float], words: Sequence[str]) -> tuple[Cause, ...]:
    """Return the causes that explain enough of a frame's excess over the median one, largest first."""
    found = [(ms, what) for ms, what in zip(extra, words, strict=True) if ms > _TOLD * excess]
    rest = excess - sum(ms for ms, _ in found)
    if rest > 0.5 * excess:  # less than half of it is explained
        found.append((rest, _OTHER))
    return tuple(Cause(what=what, ms=round(ms, 3)) for ms, what in sorted(found, reverse=True))
