"""Lay out the plots of a benchmark's page, in the coordinates of SVG pictures; `templates/bench.html` draws them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.bench.tables.table import Curves

TEMPLATE = Path(__file__).with_name("templates") / "bench.html"
COLOURS = ("#0b6bcb", "#c4500a", "#1a7f4b", "#8a3ffc", "#b0177a", "#6b6b00", "#00838f", "#5d4037")
LEFT, RIGHT, TOP, BOTTOM = 56, 852, 8, 240  # of the axes, CSS pixels
_TICKS = 5  # of the vertical axis
_BINS = 40  # of a histogram
_NAMED = 7  # named parts of a stack; all others together are the eighth


@dataclass(frozen=True, kw_only=True)
class Shape:
    """Hold a line or an area.

    Attributes
    ----------
    points
        Its points, in SVG notation.
    colour
        Its colour, in CSS notation.
    name
        What it shows; "" if another shape of this colour is named.
    """

    points: str
    colour: str
    name: str


@dataclass(frozen=True, kw_only=True)
class Plot:
    """Hold a plot.

    Attributes
    ----------
    title
        What it shows.
    ticks
        Height and text of each horizontal line.
    lines, areas
        What is drawn over them, and what is filled.
    marks
        Position on the horizontal axis, and text, of each vertical line.
    label
        What the horizontal axis shows.
    """

    title: str
    ticks: list[tuple[float, str]]
    lines: list[Shape] = field(default_factory=list)
    areas: list[Shape] = field(default_factory=list)
    marks: list[tuple[float, str]] = field(default_factory=list)
    label: str


def frame_times(times: Mapping[str, Sequence[float]], marks: Sequence[int]) -> Plot:
    """Plot frame times over the numbers of the frames.

    Parameters
    ----------
    times
        (n,) times of each run by its name, milliseconds, n ≥ 1.
    marks
        Numbers of the frames to mark.

    Returns
    -------
    Plot
        A line for each run.
    """
    top = 1.05 * max(max(column) for column in times.values()) or 1.0
    last = max(len(column) for column in times.values()) - 1
    across = (RIGHT - LEFT) / max(last, 1)
    lines = [
        Shape(points=_points(LEFT + across * np.arange(len(column)), _height(column, top)), colour=colour, name=name)
        for (name, column), colour in zip(times.items(), _colours(len(times)), strict=True)
    ]
    return Plot(
        title="Frame time over the path, milliseconds",
        ticks=_ticks(top),
        lines=lines,
        marks=[(round(LEFT + across * mark, 1), str(mark)) for mark in marks],
        label=f"frame 0 to {last}; marked: the pictures below",
    )


def histogram(times: Mapping[str, Sequence[float]]) -> Plot:
    """Plot how many frames of each run take how long, see `frame_times`."""
    longest = 1.02 * max(max(column) for column in times.values()) or 1.0
    counts = {name: np.histogram(column, _BINS, (0, longest))[0] for name, column in times.items()}
    top = 1.05 * max(column.max() for column in counts.values())
    edges = LEFT + (RIGHT - LEFT) * np.repeat(np.arange(_BINS + 1), 2)[1:-1] / _BINS
    lines = [
        Shape(points=_points(edges, _height(np.repeat(column, 2), top)), colour=colour, name=name)
        for (name, column), colour in zip(counts.items(), _colours(len(counts)), strict=True)
    ]
    return Plot(
        title="Number of frames, by frame time",
        ticks=_ticks(top),
        lines=lines,
        label=f"0 to {_number(longest)} milliseconds, in {_BINS} classes",
    )


def pass_stack(title: str, passes: Mapping[int, Mapping[str, float]]) -> Plot:
    """Plot the stacked times of the passes over the numbers of the frames in which they were timed.

    Parameters
    ----------
    title
        The title.
    passes
        Milliseconds of each pass by its name, by the number of the frame. At least one frame.

    Returns
    -------
    Plot
        An area for each of the passes that take longest, and one for the rest.
    """
    names = dict.fromkeys(name for row in passes.values() for name in row)
    columns = {name: np.array([row.get(name, 0.0) for row in passes.values()]) for name in names}
    order = sorted(columns, key=lambda name: -columns[name].sum())
    parts = {name: columns[name] for name in order[:_NAMED]}
    if order[_NAMED:]:
        parts["others"] = np.sum([columns[name] for name in order[_NAMED:]], axis=0)
    return _stack(title, list(passes), parts)


def share_stack(title: str, shares: Mapping[str, NDArray[np.float64]]) -> Plot:
    """Plot the part of the objects' pixels that each kind drew.

    Parameters
    ----------
    title
        The title.
    shares
        (n,) the part of the pixels of each frame, 0 to 1, by kind.

    Returns
    -------
    Plot
        An area for each kind that draws anything.
    """
    parts = {kind: column for kind, column in shares.items() if column.any()}
    frames = len(next(iter(shares.values())))
    return _stack(title, range(frames), parts or dict(shares), top=1.0)


def curves(title: str, shown: Curves) -> Plot:
    """Plot curves with both axes logarithmic and the powers of ten marked.

    Parameters
    ----------
    title
        The title.
    shown
        The curves; at least two values of `x`.

    Returns
    -------
    Plot
        A line for each column, through its measured values.
    """
    along, columns = np.log10(shown.x), {name: _logarithms(column) for name, column in shown.columns.items()}
    known = np.concatenate([column[np.isfinite(column)] for column in columns.values()])
    low, high = np.floor(known.min(initial=0)), np.ceil(known.max(initial=0))
    high = max(high, low + 1)
    first, last = along.min(), along.max()

    def across(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(LEFT + (RIGHT - LEFT) * (x - first) / (last - first))

    lines = [
        Shape(
            points=_points(across(along[np.isfinite(column)]), _height(column[np.isfinite(column)] - low, high - low)),
            colour=colour,
            name=name,
        )
        for (name, column), colour in zip(columns.items(), _colours(len(columns)), strict=True)
    ]
    powers = np.arange(low, high + 1)
    decades = np.arange(np.ceil(first), np.floor(last) + 1)
    return Plot(
        title=title,
        ticks=[
            (round(float(y), 1), _number(10**p)) for y, p in zip(_height(powers - low, high - low), powers, strict=True)
        ],
        lines=lines,
        marks=[(round(float(x), 1), _number(10**p)) for x, p in zip(across(decades), decades, strict=True)],
        label=shown.label,
    )


def _logarithms(column: Sequence[float | None]) -> NDArray[np.float64]:
    """Return the decimal logarithms of a column, NaN for unmeasured values."""
    return np.log10([np.nan if value is None else value for value in column])


def _stack(
    title: str, frames: Sequence[int], parts: Mapping[str, NDArray[np.float64]], top: float | None = None
) -> Plot:
    """Return a plot of (n,) `parts`, stacked, over the numbers of n frames."""
    numbers = np.array([*frames, frames[-1] + 1] if len(frames) == 1 else frames, np.float64)
    heights = np.array([np.resize(column, len(numbers)) for column in parts.values()])
    above = np.cumsum(heights, axis=0)
    below = above - heights
    top = top or 1.05 * float(above[-1].max()) or 1.0
    x = LEFT + (RIGHT - LEFT) * (numbers - numbers[0]) / (numbers[-1] - numbers[0])
    areas = [
        Shape(
            points=f"{_points(x, _height(high, top))} {_points(x[::-1], _height(low[::-1], top))}",
            colour=colour,
            name=name,
        )
        for name, low, high, colour in zip(parts, below, above, _colours(len(parts)), strict=True)
    ]
    return Plot(title=title, ticks=_ticks(top), areas=areas, label=f"frame {frames[0]} to {frames[-1]}")


def _colours(count: int) -> list[str]:
    return [COLOURS[k % len(COLOURS)] for k in range(count)]


def _height(values: Sequence[float] | NDArray[np.generic], top: float) -> NDArray[np.float64]:
    """Return the positions of values from 0 to `top` on the vertical axis."""
    return BOTTOM - (BOTTOM - TOP) * np.asarray(values, np.float64) / top


def _points(x: NDArray[np.floating], y: NDArray[np.floating]) -> str:
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))


def _ticks(top: float) -> list[tuple[float, str]]:
    """Return height and text of each horizontal line, from 0 to `top`."""
    values = np.linspace(0, top, _TICKS).tolist()
    return [(round(float(_height([value], top)[0]), 1), _number(value)) for value in values]


def _number(value: float) -> str:
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"
