"""A comparison as JSON and as a table of text. The JSON is described in docs/quality-method.md."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from depthwalk.quality import goals
from depthwalk.quality.advise import Recommendation
from depthwalk.quality.candidate import Candidate
from depthwalk.quality.goals import MEASURES, Measure, Summary, summarise
from depthwalk.quality.measure import ViewQuality
from depthwalk.quality.metrics import FLIP_PIXELS_PER_DEGREE
from depthwalk.quality.views import FOV, Viewpoint


@dataclass(frozen=True)
class Costs:
    """bake_seconds: from the mesh in memory to depth images in memory; bytes on disk and on the GPU."""

    bake_seconds: float
    bytes_disk: int
    bytes_gpu: int


@dataclass(frozen=True)
class ModelReport:
    """One mesh. mesh: the file as the user gave it; views: on the sphere; close: from close by."""

    mesh: str
    triangles: int
    costs: Costs
    views: tuple[ViewQuality, ...]
    close: tuple[ViewQuality, ...]
    candidate: Candidate
    warnings: tuple[str, ...]
    recommendation: Recommendation | None


@dataclass(frozen=True)
class CompareReport:
    """What `depthwalk compare` found. commit: of the checkout that ran, else None; renderer: the GL driver's name;
    image_size: the pictures' (width, height); resolution, layers: of the depth images."""

    version: str
    commit: str | None
    renderer: str
    image_size: tuple[int, int]
    resolution: int
    layers: int
    models: tuple[ModelReport, ...]


def overall(measure: Measure, models: Sequence[ModelReport]) -> tuple[Summary, str]:
    """The mean of the models' means, the worst view of all, and the mesh that it shows."""
    means = [mean for model in models if not math.isnan(mean := summarise(measure, model.views).mean)]
    every = summarise(measure, [view for model in models for view in model.views])
    shown = [m.mesh for m in models if summarise(measure, m.views).worst == every.worst]
    mean = sum(means) / len(means) if means else math.nan
    return Summary(mean, every.worst, every.worst_view), shown[0] if shown else ""


def cost_goals(report: CompareReport, costs: Costs) -> dict[str, bool | None]:
    """Whether the costs reach their goals, which are set for one resolution and number of layers; else None."""
    if (report.resolution, report.layers) != (goals.GOAL_RESOLUTION, goals.GOAL_LAYERS):
        return {"bake_seconds": None, "bytes_gpu": None}
    return {
        "bake_seconds": costs.bake_seconds <= goals.BAKE_SECONDS,
        "bytes_gpu": costs.bytes_gpu <= goals.GPU_BYTES,
    }


def to_json(report: CompareReport) -> str:
    """The report for programs. A value that is not a number, or is infinite, becomes null."""
    document = {
        "version": report.version,
        "commit": report.commit,
        "renderer": report.renderer,
        "image_size": report.image_size,
        "fov": FOV,
        "flip_pixels_per_degree": FLIP_PIXELS_PER_DEGREE,
        "dpci": {"resolution": report.resolution, "layers": report.layers},
        "goals": {m.key: {"mean": m.goal_mean, "worst": m.goal_worst} for m in MEASURES},
        "models": [_model(report, model) for model in report.models],
        "overall": {m.key: _summary(m, *overall(m, report.models)) for m in MEASURES},
    }
    return json.dumps(_finite(document), indent=2, allow_nan=False) + "\n"


def to_text(report: CompareReport) -> str:
    """The report as tables for reading."""
    lines = [headline(report)]
    for model in report.models:
        lines += ["", f"{model.mesh}: {costs_line(report, model)}", *_table(model)]
        lines += [f"  a poor candidate: {warning}" for warning in model.warnings]
        if model.recommendation is not None:
            lines.append(f"  {model.recommendation.text()}")
    if len(report.models) > 1:
        lines += ["", f"overall, {len(report.models)} models", _head()]
        for measure in MEASURES:
            summary, mesh = overall(measure, report.models)
            lines.append(_row(measure, summary) + f"  {mesh}")
    return "\n".join(lines)


def headline(report: CompareReport) -> str:
    width, height = report.image_size
    return (
        f"depth images of {report.resolution}², {report.layers} layers, against the mesh; {width} × {height} pixels; "
        f"depthwalk {report.version} ({report.commit or 'installed'}), {report.renderer}"
    )


def costs_line(report: CompareReport, model: ModelReport) -> str:
    reached, costs = cost_goals(report, model.costs), model.costs
    return (
        f"{model.triangles} triangles, {len(model.views)} views; "
        f"baked in {costs.bake_seconds:.1f} s{mark(reached['bake_seconds'])}, "
        f"{costs.bytes_disk / 1e6:.1f} MB on disk, "
        f"{costs.bytes_gpu / 1e6:.1f} MB on the GPU{mark(reached['bytes_gpu'])}"
    )


def mark(reached: bool | None) -> str:
    """What stands behind a value that has a goal."""
    return "" if reached is None else " ok" if reached else " FAIL"


def cell(measure: Measure, value: float, goal: float | None = None) -> str:
    """A value, and how it stands to its goal."""
    shown = "–" if math.isnan(value) else f"{value:.{measure.digits}f}"
    return shown + mark(measure.reached(value, goal))


def direction(viewpoint: Viewpoint | None) -> str:
    """A view by elevation and azimuth."""
    return "" if viewpoint is None else f"{viewpoint.elevation:+.0f}°/{viewpoint.azimuth:.0f}°"


def _head() -> str:
    return "".ljust(24) + "".join(word.rjust(14) for word in ("mean", "worst", "at"))


def _table(model: ModelReport) -> Iterator[str]:
    yield _head() + "".join(word.rjust(12) for word in ("close: mean", "worst"))
    for measure in MEASURES:
        close = summarise(measure, model.close)
        yield _row(measure, summarise(measure, model.views)) + "".join(
            cell(measure, value).rjust(12) for value in (close.mean, close.worst)
        )


def _row(measure: Measure, summary: Summary) -> str:
    cells = cell(measure, summary.mean, measure.goal_mean), cell(measure, summary.worst, measure.goal_worst)
    return f"  {measure.title}".ljust(24) + "".join(c.rjust(14) for c in (*cells, direction(summary.worst_view)))


def _model(report: CompareReport, model: ModelReport) -> dict[str, Any]:
    return {
        "mesh": model.mesh,
        "triangles": model.triangles,
        **asdict(model.costs),
        "cost_goals": cost_goals(report, model.costs),
        "summary": {m.key: _summary(m, summarise(m, model.views)) for m in MEASURES},
        "close_summary": {m.key: _summary(m, summarise(m, model.close), aims=False) for m in MEASURES},
        "views": [_view(view) for view in model.views],
        "close": [_view(view) for view in model.close],
        "candidate": asdict(model.candidate),
        "warnings": model.warnings,
        "recommendation": model.recommendation and asdict(model.recommendation),
    }


def _summary(measure: Measure, summary: Summary, mesh: str | None = None, aims: bool = True) -> dict[str, Any]:
    """aims: say which goals are reached. mesh: which one the worst view shows, where there are several."""
    document: dict[str, Any] = {"mean": summary.mean, "worst": summary.worst}
    if mesh is not None:
        document["worst_mesh"] = mesh
    document["worst_view"] = summary.worst_view and _viewpoint(summary.worst_view)
    if aims:
        document["mean_reached"] = measure.reached(summary.mean, measure.goal_mean)
        document["worst_reached"] = measure.reached(summary.worst, measure.goal_worst)
    return document


def _view(view: ViewQuality) -> dict[str, Any]:
    values = {key: value for key, value in asdict(view).items() if key != "viewpoint"}
    return _viewpoint(view.viewpoint) | values


def _viewpoint(viewpoint: Viewpoint) -> dict[str, float]:
    return {"elevation": viewpoint.elevation, "azimuth": viewpoint.azimuth}


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
