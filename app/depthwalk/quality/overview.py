"""Show the results of `depthwalk quality`, as text, as JSON and as a page.

The JSON is described in docs/quality-method.md.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import attrgetter
from typing import Any

from depthwalk.quality.html import Figure, Section, render_page
from depthwalk.quality.report import Circumstances, mark
from depthwalk.quality.rows import Row


@dataclass(frozen=True, kw_only=True)
class Overview(Circumstances):
    """Hold the measurements of `depthwalk quality`.

    Attributes
    ----------
    parts
        The measured values, by the names of the examination's parts, such as "shadows".
    """

    parts: Mapping[str, Sequence[Row]]


def to_text(overview: Overview) -> str:
    """Return `overview` as a table for reading."""
    lines = [_headline(overview)]
    for part, rows in overview.parts.items():
        lines += ["", part]
        wide = max((len(row.name) for row in rows), default=0)
        for subject, group in groupby(rows, attrgetter("subject")):
            lines.append(f"  {subject}")
            for row in group:
                value, goal, details = _cells(row)
                lines.append(f"    {row.name.ljust(wide)}{value.rjust(14)}{goal.rjust(10)}  {details}".rstrip())
    return "\n".join([*lines, "", _verdict(overview)])


def to_json(overview: Overview) -> str:
    """Return `overview` as JSON: what was run, and the measured rows. Values that are not finite become null."""
    document = {
        **overview.json_head(),
        "rows": [_row(part, row) for part, rows in overview.parts.items() for row in rows],
    }
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def to_html(overview: Overview) -> str:
    """Return `overview` as one HTML page with the tables and all pictures."""
    sections = [
        Section(
            title=part,
            tables=[[("", "", "measured", "goal", ""), *((row.subject, row.name, *_cells(row)) for row in rows)]],
            figures=[Figure(f"{row.subject}: {_line(row)}", row.pictures) for row in rows if row.pictures],
        )
        for part, rows in overview.parts.items()
    ]
    return render_page("depthwalk quality", [_headline(overview), _verdict(overview)], sections)


def _headline(overview: Overview) -> str:
    width, height = overview.image_size
    return f"pictures against the truth; {width} × {height} pixels; {overview.program}"


def _verdict(overview: Overview) -> str:
    reached = [row.reached for rows in overview.parts.values() for row in rows if row.goal is not None]
    return f"{sum(map(bool, reached))} of {len(reached)} goals reached"


def _cells(row: Row) -> tuple[str, str, str]:
    """Return the value with its relation to the goal, the goal, and the details."""
    goal = "" if row.goal is None else f"{'≥' if row.more_is_better else '≤'} {row.goal:.{row.digits}f}"
    details = "; ".join(f"{name} {value:.4g}" for name, value in row.details.items())
    return f"{row.measured:.{row.digits}f}{mark(row.reached)}", goal, details


def _line(row: Row) -> str:
    value, goal, details = _cells(row)
    return "; ".join(filter(None, (f"{row.name}: {value}", goal and f"goal {goal}", details)))


def _row(part: str, row: Row) -> dict[str, Any]:
    return {
        "part": part,
        "subject": row.subject,
        "name": row.name,
        "measured": _finite(row.measured),
        "goal": row.goal,
        "more_is_better": row.more_is_better,
        "reached": row.reached,
        "details": {name: _finite(value) for name, value in row.details.items()},
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
