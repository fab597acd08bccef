"""Bake meshes, and compare pictures of their depth images with pictures of the meshes, for `depthwalk compare`."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from pydantic import Field

import depthwalk
from depthwalk.assets.asset_files import mesh_key, read_body, read_mesh
from depthwalk.bake.file import SUFFIX, read_baked, read_header
from depthwalk.bake.params import ModelParams
from depthwalk.cluster.address import ClusterAddress
from depthwalk.cluster.tasks import Task
from depthwalk.commands.baking import absolute
from depthwalk.commands.journal import Journal, digest, file_states
from depthwalk.commands.measuring import Measurements, measured
from depthwalk.commands.progress import asset_progress, frame_progress, log, quiet
from depthwalk.commands.reports import asset_files
from depthwalk.commands.subjects import Subject
from depthwalk.errors import InputError, missing_file
from depthwalk.files import temporary_folder
from depthwalk.gpu.failures import GpuError
from depthwalk.ingest.mesh import Mesh
from depthwalk.params import Params
from depthwalk.provenance import commit
from depthwalk.quality.advise import Recommendation, recommend
from depthwalk.quality.candidate import examine, warnings
from depthwalk.quality.costs import measured_bake
from depthwalk.quality.goals import MEASURES, SILHOUETTE, summarise
from depthwalk.quality.measure import ViewQuality, flip_workers, measure, measure_views, object_height
from depthwalk.quality.page import WorstView, panels, worst_viewpoints
from depthwalk.quality.pair_renderer import PairRenderer
from depthwalk.quality.report import CompareReport, Costs, ModelReport, cell
from depthwalk.quality.views import CLOSE_BY, SPHERE, VERIFY
from depthwalk.scene.document import parse_document
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import MeshAsset
from depthwalk.scene.validate import check_model

VERIFY_SIZE = 320, 240
SMALLEST = 16  # pixels, each side of a picture


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Describe what to compare.

    Attributes
    ----------
    subjects
        The meshes, and how their depth images are baked.
    settings
        How meshes and depth images are rendered.
    size
        (width, height) of the pictures, pixels.
    wanted
        PSNR, dB, for which to recommend parameters; None recommends none.
    pictures
        Whether to keep pictures of the worst views, for an HTML page.
    """

    subjects: Sequence[Subject]
    settings: RenderSettings
    size: tuple[int, int]
    wanted: float | None
    pictures: bool


Compared = tuple[ModelReport, list[WorstView], str]
"""The report on a mesh, its worst views, with pictures if requested, and the name of the GL driver."""


class _Overridable(Params):
    render: RenderSettings = Field(default_factory=RenderSettings)


def parse_render_settings(overrides: dict[str, str]) -> RenderSettings:
    """Return the default render settings, changed by the options --set.

    Parameters
    ----------
    overrides
        New values as YAML texts, by dotted key, such as `render.lod.bias`.

    Returns
    -------
    RenderSettings
        The settings.

    Raises
    ------
    InputError
        For keys that do not begin with `render.`, and for values that cannot be used.
    """
    return check_model(parse_document("render: {}", "settings"), _Overridable, overrides)[0].render


def check_plan(plan: Plan) -> None:
    """Check that a plan can be measured, before the first mesh, which takes a while.

    Parameters
    ----------
    plan
        The plan; every file that it names is checked to exist.

    Raises
    ------
    InputError
        If the pictures are too small, the PSNR is not above 0 and at most 100 dB, or a file is missing.
    """
    if min(plan.size) < SMALLEST:
        width, height = plan.size
        raise InputError(f"--resolution {width},{height}: each side must be at least {SMALLEST} pixels")
    if plan.wanted is not None and not 0 < plan.wanted <= 100:
        raise InputError(f"--want-psnr {plan.wanted:g}: must be above 0 and at most 100 dB")
    specs = [subject.spec for subject in plan.subjects]
    for file in [file for spec in specs for file in (spec.mesh, spec.texture) if file is not None]:
        if not file.is_file():
            raise missing_file(file)


@contextmanager
def run_compare(
    plan: Plan, cluster: ClusterAddress | None = None
) -> Iterator[tuple[CompareReport, list[list[WorstView]]]]:
    """Bake and measure each mesh of a plan, skipping those that an interrupted earlier run has measured.

    Parameters
    ----------
    plan
        The meshes, and how to bake and render them.
    cluster
        Cluster on which to do so, one mesh at a time per worker; None for this process.

    Yields
    ------
    tuple[CompareReport, list[list[WorstView]]]
        The report, and for each mesh its worst views; these are empty unless `plan.pictures` is set. The measurements
        are stored until the `with` block ends.

    Raises
    ------
    InputError
        If a mesh cannot be baked, or shows nothing.
    GpuError
        If no OpenGL 3.3 context can be created.
    TaskError, ClusterError
        If a mesh cannot be compared on the cluster for another reason, or the cluster is lost for good.
    """
    with measured(_measurements(plan), cluster) as found:
        report = CompareReport(
            version=depthwalk.__version__,
            commit=commit(),
            renderer=found[-1][2],
            image_size=plan.size,
            models=tuple(model for model, _, _ in found),
        )
        yield report, [shown for _, shown, _ in found]


def _measurements(plan: Plan) -> Measurements[Compared]:
    """Return how each mesh of a plan is compared, here and by workers, whose folders differ."""
    subjects = [replace(subject, spec=absolute(subject.spec)) for subject in plan.subjects]
    rest = replace(plan, subjects=())

    def named(number: int, outcome: Compared) -> Compared:
        model, shown, driver = outcome
        return replace(model, mesh=str(plan.subjects[number].spec.mesh)), shown, driver

    @contextmanager
    def here() -> Iterator[Callable[[int], Compared]]:
        with flip_workers() as pool:
            yield lambda number: _compare(plan.subjects[number], plan, pool)

    return Measurements(
        what="meshes",
        names=[str(subject.spec.mesh) for subject in plan.subjects],
        tasks=[
            Task(
                key=f"compare-{digest(subject, rest, file_states(asset_files(subject.spec)))}",
                function=compare_alone,
                arguments=(subject, rest),
            )
            for subject in subjects
        ],
        here=here,
        named=named,
        kind=Compared,
        journal=Journal("compare", plan),
    )


def compare_alone(subject: Subject, plan: Plan) -> Compared:
    """Compare a mesh in a worker process, without reporting progress.

    Parameters
    ----------
    subject
        The mesh.
    plan
        How to render it.

    Returns
    -------
    Compared
        The result.

    Raises
    ------
    InputError
        If the mesh cannot be baked, or shows nothing.
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    with quiet(), ThreadPoolExecutor(1, "flip") as pool:  # other workers have the other cores
        return _compare(subject, plan, pool)


def verify(specs: Sequence[MeshAsset], params: ModelParams, files: Sequence[Path]) -> None:
    """Print a line of image quality for each file that `depthwalk bake` has just written.

    Meshes whose bake failed are skipped. Without OpenGL, a warning is printed instead of the lines.

    Parameters
    ----------
    specs, files
        The meshes, and the file to which each was baked.
    params
        How all of them were baked.
    """
    for spec, file in zip(specs, files, strict=True):
        try:
            if read_header(file)["depthwalk.key"] != mesh_key(spec, params):
                continue  # an older file: this bake failed, which was reported
            quality = measure(read_mesh(spec), read_baked(file), RenderSettings(), VERIFY_SIZE, VERIFY)
        except InputError:
            continue
        except GpuError as error:
            log.warning("%s: cannot be verified: %s", file, error)
            return
        print(f"{file}: {len(quality.views)} views of {VERIFY_SIZE[0]} × {VERIFY_SIZE[1]}: {_line(quality.views)}")


def _line(views: Sequence[ViewQuality]) -> str:
    """Return the means of all measures in one line."""
    means = (f"{measure.title}: {cell(measure, summarise(measure, views).mean)}" for measure in MEASURES)
    return "; ".join(means)


def _compare(subject: Subject, plan: Plan, pool: Executor) -> Compared:
    """Return the report on one mesh, its worst views with pictures, and the name of the GL driver."""
    spec = subject.spec
    with asset_progress() as report, temporary_folder() as folder:
        report(spec.name, "reading")
        mesh = read_body(spec)
        report(spec.name, "baking")
        file = Path(folder) / f"compared{SUFFIX}"
        bake = measured_bake(spec, subject.params, file)
        baked = read_baked(file)
        report(spec.name, "examining")
        candidate = examine(mesh, baked, subject.params)
    height = object_height(mesh)
    with PairRenderer(mesh, baked, plan.settings, plan.size) as renderer:
        with frame_progress(spec.name, len(SPHERE) + len(CLOSE_BY)) as advance:
            views = measure_views(renderer, height, SPHERE, pool, advance)
            gpu_bytes = renderer.gpu_bytes  # in close views there may be more
            close = measure_views(renderer, height, CLOSE_BY, pool, advance)
        if not views:
            raise InputError(f"{spec.mesh}: covers no pixel in any view")
        costs = Costs(
            bake_seconds=bake.seconds,
            bake_peak_bytes=bake.peak_bytes,
            bytes_disk=bake.bytes_disk,
            bytes_gpu=gpu_bytes,
        )
        shown = _worst_views(renderer, views) if plan.pictures else []
        driver = renderer.driver
    outlines = SILHOUETTE.reached(summarise(SILHOUETTE, views).mean, SILHOUETTE.goal_worst)
    model = ModelReport(
        name=subject.name,
        mesh=str(spec.mesh),
        triangles=len(mesh.faces),
        params=subject.params,
        objects=len(baked.parts),
        deepest=1 + max(image.layer for part in baked.parts for image in part.images),
        costs=costs,
        views=views,
        close=close,
        candidate=candidate,
        warnings=tuple(warnings(candidate, bool(outlines))),
        recommendation=_advice(subject, mesh, plan),
    )
    return model, shown, driver


def _advice(subject: Subject, mesh: Mesh, plan: Plan) -> Recommendation | None:
    if plan.wanted is None:
        return None
    with asset_progress() as report:
        progress = partial(report, subject.spec.name)
        return recommend(mesh, subject.params, plan.settings, plan.size, plan.wanted, progress=progress)


def _worst_views(renderer: PairRenderer, views: Sequence[ViewQuality]) -> list[WorstView]:
    by_viewpoint = {view.viewpoint: view for view in views}
    return [
        WorstView(by_viewpoint[viewpoint], titles, panels(renderer.pair(viewpoint)))
        for viewpoint, titles in worst_viewpoints(views).items()
    ]
