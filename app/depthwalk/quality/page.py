"""A comparison as one HTML page with pictures of the worst views, which needs nothing else; what a page consists of."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from depthwalk.pictures import png_bytes
from depthwalk.quality import metrics
from depthwalk.quality.goals import MEASURES, Measure, Summary, summarise
from depthwalk.quality.measure import ViewQuality
from depthwalk.quality.report import (
    CompareReport,
    ModelReport,
    cell,
    costs_line,
    direction,
    headline,
    mark,
    overall,
    overview,
)
from depthwalk.quality.twin import Pair
from depthwalk.quality.views import Viewpoint

_MARGIN = 12  # pixels around the object
_NOTHING, _BOTH, _EDGE, _HOLE, _EXTRA = (255, 255, 255), (208, 208, 208), (255, 176, 64), (214, 20, 20), (40, 90, 220)
_MISSED = ' class="missed"'


@dataclass(frozen=True)
class WorstView:
    """A view to show. titles: the measures that are worst in it; panels: caption → PNG."""

    view: ViewQuality
    titles: tuple[str, ...]
    panels: dict[str, bytes]


def worst_viewpoints(views: Sequence[ViewQuality]) -> dict[Viewpoint, tuple[str, ...]]:
    """The views in which some measure is worst, each once, with the titles of these measures."""
    found: dict[Viewpoint, tuple[str, ...]] = {}
    for measure in MEASURES:
        worst = summarise(measure, views).worst_view
        if worst is not None:
            found[worst] = (*found.get(worst, ()), measure.title)
    return found


def panels(pair: Pair) -> dict[str, bytes]:
    """The pictures of one view as PNGs, cut to the object: mesh, depth images, FLIP error, silhouettes and holes."""
    union = pair.mesh.covered | pair.dpci.covered
    near = metrics.bounding_window(union, metrics.FLIP_REACH)
    window = metrics.bounding_window(union[near], _MARGIN)
    mesh, dpci = pair.mesh.pixels[near], pair.dpci.pixels[near]
    pictures = {
        "mesh": mesh,
        "depth images": dpci,
        "difference (FLIP, dark is equal)": metrics.flip_colours(mesh, dpci),
        "holes red, edges lacking orange, too much blue": _coverage(pair.mesh.covered[near], pair.dpci.covered[near]),
    }
    return {caption: png_bytes(picture[window]) for caption, picture in pictures.items()}


def to_html(report: CompareReport, worst: Sequence[Sequence[WorstView]]) -> str:
    """The page; worst: the views to show, for each model of the report."""
    body = []
    if len(report.models) > 1:
        rows = [(measure, *overall(measure, report.models)) for measure in MEASURES]
        body.append(
            f"<h2>Overall</h2>{_table([(m, summary, (escape(name),)) for m, summary, name in rows], ('model',))}"
        )
        body.append(plain_table(overview(report.models)))
    for model, views in zip(report.models, worst, strict=True):
        body += [_section(model), *(_figure(view) for view in views)]
    return page("depthwalk compare", headline(report), "".join(body))


def page(title: str, line: str, body: str) -> str:
    """A whole page: title and a line below it, then `body`, HTML."""
    head = f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
    top = f"<style>{_STYLE}</style></head><body>\n<h1>{escape(title)}</h1><p>{escape(line)}</p>"
    return f"{head}{top}{body}</body></html>\n"


def plain_table(rows: Sequence[tuple[str, ...]]) -> str:
    """Rows of text, the first of them titles; what misses its goal stands out."""
    titles, *others = rows
    head = "".join(f"<th>{escape(title)}</th>" for title in titles)
    body = "".join(f"<tr>{''.join(_plain_cell(text) for text in row)}</tr>" for row in others)
    return f"<table><tr>{head}</tr>{body}</table>"


def figure(caption: str, panels: Mapping[str, bytes]) -> str:
    """Pictures side by side, PNG files by their captions."""
    pictures = "".join(
        f'<div><img src="data:image/png;base64,{b64encode(png).decode()}" alt="{escape(name)}"><br>{escape(name)}</div>'
        for name, png in panels.items()
    )
    return f'<figure><figcaption>{escape(caption)}</figcaption><div class="row">{pictures}</div></figure>'


def _section(model: ModelReport) -> str:
    close = [summarise(measure, model.close) for measure in MEASURES]
    rows = [
        (measure, summarise(measure, model.views), (cell(measure, near.mean), cell(measure, near.worst)))
        for measure, near in zip(MEASURES, close, strict=True)
    ]
    notes = [f"A poor candidate: {warning}" for warning in model.warnings]
    if model.recommendation is not None:
        notes.append(model.recommendation.text())
    return (
        f"<h2>{escape(model.name)}</h2><p>{escape(costs_line(model))}</p>"
        f"{_table(rows, ('close: mean', 'close: worst'))}{''.join(f'<p>{escape(note)}</p>' for note in notes)}"
    )


def _table(rows: Sequence[tuple[Measure, Summary, tuple[str, ...]]], more: tuple[str, ...]) -> str:
    head = "".join(f"<th>{title}</th>" for title in ("", "mean", "worst", "at", *more))
    body = ""
    for measure, summary, extra in rows:
        values = _goal_cell(measure, summary.mean, measure.goal_mean)
        values += _goal_cell(measure, summary.worst, measure.goal_worst)
        rest = "".join(f"<td>{text}</td>" for text in (direction(summary.worst_view), *extra))
        body += f"<tr><td>{escape(measure.title)}</td>{values}{rest}</tr>"
    return f"<table><tr>{head}</tr>{body}</table>"


def _plain_cell(text: str) -> str:
    return f"<td{_MISSED if text.endswith(mark(False)) else ''}>{escape(text)}</td>"


def _goal_cell(measure: Measure, value: float, goal: float | None) -> str:
    return _plain_cell(cell(measure, value, goal))


def _figure(worst: WorstView) -> str:
    values = "; ".join(f"{m.title}: {cell(m, getattr(worst.view, m.key))}" for m in MEASURES)
    caption = f"{direction(worst.view.viewpoint)}: worst in {'; '.join(worst.titles)}. {values}."
    return figure(caption, worst.panels)


def _coverage(reference: NDArray[np.bool_], test: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Where both, neither or one of the silhouettes is, and the pixels that count as holes."""
    picture = np.empty((*reference.shape, 3), np.uint8)
    picture[...] = _NOTHING
    picture[reference & test] = _BOTH
    picture[reference & ~test] = _EDGE
    picture[~reference & test] = _EXTRA
    picture[metrics.hole_map(reference, test)] = _HOLE
    return picture


_STYLE = """
body { font: 15px system-ui, sans-serif; max-width: 1400px; margin: 2em auto; padding: 0 1em; color: #222; }
table { border-collapse: collapse; }
th, td { padding: .2em .9em; text-align: right; border-bottom: 1px solid #ddd; }
td:first-child { text-align: left; }
.missed { color: #b00020; font-weight: 600; }
figure { margin: 1.5em 0; } .row { display: flex; gap: 8px; } .row div { flex: 1; font-size: 12px; color: #555; }
img { width: 100%; }
"""
