"""Lay out a report as one self-contained HTML page: sections with tables and pictures.

The markup is in `templates/`. Values are escaped as they are inserted, so callers pass plain text.
"""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from depthwalk.quality.report import mark

Table = Sequence[Sequence[str]]
"""Rows of cells; the first row holds the titles of the columns."""

_TEMPLATES = Path(__file__).with_name("templates")


@dataclass(frozen=True)
class Figure:
    """Hold pictures that are shown side by side, with one caption.

    Attributes
    ----------
    caption
        The common caption of the pictures.
    pictures
        Contents of PNG files, by the names shown below them.
    """

    caption: str
    pictures: Mapping[str, bytes]


@dataclass(frozen=True, kw_only=True)
class Section:
    """Hold a part of a page, from top to bottom: title, lines, tables, notes and figures.

    Attributes
    ----------
    title
        The title.
    lines
        Lines below the title.
    tables
        Tables: rows of cells, the titles of the columns first.
    notes
        Lines below the tables.
    figures
        Rows of pictures.
    colour
        Colour of the title, as CSS names it; "" for that of the text.
    """

    title: str
    lines: Sequence[str] = ()
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()
    figures: Sequence[Figure] = ()
    colour: str = ""


def render_page(
    title: str,
    headline: Sequence[str],
    sections: Sequence[Section],
    template: Path = _TEMPLATES / "report.html",
    **values: object,
) -> str:
    """Return a whole HTML page.

    Table cells that end in the mark of a missed goal are highlighted.

    Parameters
    ----------
    title
        The title of the page.
    headline
        Lines below the title.
    sections
        The parts of the page, from top to bottom.
    template
        A file that extends `report.html`.
    **values
        Other values that the template uses.

    Returns
    -------
    str
        The page.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined  # here, since only pages need it

    environment = Environment(
        loader=FileSystemLoader([template.parent, _TEMPLATES]),
        autoescape=True,
        keep_trailing_newline=True,
        lstrip_blocks=True,
        trim_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters["base64"] = lambda data: b64encode(data).decode()
    page = environment.get_template(template.name)
    return page.render(title=title, headline=headline, sections=sections, missed=mark(False), **values)
