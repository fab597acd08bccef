"""Show the results of `depthwalk compare`, as JSON and as tables of text.

The JSON is described in docs/quality-method.md.
"""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from depthwalk.bake.params import ModelParams
from depthwalk.quality import goals
from depthwalk.quality.advise import Recommendation
from depthwalk.quality.candidate import Candidate
from depthwalk.quality.goals import MEASURES, Measure, Summary, summarise
from depthwalk.quality.measure import ViewQuality
from depthwalk.quality.metrics import FLIP_PIXELS_PER_DEGREE
from depthwalk.quality.views import FOV, Viewpoint

_COSTS = "bake, s", "bake, MB", "disk, MB", "GPU, MB"


@dataclass(frozen=True, kw_only=True)
class Costs:
    """Hold the costs of depth images.

    Attributes
    ----------
    bake_seconds
        Time that baking took, seconds.
    bake_peak_bytes
        Peak memory while baking, bytes, see `BakeCosts`; None if the system does not report it.
    bytes_disk
        Size of the baked file, bytes.
    bytes_gpu
        Bytes of GPU memory.
    """

    bake_seconds: float
    bake_peak_bytes: int | None
    bytes_disk: int
    bytes_gpu: int


@dataclass(frozen=True, kw_only=True)
class ModelReport:
    """Hold the results for one mesh.

    Attributes
    ----------
    name
        The mesh file as the user gave it, or the scene file and the asset's name.
    mesh
        The mesh file.
    triangles
        Number of triangles of the mesh.
    params
        How its depth images were baked.
    objects
        Number of parts into which the mesh was split.
    deepest
        Greatest number of layers that any of its depth images has.
    costs
        Costs of the depth images.
    views
        The measures of views from all around.
    close
        The measures of close views.
    candidate
        How well the object suits depth images.
    warnings
        Why the object suits depth images poorly, one line for each reason.
    recommendation
        Recommended parameters; None if not requested.
    """

    name: str
    mesh: str
    triangles: int
    params: ModelParams
    objects: int
    deepest: int
    costs: Costs
    views: tuple[ViewQuality, ...]
    close: tuple[ViewQuality, ...]
    candidate: Candidate
    warnings: tuple[str, ...]
    recommendation: Recommendation | None


@dataclass(frozen=True, kw_only=True)
class Circumstances:
    """Hold the circumstances of a measurement: version, driver and picture size.

    Attributes
    ----------
    version
        Version of the package.
    commit
        Commit of the checkout that ran; None if the package is installed.
    renderer
        Name of the GL driver.
    image_size
        Width and height of the pictures, pixels.
    """

    version: str
    commit: str | None
    renderer: str
    image_size: tuple[int, int]

    @property
    def program(self) -> str:
        """Return the name and version of the program, for reading."""
        return f"depthwalk {self.version} ({self.commit or 'installed'}), {self.renderer}"

    def json_head(self) -> dict[str, Any]:
        """Return the first fields of reports in JSON."""
        return {name: getattr(self, name) for name in ("version", "commit", "renderer", "image_size")}


@dataclass(frozen=True, kw_only=True)
class CompareReport(Circumstances):
    """Hold the results of `depthwalk compare`.

    Attributes
    ----------
    models
        The results for each mesh.
    """

    models: tuple[ModelReport, ...]


def overall(measure: Measure, models: Sequence[ModelReport]) -> tuple[Summary, str]:
    """Summarise a measure over all models.

    Parameters
    ----------
    measure
        The measure.
    models
        The results for each mesh.

    Returns
    -------
    tuple[Summary, str]
        The mean of the models' means, with the worst of all views; and the name of the model in that view, "" if no
        view has a value.
    """
    means = [mean for model in models if not math.isnan(mean := summarise(measure, model.views).mean)]
    every = summarise(measure, [view for model in models for view in model.views])
    shown = [m.name for m in models if summarise(measure, m.views).worst == every.worst]
    mean = sum(means) / len(means) if means else math.nan
    return Summary(mean, every.worst, every.worst_view), shown[0] if shown else ""


def cost_goals(model: ModelReport) -> dict[str, bool | None]:
    """Return whether the costs "bake_seconds" and "bytes_gpu" of `model` reach their goals, by these two names.

    The goals apply to one resolution and number of layers; for models baked otherwise, both values are None. Time
    depends on the machine: tables for reading do not judge it.
    """
    if (model.params.resolution, model.params.layers) != (goals.GOAL_RESOLUTION, goals.GOAL_LAYERS):
        return {"bake_seconds": None, "bytes_gpu": None}
    return {
        "bake_seconds": model.costs.bake_seconds <= goals.BAKE_SECONDS,
        "bytes_gpu": model.costs.bytes_gpu <= goals.GPU_BYTES,
    }


def to_json(report: CompareReport) -> str:
    """Return `report` as JSON text. A value that is infinite or not a number becomes null."""
    document = {
        **report.json_head(),
        "fov": FOV,
        "flip_pixels_per_degree": FLIP_PIXELS_PER_DEGREE,
        "goals": {m.key: {"mean": m.goal_mean, "worst": m.goal_worst} for m in MEASURES},
        "models": [_model(model) for model in report.models],
        "overall": {m.key: _summary(m, *overall(m, report.models)) for m in MEASURES},
    }
    return json.dumps(_finite(document), indent=2, allow_nan=False) + "\n"


def to_text(report: CompareReport) -> str:
    """Return `report` as tables for reading."""
    lines = [headline(report)]
    for model in report.models:
        lines += ["", model.name, f"  {costs_line(model)}", *_table(model)]
        lines += [f"  {note}" for note in missed_notes(model)]
        lines += [f"  a poor candidate: {warning}" for warning in model.warnings]
        if model.recommendation is not None:
            lines.append(f"  {model.recommendation.text()}")
    if len(report.models) > 1:
        lines += ["", f"overall, {len(report.models)} models", _head()]
        for measure in MEASURES:
            summary, name = overall(measure, report.models)
            lines.append(_row(measure, summary) + f"  {name}")
        titles, *rows = overview(report.models)
        wide = max(len(row[0]) for row in rows)
        lines += ["", *("  " + row[0].ljust(wide) + "".join(c.rjust(20) for c in row[1:]) for row in (titles, *rows))]
    return "\n".join(lines)


def overview(models: Sequence[ModelReport]) -> list[tuple[str, ...]]:
    """Return a table with a row for each of `models`: its name, the mean of each measure, and its costs.

    The first row holds the titles of the columns.
    """
    rows = [("mean over the views", *(measure.title for measure in MEASURES), *_COSTS)]
    for model in models:
        means = [cell(measure, summarise(measure, model.views).mean, measure.goal_mean) for measure in MEASURES]
        reached, costs = cost_goals(model), model.costs
        seconds = f"{costs.bake_seconds:.1f}"
        peak, disk, gpu = map(_megabytes, (costs.bake_peak_bytes, costs.bytes_disk, costs.bytes_gpu))
        rows.append((model.name, *means, seconds, peak, disk, gpu + mark(reached["bytes_gpu"])))
    return rows


def headline(report: CompareReport) -> str:
    """Return a line that states with which version, driver and picture size `report` was made."""
    width, height = report.image_size
    return f"depth images against the mesh; {width} × {height} pixels; {report.program}"


def costs_line(model: ModelReport) -> str:
    """Return a line that states how `model` was baked and what it costs."""
    reached, costs, params = cost_goals(model), model.costs, model.params
    in_memory = mark(reached["bytes_gpu"], f" (goal {goals.GPU_BYTES / 1e6:g} MB)")
    peak = "" if costs.bake_peak_bytes is None else f" within {costs.bake_peak_bytes / 1e6:.0f} MB"
    count = model.deepest if params.layers == "auto" else params.layers
    layers = f"{count} layer{'s' if count > 1 else ''}{' (auto)' if params.layers == 'auto' else ''}"
    parts = f" in {model.objects} parts" if model.objects > 1 else ""
    return (
        f"{params.resolution}², {layers}, {params.method}{parts}; "
        f"{model.triangles} triangles, {len(model.views)} views; "
        f"baked in {costs.bake_seconds:.1f} s{peak}, "
        f"{costs.bytes_disk / 1e6:.1f} MB on disk, "
        f"{costs.bytes_gpu / 1e6:.1f} MB on the GPU{in_memory}; "
        f"{100 * model.candidate.left_out:.2f} % of the visible surface left out"
    )


def _megabytes(count: int | None) -> str:
    return "–" if count is None else f"{count / 1e6:.1f}"


def mark(reached: bool | None, goal: str = "") -> str:
    """Return the mark behind a value: " ok" if its goal is `reached`, otherwise " FAIL" and `goal`; "" for no goal."""
    return "" if reached is None else " ok" if reached else f" FAIL{goal}"


def missed_notes(model: ModelReport) -> list[str]:
    """Return a line that says what a missed goal means for a `model` with smaller images than goals are meant for.

    The list is empty if the model reaches its goals, or its images are as large.
    """
    params, layers = model.params, model.deepest if model.params.layers == "auto" else model.params.layers
    if params.resolution >= goals.GOAL_RESOLUTION and layers >= goals.GOAL_LAYERS:
        return []
    found = ((measure, summarise(measure, model.views)) for measure in MEASURES)
    reached = [
        measure.reached(value, goal)
        for measure, summary in found
        for value, goal in ((summary.mean, measure.goal_mean), (summary.worst, measure.goal_worst))
    ]
    if False not in reached:
        return []
    return [
        f"FAIL: the goals are meant for {goals.GOAL_RESOLUTION}² and {goals.GOAL_LAYERS} layers, where the model fills "
        "the picture; that near, scenes draw the mesh instead of smaller depth images"
    ]


def cell(measure: Measure, value: float, goal: float | None = None) -> str:
    """Return the text of a `value` of `measure`, with a mark for whether it reaches `goal`; None: no goal."""
    shown = "–" if math.isnan(value) else f"{value:.{measure.digits}f}"
    return shown + mark(measure.reached(value, goal))


def direction(viewpoint: Viewpoint | None) -> str:
    """Return the elevation and azimuth of `viewpoint` as text, degrees; "" for None."""
    return "" if viewpoint is None else f"{viewpoint.elevation:+.0f}°/{viewpoint.azimuth:.0f}°"


def _head() -> str:
    return "".ljust(24) + "".join(word.rjust(14) for word in ("mean", "worst", "at"))


def _table(model: ModelReport) -> Iterator[str]:
    yield _head() + "".join(word.rjust(12) for word in ("close: mean", "worst")) + "   goals"
    for measure in MEASURES:
        close = summarise(measure, model.close)
        cells = [cell(measure, value).rjust(12) for value in (close.mean, close.worst)]
        yield _row(measure, summarise(measure, model.views)) + "".join(cells) + f"   {_goals(measure)}"


def _goals(measure: Measure) -> str:
    """Return the goals of `measure` for the mean and, after a comma, for the worst view."""
    sign = "≥" if measure.more_is_better else "≤"
    return ", ".join(f"{sign} {goal:g}" for goal in (measure.goal_mean, measure.goal_worst) if goal is not None)


def _row(measure: Measure, summary: Summary) -> str:
    cells = cell(measure, summary.mean, measure.goal_mean), cell(measure, summary.worst, measure.goal_worst)
    return f"  {measure.title}".ljust(24) + "".join(c.rjust(14) for c in (*cells, direction(summary.worst_view)))


def _model(model: ModelReport) -> dict[str, Any]:
    return {
        "name": model.name,
        "mesh": model.mesh,
        "triangles": model.triangles,
        "dpci": {key: value for key, value in asdict(model.params).items() if key != "refinements"},
        "parts": model.objects,
        "deepest": model.deepest,
        **asdict(model.costs),
        "cost_goals": cost_goals(model),
        "summary": {m.key: _summary(m, summarise(m, model.views)) for m in MEASURES},
        "close_summary": {m.key: _summary(m, summarise(m, model.close), aims=False) for m in MEASURES},
        "views": [_view(view) for view in model.views],
        "close": [_view(view) for view in model.close],
        "candidate": asdict(model.candidate),
        "warnings": model.warnings,
        "recommendation": model.recommendation and asdict(model.recommendation),
    }


def _summary(measure: Measure, summary: Summary, name: str | None = None, aims: bool = True) -> dict[str, Any]:
    """Return mean and worst of a measure for JSON.

    Parameters
    ----------
    name
        The model in the worst view, if there are several.
    aims
        Whether to state which goals are reached.
    """
    document: dict[str, Any] = {"mean": summary.mean, "worst": summary.worst}
    if name is not None:
        document["worst_model"] = name
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
