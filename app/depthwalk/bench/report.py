"""Show a benchmark as JSON, as a table of text and as one HTML page that needs no other file."""

import json
from dataclasses import asdict, dataclass
from itertools import cycle
from pathlib import Path

import numpy as np

from depthwalk.bench.measure import Report, Run, Spread
from depthwalk.quality.html import Section, render_page

_COLUMNS = ("p50", "p95", "p99", "max", "mean")
_COLOURS = ("#0b6bcb", "#c4500a", "#1a7f4b", "#8a3ffc")
_LEFT, _RIGHT, _TOP, _BOTTOM = 56, 852, 8, 240  # of the plot, CSS pixels
_TICKS = 5  # of its vertical axis
_TEMPLATE = Path(__file__).with_name("templates") / "bench.html"


@dataclass(frozen=True, kw_only=True)
class _Plot:
    """Frame times over frame numbers, in the coordinates of an SVG picture.

    Attributes
    ----------
    left, right, bottom
        Of the axes.
    ticks
        Height and text of each horizontal line.
    lines
        Points and colour of each run's curve, as SVG and CSS have them.
    label
        What the axes show.
    """

    left: int = _LEFT
    right: int = _RIGHT
    bottom: int = _BOTTOM
    ticks: list[tuple[float, str]]
    lines: list[tuple[str, str]]
    label: str


def to_json(report: Report) -> str:
    """Return `report` as JSON text, in the format of docs/bench.md."""
    document = asdict(report)
    for run in document["runs"]:
        del run["frame_times"]
    return json.dumps(document, indent=2) + "\n"


def to_text(report: Report) -> str:
    """Return `report` as text: a table for each representation, with a row for the frame and one for each pass."""
    lines = _headline(report)
    for run in report.runs:
        (_, *titles), *rows = _table(run)
        lines += ["", _title(run).ljust(24) + _columns(titles)]
        lines += [f"  {name}".ljust(24) + _columns(times) for name, *times in rows]
        lines.append(f"  {_counts(run)}")
    return "\n".join(lines)


def to_html(report: Report) -> str:
    """Return `report` as the text of an HTML page: a plot of the frame times, and a table for each representation."""
    sections = [
        Section(title=_title(run), tables=[_table(run)], notes=[_counts(run)], colour=colour)
        for run, colour in zip(report.runs, cycle(_COLOURS), strict=False)
    ]
    title = f"depthwalk bench: {report.scene}"
    return render_page(title, _headline(report), sections, _TEMPLATE, plot=_plot(report))


def _headline(report: Report) -> list[str]:
    width, height = report.resolution
    return [
        f"{report.scene}, {report.path or 'still camera'}, {width} × {height}",
        f"depthwalk {report.version} ({report.commit or 'installed'}), {report.renderer}",
        f"milliseconds; passes timed by {'timer queries' if report.timer == 'gpu' else 'finish and the clock'}",
    ]


def _title(run: Run) -> str:
    return f"{run.representation}, {run.frames} frames"


def _table(run: Run) -> list[list[str]]:
    """Return titles, then a row for the whole frame and one for each pass."""
    rows: dict[str, Spread] = {"frame": run.frame_ms, **run.passes_ms}
    cells = [[name, *(f"{getattr(times, column):.2f}" for column in _COLUMNS)] for name, times in rows.items()]
    return [["", *_COLUMNS], *cells]


def _columns(cells: list[str]) -> str:
    return "".join(cell.rjust(10) for cell in cells)


def _counts(run: Run) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in run.counts.items())


def _plot(report: Report) -> _Plot:
    longest = 1.05 * max(run.frame_ms.max for run in report.runs) or 1.0  # milliseconds at the top
    frames = max(run.frames for run in report.runs)
    height, spacing = _BOTTOM - _TOP, (_RIGHT - _LEFT) / max(frames - 1, 1)
    lines = []
    for run, colour in zip(report.runs, cycle(_COLOURS), strict=False):
        x, y = _LEFT + spacing * np.arange(len(run.frame_times)), _BOTTOM - height * np.array(run.frame_times) / longest
        lines.append((" ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True)), colour))
    return _Plot(
        ticks=[
            (round(_BOTTOM - height * part, 1), f"{longest * part:.3g}") for part in np.linspace(0, 1, _TICKS).tolist()
        ],
        lines=lines,
        label=f"frame 0 to {frames - 1}; milliseconds",
    )
