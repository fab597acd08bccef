"""`depthwalk compare`: image quality of depth images against their mesh; `bake --verify`: the same in small."""

import tempfile
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from pydantic import Field

import depthwalk
from depthwalk.assets.batch_bake import mesh_key, read_body, read_mesh
from depthwalk.bake.file import SUFFIX, read_baked, read_header
from depthwalk.bake.parts import ModelParams
from depthwalk.commands.console import asset_progress, frame_progress, log
from depthwalk.commands.render import asset_files
from depthwalk.commands.subjects import Subject
from depthwalk.errors import InputError
from depthwalk.files import check_folder, write_bytes
from depthwalk.gpu.device import GpuError
from depthwalk.ingest.mesh import Mesh
from depthwalk.params import Params
from depthwalk.provenance import commit
from depthwalk.quality.advise import Recommendation, recommend
from depthwalk.quality.candidate import examine, warnings
from depthwalk.quality.costs import measured_bake
from depthwalk.quality.goals import MEASURES, SILHOUETTE, summarise
from depthwalk.quality.measure import ViewQuality, flip_workers, measure, measure_views, object_height
from depthwalk.quality.page import WorstView, panels, to_html, worst_viewpoints
from depthwalk.quality.report import CompareReport, Costs, ModelReport, cell, to_json, to_text
from depthwalk.quality.twin import TwinRenderer
from depthwalk.quality.views import CLOSE_BY, SPHERE, VERIFY
from depthwalk.scene.document import parse_document
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import MeshAsset
from depthwalk.scene.validate import check_model

VERIFY_SIZE = 320, 240
SMALLEST = 16  # pixels, each side of a picture


@dataclass(frozen=True)
class Plan:
    """What to compare. size: (width, height) of the pictures, pixels; wanted: dB to recommend for, or None; pictures:
    keep the worst views for the page."""

    subjects: Sequence[Subject]
    settings: RenderSettings
    size: tuple[int, int]
    wanted: float | None
    pictures: bool


class _Overridable(Params):
    render: RenderSettings = Field(default_factory=RenderSettings)


def parse_render_settings(overrides: dict[str, str]) -> RenderSettings:
    """The default settings with `render.…` keys replaced, as `--set` gives them. Raises InputError."""
    return check_model(parse_document("render: {}", "settings"), _Overridable, overrides)[0].render


def check_plan(plan: Plan, files: Sequence[Path | None]) -> None:
    """Makes sure that the pictures can be measured and the reports written. Raises InputError."""
    if min(plan.size) < SMALLEST:
        width, height = plan.size
        raise InputError(f"--resolution {width},{height}: each side must be at least {SMALLEST} pixels")
    if plan.wanted is not None and not 0 < plan.wanted <= 100:
        raise InputError(f"--want-psnr {plan.wanted:g}: must be above 0 and at most 100 dB")
    specs = [subject.spec for subject in plan.subjects]
    inputs = [file for spec in specs for file in (spec.mesh, spec.texture) if file is not None]
    for file in inputs:  # each takes a while: complain about the last one before the first is measured
        if not file.is_file():
            raise InputError(f"{file}: no such file")
    taken = {file.resolve() for spec in specs for file in asset_files(spec)}
    taken |= {subject.scene.resolve() for subject in plan.subjects if subject.scene is not None}
    for out in files:
        if out is not None:
            check_folder(out)
            if out.resolve() in taken:
                raise InputError(f"{out}: would overwrite what is compared, or the other report")
            taken.add(out.resolve())


def run_compare(plan: Plan, json_file: Path | None, html_file: Path | None) -> None:
    """Measures each mesh, prints the tables and writes the files asked for. Raises InputError, GpuError."""
    models: list[ModelReport] = []
    worst: list[list[WorstView]] = []
    driver = ""
    with flip_workers() as pool:
        for subject in plan.subjects:
            model, shown, driver = _compare(subject, plan, pool)
            models.append(model)
            worst.append(shown)
    report = CompareReport(
        version=depthwalk.__version__, commit=commit(), renderer=driver, image_size=plan.size, models=tuple(models)
    )
    if json_file is not None:
        write_bytes(json_file, to_json(report).encode())
    if html_file is not None:
        write_bytes(html_file, to_html(report, worst).encode())
    print(to_text(report))


def verify(specs: Sequence[MeshAsset], params: ModelParams, files: Sequence[Path]) -> None:
    """Prints a line of image quality for each file that holds what baking its mesh gave; others are passed over."""
    for spec, file in zip(specs, files, strict=True):
        try:
            if read_header(file)["depthwalk.key"] != mesh_key(spec, params):
                continue  # an older file: the bake failed, and said so
            quality = measure(read_mesh(spec), read_baked(file), RenderSettings(), VERIFY_SIZE, VERIFY)
        except InputError:
            continue
        except GpuError as error:
            log.warning("%s: cannot be verified: %s", file, error)
            return
        print(f"{file}: {len(quality.views)} views of {VERIFY_SIZE[0]} × {VERIFY_SIZE[1]}: {_line(quality.views)}")


def _line(views: Sequence[ViewQuality]) -> str:
    """The means of all measures in one line."""
    return "; ".join(f"{each.title}: {cell(each, summarise(each, views).mean)}" for each in MEASURES)


def _compare(subject: Subject, plan: Plan, pool: Executor) -> tuple[ModelReport, list[WorstView], str]:
    """The report on one mesh, its worst views with pictures, and the GL driver's name."""
    spec = subject.spec
    with asset_progress() as report, tempfile.TemporaryDirectory() as folder:
        report(spec.name, "reading")
        mesh = read_body(spec)
        report(spec.name, "baking")
        file = Path(folder) / f"compared{SUFFIX}"
        bake = measured_bake(spec, subject.params, file)
        baked = read_baked(file)
        report(spec.name, "examining")
        candidate = examine(mesh, baked, subject.params)
    height = object_height(mesh)
    with TwinRenderer(mesh, baked, plan.settings, plan.size) as twin:
        with frame_progress(spec.name, len(SPHERE) + len(CLOSE_BY)) as advance:
            views = measure_views(twin, height, SPHERE, pool, advance)
            close = measure_views(twin, height, CLOSE_BY, pool, advance)
        if not views:
            raise InputError(f"{spec.mesh}: shows no pixel in any view")
        costs = Costs(
            bake_seconds=bake.seconds,
            bake_peak_bytes=bake.peak_bytes,
            bytes_disk=bake.bytes_disk,
            bytes_gpu=twin.gpu_bytes,
        )
        shown = _worst_views(twin, views) if plan.pictures else []
        driver = twin.driver
    advice = _advice(subject, mesh, plan)
    outlines = SILHOUETTE.reached(summarise(SILHOUETTE, views).mean, SILHOUETTE.goal_worst)
    reasons = tuple(warnings(candidate, bool(outlines)))
    deepest = 1 + max(image.layer for part in baked.parts for image in part.images)
    model = ModelReport(
        name=subject.name,
        mesh=str(spec.mesh),
        triangles=len(mesh.faces),
        params=subject.params,
        objects=len(baked.parts),
        deepest=deepest,
        costs=costs,
        views=views,
        close=close,
        candidate=candidate,
        warnings=reasons,
        recommendation=advice,
    )
    return model, shown, driver


def _advice(subject: Subject, mesh: Mesh, plan: Plan) -> Recommendation | None:
    if plan.wanted is None:
        return None
    with asset_progress() as report:
        say = partial(report, subject.spec.name)
        return recommend(mesh, subject.params, plan.settings, plan.size, plan.wanted, progress=say)


def _worst_views(twin: TwinRenderer, views: Sequence[ViewQuality]) -> list[WorstView]:
    by_viewpoint = {view.viewpoint: view for view in views}
    return [
        WorstView(by_viewpoint[viewpoint], titles, panels(twin.pair(viewpoint)))
        for viewpoint, titles in worst_viewpoints(views).items()
    ]
