"""A benchmark as JSON, as a table of text and as one HTML page that needs nothing else."""

import json
from collections.abc import Iterator
from dataclasses import asdict
from html import escape

from depthwalk.bench.measure import Report, Run, Spread

_COLUMNS = ("p50", "p95", "p99", "max", "mean")
_COLOURS = ("#0b6bcb", "#c4500a", "#1a7f4b", "#8a3ffc")
_WIDTH, _HEIGHT, _LEFT, _BOTTOM = 860, 260, 56, 28  # of the plot and its margins, CSS pixels


def to_json(report: Report) -> str:
    """The report as the public contract lays it down."""
    document = asdict(report)
    for run in document["runs"]:
        del run["frame_times"]
    return json.dumps(document, indent=2) + "\n"


def to_text(report: Report) -> str:
    """The report as a table for reading."""
    lines = list(_headline(report))
    for run in report.runs:
        lines += ["", f"{run.representation}, {run.frames} frames".ljust(24) + _row(_COLUMNS)]
        lines += [f"  {name}".ljust(24) + _row(_cells(times)) for name, times in _rows(run)]
        lines.append("  " + ", ".join(f"{name} {value:g}" for name, value in run.counts.items()))
    return "\n".join(lines)


def to_html(report: Report) -> str:
    """The report as a page: a plot of the frame times, a table per representation."""
    sections = "".join(_section(run, colour) for run, colour in zip(report.runs, _cycle(report), strict=True))
    headline = "<br>".join(escape(line) for line in _headline(report))
    return _PAGE.format(title=escape(f"depthwalk bench: {report.scene}"), headline=headline, plot=_plot(report)) + (
        f"{sections}</body></html>\n"
    )


def _headline(report: Report) -> Iterator[str]:
    width, height = report.resolution
    yield f"{report.scene}, {report.path or 'still camera'}, {width} × {height}"
    yield f"depthwalk {report.version} ({report.commit or 'installed'}), {report.renderer}"
    yield f"milliseconds; passes timed by {'timer queries' if report.timer == 'gpu' else 'finish and the clock'}"


def _rows(run: Run) -> Iterator[tuple[str, Spread]]:
    yield "frame", run.frame_ms
    yield from run.passes_ms.items()


def _cells(times: Spread) -> tuple[str, ...]:
    return tuple(f"{getattr(times, name):.2f}" for name in _COLUMNS)


def _row(cells: tuple[str, ...]) -> str:
    return "".join(cell.rjust(10) for cell in cells)


def _cycle(report: Report) -> list[str]:
    return [_COLOURS[k % len(_COLOURS)] for k in range(len(report.runs))]


def _section(run: Run, colour: str) -> str:
    head = "".join(f"<th>{name}</th>" for name in _COLUMNS)
    body = "".join(
        f"<tr><td>{escape(name)}</td>{''.join(f'<td>{cell}</td>' for cell in _cells(times))}</tr>"
        for name, times in _rows(run)
    )
    counts = ", ".join(f"{escape(name)} {value:g}" for name, value in run.counts.items())
    return (
        f'<h2 style="color:{colour}">{escape(run.representation)}, {run.frames} frames</h2>'
        f"<table><tr><th></th>{head}</tr>{body}</table><p>{counts}</p>"
    )


def _plot(report: Report) -> str:
    """Time over frame number, an SVG line per representation."""
    top = 1.05 * max(run.frame_ms.max for run in report.runs) or 1.0
    frames = max(run.frames for run in report.runs)
    height = _HEIGHT - _BOTTOM
    across = (_WIDTH - _LEFT - 8) / max(frames - 1, 1)
    marks = []
    for k in range(5):
        y = height * (1 - k / 4) + 8
        marks.append(f'<path d="M{_LEFT} {y:.1f}H{_WIDTH - 8}" class="grid"/>')
        marks.append(f'<text x="{_LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{top * k / 4:.3g}</text>')
    for run, colour in zip(report.runs, _cycle(report), strict=True):
        points = " ".join(
            f"{_LEFT + i * across:.1f},{height * (1 - value / top) + 8:.1f}" for i, value in enumerate(run.frame_times)
        )
        marks.append(f'<polyline points="{points}" fill="none" stroke="{colour}"/>')
    label = f'<text x="{_WIDTH - 8}" y="{_HEIGHT + 6}" text-anchor="end">frame 0 to {frames - 1}; milliseconds</text>'
    return f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT + 12}" role="img">{"".join(marks)}{label}</svg>'


_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>
body {{ font: 15px system-ui, sans-serif; max-width: 900px; margin: 2em auto; padding: 0 1em; color: #222; }}
table {{ border-collapse: collapse; }}
th, td {{ padding: .2em .9em; text-align: right; border-bottom: 1px solid #ddd; }}
td:first-child {{ text-align: left; }}
svg {{ width: 100%; }} svg text {{ font-size: 11px; fill: #555; }} .grid {{ stroke: #ddd; }}
</style></head><body><h1>{title}</h1><p>{headline}</p>{plot}
"""
