"""Show a benchmark as JSON, as text tables, and as CSV with a row for each frame."""

import csv
import io
import json
from collections.abc import Iterator
from dataclasses import asdict

from depthwalk.bench.measure import Report, Run, Spread
from depthwalk.bench.ratio import paired_ratio
from depthwalk.bench.slow_frames import SlowFrame
from depthwalk.errors import counted
from depthwalk.scene.arrays import CAPTURED, HEIGHT_FIELDS, MESHES

_COLUMNS = ("p50", "p95", "p99", "max", "mean")

# Names of the counts of objects that are drawn in some representations, by these; others have counts of their own.
_COUNTED_AS = {
    kind.label: name
    for name, kinds in {"mesh": MESHES, "height_fields": HEIGHT_FIELDS, "captured": CAPTURED}.items()
    for kind in kinds
}


def to_json(report: Report) -> str:
    """Return `report` as JSON text, in the format of docs/bench.md."""
    document = asdict(report)
    for run in document["runs"]:
        del run["trace"]
    return json.dumps(document, indent=2) + "\n"


def to_csv(report: Report) -> str:
    """Return the records of each frame as CSV text: a row for each representation and frame, with a header.

    Columns that only some representations have are empty in the rows of the others.
    """
    names = dict.fromkeys(name for run in report.runs if run.trace for name in run.trace.work)
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["representation", "frame", "frame_ms", *names])
    for run in report.runs:
        work = run.trace.work if run.trace else {}
        for number, spent in enumerate(run.frame_times):
            cells = (f"{work[name][number]:.6g}" if name in work else "" for name in names)
            table.writerow([run.representation, number, spent, *cells])
    return text.getvalue()


def to_text(report: Report) -> str:
    """Return `report` as text: a table for each representation, with a row for the frame and one for each pass."""
    lines = headline(report)
    for run in report.runs:
        (_, *titles), *rows = table(run)
        lines += ["", title(run).ljust(24) + _columns(titles)]
        lines += [f"  {name}".ljust(24) + _columns(times) for name, *times in rows]
        lines += [f"  {line}" for line in notes(run, report.timer)]
    compared = speed_ups(report)
    return "\n".join([*lines, *(["", *compared] if compared else [])])


def headline(report: Report) -> list[str]:
    """Return lines that state what was measured, when, with which version and on what machine."""
    width, height = report.resolution
    machine = report.machine
    lines = [
        f"{report.scene}, {report.path or 'still camera'}, {width} × {height}, {report.date}",
        f"depthwalk {report.version} ({report.commit or 'installed'}), Python {machine.python}, {machine.system}",
        f"{machine.processor}, {machine.cores} cores; {report.renderer}, {report.driver}",
        "milliseconds; passes timed by "
        + ("timer queries" if report.timer == "gpu" else "waiting for the GPU after each"),
    ]
    if report.stride is not None and report.stride > 1.01:
        lines.append(
            f"the camera jumps: it moves {report.stride:.3g} frames of the path at a time, so that fewer impostors "
            "are reused than on a walk; leave out --frames to measure every frame of the path"
        )
    return lines


def title(run: Run) -> str:
    """Return the title of a run."""
    return f"{run.representation}, {run.frames} frames"


def table(run: Run) -> list[list[str]]:
    """Return titles, then a row for the whole frame and one for each pass."""
    rows: dict[str, Spread] = {"frame": run.frame_ms, **run.passes_ms}
    cells = [[name, *(f"{getattr(times, column):.2f}" for column in _COLUMNS)] for name, times in rows.items()]
    return [["", *_COLUMNS], *cells]


def notes(run: Run, timer: str) -> list[str]:
    """Return the lines below a run's table.

    They say what the rows of the passes cover, its counts that are not 0, and a line for each of its slowest frames.
    `timer`: see `Report.timer`.
    """
    lines = [*_covered(run, timer), ", ".join(f"{name} {value:g}" for name, value in run.counts.items() if value)]
    if _drew_nothing(run):
        lines.append(f"nothing was drawn as {run.representation}: no visible asset can be drawn so")
    return lines + [_slow_line(slow, run.frame_ms.p50) for slow in run.slowest]


def _covered(run: Run, timer: str) -> list[str]:
    """Return a line that says why the rows of the passes do not add up to that of the frame."""
    if run.trace is None or not run.trace.passes:
        return []
    passes = sum(times.mean for times in run.passes_ms.values())
    if timer == "gpu":
        return [
            f"cull, plan, upload and occlusion are CPU time, the other rows GPU time, {passes:.2f} ms in all; CPU and "
            "GPU work side by side, and what happens between passes is in 'frame' only"
        ]
    timed = run.trace.passes
    whole = sum(run.frame_times[number] for number in timed) / len(timed)
    rest = run.frames - len(timed)
    return [
        f"passes: {passes:.2f} of the {whole:.2f} ms of {counted(len(timed), 'frame')} that waited after each pass; "
        "the other time is between them" + (f". 'frame': the other {counted(rest, 'frame')}" if rest else "")
    ]


def _drew_nothing(run: Run) -> bool:
    """Return whether no object was drawn in the requested representation, since no asset that was seen has it."""
    return run.counts.get(_COUNTED_AS.get(run.representation, run.representation)) == 0


def _slow_line(slow: SlowFrame, median: float) -> str:
    causes = ", ".join(f"{cause.what} {cause.ms:.1f}" for cause in slow.causes) or "many small causes"
    return f"frame {slow.frame}: {slow.ms:.1f} ms, {slow.ms - median:.1f} above the median: {causes}"


def speed_ups(report: Report) -> list[str]:
    """Return a line for each pair of runs that states how many times as fast the quicker one is, frame by frame.

    Runs in which nothing was drawn as requested say nothing about their representation, and are skipped.
    """
    return [_speed_up(*pair) for pair in _pairs(tuple(run for run in report.runs if not _drew_nothing(run)))]


def _speed_up(one: Run, other: Run) -> str:
    ratio = paired_ratio(other.frame_times, one.frame_times)
    if ratio.median < 1:
        one, other, ratio = other, one, paired_ratio(one.frame_times, other.frame_times)
    unsure = ", which is within the noise" if ratio.low <= 1 else ""
    return f"{one.representation} is {ratio} as fast as {other.representation}{unsure}"


def _pairs(runs: tuple[Run, ...]) -> Iterator[tuple[Run, Run]]:
    return ((runs[a], runs[b]) for a in range(len(runs)) for b in range(a + 1, len(runs)))


def _columns(cells: list[str]) -> str:
    return "".join(cell.rjust(10) for cell in cells)
