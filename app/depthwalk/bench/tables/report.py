"""Show measured tables, with the machine that measured them, as text, Markdown, JSON and a page."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import Self

from depthwalk.bench import plots
from depthwalk.bench.tables import table as one
from depthwalk.gpu.headless_device import headless_device
from depthwalk.provenance import Machine, commit, machine
from depthwalk.quality.html import render_page


@dataclass(frozen=True, kw_only=True)
class Tables:
    """Hold tables, and the circumstances of their measurement.

    Attributes
    ----------
    version, commit
        Version of the package, and commit of the checkout that ran; None if the package is installed.
    date
        Date and time with its zone, ISO 8601.
    machine
        The machine that it ran on.
    renderer, driver
        The GL driver's name for the hardware, and its own version.
    tables
        The tables.
    """

    version: str
    commit: str | None
    date: str
    machine: Machine
    renderer: str
    driver: str
    tables: tuple[one.Table, ...]

    @classmethod
    def now(cls, version: str, tables: Sequence[one.Table]) -> Self:
        """Combine tables that were measured just now with the present version, machine and driver."""
        device = headless_device()
        device.context.release()
        return cls(
            version=version,
            commit=commit(),
            date=datetime.now().astimezone().isoformat(timespec="seconds"),
            machine=machine(),
            renderer=device.renderer,
            driver=device.driver,
            tables=tuple(tables),
        )


def headline(tables: Tables) -> list[str]:
    """Return lines that state when, with which version and on what machine the tables were measured."""
    machine = tables.machine
    return [
        f"{tables.date}, depthwalk {tables.version} ({tables.commit or 'installed'})",
        f"{machine.processor}, {machine.cores} cores, {machine.system}; {tables.renderer}, {tables.driver}",
    ]


def to_text(tables: Tables) -> str:
    """Return the tables as text."""
    return "\n\n".join(["\n".join(headline(tables)), *(one.to_text(table) for table in tables.tables)])


def to_markdown(tables: Tables) -> str:
    """Return the tables as a Markdown page."""
    head = "# Tables of the papers, measured again\n\n" + "  \n".join(headline(tables))
    return "\n\n".join([head, *(one.to_markdown(table) for table in tables.tables)]) + "\n"


def to_json(tables: Tables) -> str:
    """Return the tables as JSON text: the fields of `Tables`, factors as median, low and high."""
    return json.dumps(asdict(tables), indent=2, ensure_ascii=False) + "\n"


def to_html(tables: Tables) -> str:
    """Return the tables as a self-contained HTML page."""
    shown = [plots.curves(table.title, table.curves) for table in tables.tables if table.curves]
    sections = [one.to_section(table) for table in tables.tables]
    return render_page("depthwalk tables", headline(tables), sections, plots.TEMPLATE, plots=shown, axes=plots)
