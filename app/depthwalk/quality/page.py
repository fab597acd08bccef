"""Show a comparison as an HTML page: its tables, and pictures of the views in which a measure is worst."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthwalk.pictures import png_bytes
from depthwalk.quality import metrics
from depthwalk.quality.goals import MEASURES, Measure, Summary, summarise
from depthwalk.quality.html import Figure, Section, render_page
from depthwalk.quality.measure import ViewQuality
from depthwalk.quality.pair_renderer import Pair
from depthwalk.quality.report import (
    CompareReport,
    ModelReport,
    cell,
    costs_line,
    direction,
    headline,
    missed_notes,
    overall,
    overview,
)
from depthwalk.quality.views import Viewpoint
from depthwalk.types import Mask, Picture

_MARGIN = 12  # pixels around the object
_NOTHING, _BOTH, _EDGE, _HOLE, _EXTRA = (255, 255, 255), (208, 208, 208), (255, 176, 64), (214, 20, 20), (40, 90, 220)
_TITLES = "", "mean", "worst", "at"


@dataclass(frozen=True)
class WorstView:
    """Hold a view that a page shows because some measure is worst there.

    Attributes
    ----------
    view
        The measures of the view.
    titles
        Titles of the measures that are worst in this view.
    panels
        Contents of PNG files, by their captions.
    """

    view: ViewQuality
    titles: tuple[str, ...]
    panels: dict[str, bytes]


def worst_viewpoints(views: Sequence[ViewQuality]) -> dict[Viewpoint, tuple[str, ...]]:
    """Return the viewpoints of those `views` in which some measure is worst, each with the titles of these measures."""
    found: dict[Viewpoint, tuple[str, ...]] = {}
    for measure in MEASURES:
        worst = summarise(measure, views).worst_view
        if worst is not None:
            found[worst] = (*found.get(worst, ()), measure.title)
    return found


def panels(pair: Pair) -> dict[str, bytes]:
    """Create the four pictures of a view: mesh, depth images, FLIP error, and silhouettes with their holes.

    Parameters
    ----------
    pair
        The pictures of mesh and depth images; at least one pixel must show the object.

    Returns
    -------
    dict[str, bytes]
        Contents of PNG files, cropped to the object, by their captions.
    """
    union = pair.mesh.covered | pair.dpci.covered
    near = metrics.bounding_window(union, metrics.FLIP_REACH)
    window = metrics.bounding_window(union[near], _MARGIN)
    mesh, dpci = pair.mesh.pixels[near], pair.dpci.pixels[near]
    pictures = {
        "mesh": mesh,
        "depth images": dpci,
        "difference (FLIP, dark is equal)": metrics.flip_colours(mesh, dpci),
        "holes red, edges lacking orange, too much blue": _silhouettes(
            pair.mesh.covered[near], pair.dpci.covered[near]
        ),
    }
    return {caption: png_bytes(picture[window]) for caption, picture in pictures.items()}


def to_html(report: CompareReport, worst: Sequence[Sequence[WorstView]]) -> str:
    """Return a comparison as an HTML page.

    Parameters
    ----------
    report
        The comparison.
    worst
        For each model of the report, the views to show.

    Returns
    -------
    str
        The page.
    """
    sections = [_model_section(model, views) for model, views in zip(report.models, worst, strict=True)]
    if len(report.models) > 1:
        sections.insert(0, _overall_section(report))
    return render_page("depthwalk compare", [headline(report)], sections)


def _overall_section(report: CompareReport) -> Section:
    rows: list[tuple[str, ...]] = [(*_TITLES, "model")]
    for measure in MEASURES:
        summary, name = overall(measure, report.models)
        rows.append((*_summary_cells(measure, summary), name))
    return Section(title="Overall", tables=[rows, overview(report.models)])


def _model_section(model: ModelReport, worst: Sequence[WorstView]) -> Section:
    rows: list[tuple[str, ...]] = [(*_TITLES, "close: mean", "close: worst")]
    for measure in MEASURES:
        cells, close = _summary_cells(measure, summarise(measure, model.views)), summarise(measure, model.close)
        rows.append((*cells, cell(measure, close.mean), cell(measure, close.worst)))
    notes = missed_notes(model) + [f"A poor candidate: {warning}" for warning in model.warnings]
    if model.recommendation is not None:
        notes.append(model.recommendation.text())
    figures = [_figure(view) for view in worst]
    return Section(title=model.name, lines=[costs_line(model)], tables=[rows], notes=notes, figures=figures)


def _summary_cells(measure: Measure, summary: Summary) -> tuple[str, ...]:
    mean, worst = cell(measure, summary.mean, measure.goal_mean), cell(measure, summary.worst, measure.goal_worst)
    return measure.title, mean, worst, direction(summary.worst_view)


def _figure(worst: WorstView) -> Figure:
    values = "; ".join(f"{measure.title}: {cell(measure, getattr(worst.view, measure.key))}" for measure in MEASURES)
    return Figure(
        f"{direction(worst.view.viewpoint)}: worst in {'; '.join(worst.titles)}. {values}.",
        worst.panels,
    )


def _silhouettes(reference: Mask, test: Mask) -> Picture:
    """Paint where both, neither or one of two silhouettes (H, W) is, and the pixels that count as holes."""
    picture = np.empty((*reference.shape, 3), np.uint8)
    picture[...] = _NOTHING
    picture[reference & test] = _BOTH
    picture[reference & ~test] = _EDGE
    picture[~reference & test] = _EXTRA
    picture[metrics.hole_map(reference, test)] = _HOLE
    return picture
