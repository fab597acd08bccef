"""Compare a benchmark with an earlier one of the same frames, to notice when a scene becomes slower.

Two runs differ by chance. A change counts if the bounds of `bench.ratio`, which reflect the scatter of single frames,
lie wholly beyond a tolerance, which stands for how much the machine's speed varies from run to run.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from depthwalk.bench.measure import Report, Run
from depthwalk.bench.ratio import Ratio, paired_ratio
from depthwalk.errors import InputError, missing_file

_MAX_BYTES = 1 << 26  # of a report: a million frames of a few representations


@dataclass(frozen=True, kw_only=True)
class Change:
    """Describe how the frames of one representation changed.

    Attributes
    ----------
    representation
        The representation.
    ratio
        Present times over earlier times.
    verdict
        "slower", "faster", or "same" if the change is within the noise.
    passes_ms
        Medians of the passes that changed most, before and now, milliseconds, by name.
    """

    representation: str
    ratio: Ratio
    verdict: str
    passes_ms: dict[str, tuple[float, float]]


def read_report(file: Path) -> Report:
    """Read a report written by `bench --json`.

    Raises
    ------
    InputError
        If the file is missing, too large, or not such a report.
    """
    if not file.is_file():
        raise missing_file(file)
    if (size := file.stat().st_size) > _MAX_BYTES:
        raise InputError(f"{file}: too large: {size} bytes, the limit is {_MAX_BYTES}")
    try:
        report: Report = TypeAdapter(Report).validate_json(file.read_bytes())
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise InputError(
            f"{file}: not a report of bench --json: {place + ': ' if place else ''}{first['msg']}"
        ) from None
    for run in report.runs:
        if len(run.frame_times) != run.frames or min(run.frame_times, default=0) <= 0:
            raise InputError(f"{file}: {run.representation}: frame_times must hold {run.frames} times above 0")
    return report


def check_comparable(
    file: Path,
    before: Report,
    *,
    scene: Path,
    path: Path | None,
    resolution: tuple[int, int],
    frames: int,
    representations: Sequence[str],
) -> None:
    """Check that a report is about the frames that are going to be measured.

    Parameters
    ----------
    file
        The file of the report, for the message.
    before
        The report.
    scene, path
        The files of scene and camera path; folders are ignored, since they differ between machines.
    resolution
        (width, height) of the pictures, pixels.
    frames
        Number of frames of each representation.
    representations
        The representations to be measured; at least one must be in the report.

    Raises
    ------
    InputError
        If any of these differs.
    """
    facts = (
        ("scene", Path(before.scene).name, scene.name),
        ("path", before.path and Path(before.path).name, path and path.name),
        ("resolution", "{} × {}".format(*before.resolution), "{} × {}".format(*resolution)),
    )
    for name, old, new in facts:
        if old != new:
            raise InputError(f"{file}: was measured with another {name}, {old or 'none'} instead of {new or 'none'}")
    runs = [run for run in before.runs if run.representation in representations]
    if not runs:
        raise InputError(f"{file}: has none of the representations {', '.join(representations)}")
    for run in runs:
        if run.frames != frames:
            raise InputError(f"{file}: {run.representation}: has {run.frames} frames instead of {frames}")


def changes(before: Report, now: Report, tolerance: float) -> list[Change]:
    """Return how each representation that is in two comparable reports changed.

    Parameters
    ----------
    before, now
        The reports, see `check_comparable`.
    tolerance
        Relative difference by which two runs may differ by chance, such as 0.05.

    Returns
    -------
    list[Change]
        The changes.
    """
    found = []
    for old, new in _pairs(before, now):
        ratio = paired_ratio(new.frame_times, old.frame_times)
        verdict = "slower" if ratio.low > 1 + tolerance else "faster" if ratio.high < 1 / (1 + tolerance) else "same"
        found.append(
            Change(representation=new.representation, ratio=ratio, verdict=verdict, passes_ms=_moved(old, new))
        )
    return found


def change_lines(file: Path, before: Report, now: Report, found: list[Change]) -> list[str]:
    """Return lines of text about the changes since the report in `file`."""
    lines = [f"compared with {file}, {before.date}, commit {before.commit or 'unknown'}"]
    for name in ("machine", "renderer", "driver"):
        old, new = getattr(before, name), getattr(now, name)
        if old != new:
            lines.append(f"  warning: measured with another {name}: {old}, now {new}")
    for change in found:
        verdict = {"same": "the same, within the noise"}.get(change.verdict, change.verdict)
        lines.append(f"  {change.representation}: {verdict}: frames take {change.ratio} as long as before")
        if change.verdict != "same":
            moved = (f"{name} {old:.2f} → {new:.2f} ms" for name, (old, new) in change.passes_ms.items())
            lines.append(f"    {', '.join(moved)}")
    return lines


def _pairs(before: Report, now: Report) -> Iterator[tuple[Run, Run]]:
    """Yield the runs of each representation that both reports have."""
    old = {run.representation: run for run in before.runs}
    return ((old[run.representation], run) for run in now.runs if run.representation in old)


def _moved(old: Run, new: Run, most: int = 3) -> dict[str, tuple[float, float]]:
    """Return the medians, before and now, of the passes whose medians differ most."""
    names = dict.fromkeys((*old.passes_ms, *new.passes_ms))
    medians = {
        name: tuple(run.passes_ms[name].p50 if name in run.passes_ms else 0.0 for run in (old, new)) for name in names
    }
    largest = sorted(medians, key=lambda name: -abs(medians[name][1] - medians[name][0]))[:most]
    return {name: (medians[name][0], medians[name][1]) for name in largest}
