"""Define tables, and show them as text, Markdown and sections of a page."""

from collections.abc import Sequence
from dataclasses import dataclass

from depthwalk.bench.ratio import Ratio
from depthwalk.quality.html import Section

Cell = str | float | Ratio | None
"""A word, a number, a factor with its bounds, or nothing."""


@dataclass(frozen=True, kw_only=True)
class Curves:
    """Hold curves that a page draws beside a table, both axes logarithmic.

    Attributes
    ----------
    label
        What the horizontal axis shows.
    x
        (n,) its values, ascending, above 0.
    columns
        (n,) values by name, above 0; None for unmeasured ones.
    """

    label: str
    x: tuple[float, ...]
    columns: dict[str, tuple[float | None, ...]]


@dataclass(frozen=True, kw_only=True)
class Table:
    """Hold one table.

    Attributes
    ----------
    name
        Its name for `--only`.
    title
        What it compares.
    source
        The paper, and the number of its table.
    columns
        The titles of the columns.
    rows
        A cell for each column.
    notes
        What a reader needs to know to judge the numbers.
    curves
        The same as curves; None if there are none.
    """

    name: str
    title: str
    source: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    notes: tuple[str, ...] = ()
    curves: Curves | None = None


def text_of(cell: Cell) -> str:
    """Return a cell as text."""
    if cell is None:
        return ""
    if isinstance(cell, float):
        return f"{cell:.0f}" if abs(cell) >= 1000 else f"{cell:.3g}"
    return str(cell)


def to_text(table: Table) -> str:
    """Return a table as text with aligned columns."""
    rows = [table.columns, *([text_of(cell) for cell in row] for row in table.rows)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(table.columns))]
    lines = [table.title, table.source, ""]
    for row in rows:
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        lines.append("  ".join(cells).rstrip())
    return "\n".join([*lines, *table.notes])


def to_markdown(table: Table) -> str:
    """Return a table as Markdown, with a heading of the second level."""
    rows = [_line(table.columns), _line(["---"] * len(table.columns))]
    rows += [_line([text_of(cell) for cell in row]) for row in table.rows]
    return "\n".join(
        [f"## {table.title}", "", f"{table.source}.", "", *rows, "", *(f"- {note}" for note in table.notes)]
    )


def to_section(table: Table) -> Section:
    """Return a table as a section of a page."""
    rows = [table.columns, *([text_of(cell) for cell in row] for row in table.rows)]
    return Section(title=table.title, lines=[table.source], tables=[rows], notes=table.notes)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
