"""Write the reports of `depthwalk bench`; with several scenes, each has its own files."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from depthwalk.bench.baseline import change_lines, changes
from depthwalk.bench.measure import Report
from depthwalk.bench.page import to_html
from depthwalk.bench.report import to_csv, to_json, to_text
from depthwalk.commands.reports import write_report
from depthwalk.errors import InputError

_SCENE = "{scene}"  # in the name of a report: the name of the scene file without its suffix
_OPTIONS = {"json": "--json", "html": "--html", "table": "--csv", "baseline": "--baseline"}


@dataclass(frozen=True, kw_only=True)
class ReportFiles:
    """Name the files of a report; None for those that were not requested.

    Attributes
    ----------
    json, html, table
        Files to write: the report as JSON and as a page, and a CSV file with a row for each frame.
    baseline
        An earlier report, as JSON, to compare with.
    """

    json: Path | None = None
    html: Path | None = None
    table: Path | None = None
    baseline: Path | None = None


def report_files(scenes: Sequence[Path], files: ReportFiles) -> list[ReportFiles]:
    """Return the files of each scene's report.

    Parameters
    ----------
    scenes
        The scene files.
    files
        The files as the options name them; `{scene}` stands for a scene's name.

    Returns
    -------
    list[ReportFiles]
        The files of each scene.

    Raises
    ------
    InputError
        If scenes would share a file.
    """
    given = {member.name: file for member in fields(files) if (file := getattr(files, member.name)) is not None}
    if len(scenes) > 1 and given:
        for name, file in given.items():
            if _SCENE not in str(file):
                raise InputError(f"{_OPTIONS[name]} {file}: with several scenes, put {_SCENE} into the name")
        stems: dict[str, Path] = {}
        for scene in scenes:
            if scene.stem in stems:
                raise InputError(f"{scene}: its reports would overwrite those of {stems[scene.stem]}")
            stems[scene.stem] = scene
    return [
        ReportFiles(**{name: Path(str(file).replace(_SCENE, scene.stem)) for name, file in given.items()})
        for scene in scenes
    ]


def write_reports(report: Report, files: ReportFiles, before: Report | None, tolerance: float) -> bool:
    """Write the report on a scene to its files, and print it.

    Parameters
    ----------
    report
        The measurements.
    files
        The files to write.
    before
        The report in `files.baseline`, see `check_comparable`; None if there is none.
    tolerance
        Relative difference in time that is attributed to chance.

    Returns
    -------
    bool
        Whether frames became slower.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    found = changes(before, report, tolerance) if before else []
    changed = change_lines(files.baseline, before, report, found) if files.baseline and before else []
    write_report(files.json, to_json(report))
    write_report(files.html, to_html(report, changed) if files.html else "")
    write_report(files.table, to_csv(report))
    print("\n".join([to_text(report), *(["", *changed] if changed else [])]))
    return any(change.verdict == "slower" for change in found)
