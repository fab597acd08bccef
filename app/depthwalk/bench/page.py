"""Show a benchmark as one self-contained HTML page: plots, tables and pictures of marked frames."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np

from depthwalk.bench import plots
from depthwalk.bench.measure import Report, Run
from depthwalk.bench.report import headline, notes, speed_ups, table, title
from depthwalk.quality.html import Figure, Section, render_page
from depthwalk.render.pixel_shares import KINDS

PICTURES = 4  # frames whose pictures a page shows


def pictured_frames(frames: int) -> tuple[int, ...]:
    """Return the numbers of up to `PICTURES` of `frames` frames, spread evenly, including the first and the last."""
    return tuple(dict.fromkeys(np.linspace(0, frames - 1, PICTURES).round().astype(int).tolist()))


def to_html(report: Report, changed: Sequence[str] = ()) -> str:
    """Return a benchmark as the text of an HTML page.

    Parameters
    ----------
    report
        The benchmark.
    changed
        Lines about changes since an earlier benchmark.

    Returns
    -------
    str
        The page.
    """
    times = {run.representation: run.frame_times for run in report.runs}
    marks = sorted({mark for run in report.runs if run.trace for mark in run.trace.pictures})
    sections = [
        Section(
            title=title(run),
            tables=[table(run)],
            notes=notes(run, report.timer),
            figures=_figures(run),
            colour=colour,
        )
        for run, colour in zip(report.runs, cycle(plots.COLOURS), strict=False)
    ]
    if in_short := [*speed_ups(report), *changed]:
        sections.insert(0, Section(title="Summary", notes=in_short))
    shown = [plots.frame_times(times, marks), plots.histogram(times)]
    for run in report.runs:
        shown += _stacks(run)
    return render_page(
        f"depthwalk bench: {report.scene}", headline(report), sections, plots.TEMPLATE, plots=shown, axes=plots
    )


def _stacks(run: Run) -> list[plots.Plot]:
    """Return the plots of a run's passes and of the pixels drawn by each kind."""
    if run.trace is None:
        return []
    found = []
    if run.trace.passes:
        found.append(plots.pass_stack(f"{run.representation}: passes, milliseconds", run.trace.passes))
    pixels = np.array(run.trace.pixels, np.float64)
    parts = pixels / np.maximum(pixels.sum(1, keepdims=True), 1)
    shares = dict(zip(KINDS, parts.T, strict=True))
    found.append(plots.share_stack(f"{run.representation}: pixels of objects, by representation", shares))
    return found


def _figures(run: Run) -> list[Figure]:
    """Return the pictures of the marked frames, in one row."""
    if run.trace is None or not run.trace.pictures:
        return []
    pictures = {
        f"frame {number}, {run.frame_times[number]:.1f} ms": picture for number, picture in run.trace.pictures.items()
    }
    return [Figure("Marked frames", pictures)]
