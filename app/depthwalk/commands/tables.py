"""Declare `depthwalk tables`, which reproduces the tables of the papers on this machine."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthwalk.commands.options import HtmlReport, JsonReport, Quiet, Verbose
from depthwalk.commands.program import guarded
from depthwalk.errors import InputError, suggest

if TYPE_CHECKING:
    from depthwalk.assets.mesh_library import Report
    from depthwalk.bench.tables.table import Table

NAMES = ("heads", "planar", "edges", "focus", "triangles", "objects", "pixels")


@guarded
def main(
    only: Annotated[
        list[str] | None, typer.Option(metavar="TABLE,...", help=f"Tables to measure: {', '.join(NAMES)}.")
    ] = None,
    most_triangles: Annotated[
        int,
        typer.Option(
            metavar="N", min=1000, max=20_000_000, help="Greatest number of triangles in the table `triangles`."
        ),
    ] = 1_100_000,
    json: JsonReport = None,
    markdown: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the tables to this file, as Markdown.")
    ] = None,
    html: HtmlReport = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Reproduce the papers' tables on this machine, beside the published figures, with additional curves.

    The scenes are those that ship with the program. All tables together take less than fifteen minutes on two cores.
    """
    names = parse_names(only)
    import depthwalk
    from depthwalk.bench.tables.report import Tables, to_html, to_json, to_markdown, to_text
    from depthwalk.commands.progress import asset_progress
    from depthwalk.commands.reports import check_report_files, write_report

    check_report_files([json, markdown, html], [], "measured")
    measures = _measures(most_triangles)
    with asset_progress() as report:
        tables = Tables.now(depthwalk.__version__, [measures[name](report) for name in names])
    for file, show in ((json, to_json), (markdown, to_markdown), (html, to_html)):
        write_report(file, show(tables) if file else "")
    print(to_text(tables))


def parse_names(texts: list[str] | None) -> list[str]:
    """Return the tables in the options `--only`, without duplicates; all if there is none.

    Raises InputError for a table that does not exist.
    """
    names = [name.strip() for text in texts or NAMES for name in text.split(",")]
    for name in names:
        if name not in NAMES:
            raise InputError(f"--only {name}: must be one of {', '.join(NAMES)}{suggest(name, NAMES)}")
    return list(dict.fromkeys(names))


def _measures(most_triangles: int) -> "dict[str, Callable[[Report], Table]]":
    """Return the function that measures each table."""
    from depthwalk.bench.tables import curves, edges, focus, heads, planar

    return {
        "heads": heads.measured,
        "planar": planar.measured,
        "edges": edges.measured,
        "focus": focus.measured,
        "triangles": partial(curves.over_triangles, most=most_triangles),
        "objects": curves.over_objects,
        "pixels": curves.over_pixels,
    }
