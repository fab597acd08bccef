"""Draw and time the frames of `depthwalk bench`, alternating between representations, with `bench.measure`."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, fields, replace
from datetime import datetime
from pathlib import Path

import depthwalk
from depthwalk.bench.measure import Report, measure, sample_path
from depthwalk.cluster.address import ClusterAddress
from depthwalk.cluster.tasks import Task
from depthwalk.commands.frame_drawing import open_headless
from depthwalk.commands.journal import Journal, digest, file_states
from depthwalk.commands.measuring import Measurements, measured
from depthwalk.commands.option_values import CameraOptions, representation
from depthwalk.commands.options import RepresentationName
from depthwalk.commands.progress import frame_progress, quiet
from depthwalk.commands.scene_file import SceneFile
from depthwalk.errors import InputError
from depthwalk.provenance import commit, machine
from depthwalk.render import kernels
from depthwalk.scene.path import CameraPath

DEFAULT_FRAMES = 60  # with a fixed camera


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Describe what to measure of a scene.

    Attributes
    ----------
    file
        The scene to draw.
    path_file, path
        The camera path's file and the path; None for a fixed camera.
    camera
        Changes to the fixed camera.
    frames
        Number of measured frames; None: every frame of the path, or `DEFAULT_FRAMES` with a fixed camera.
    warmup
        Number of frames that are drawn before the first is measured.
    size
        (width, height) of the pictures, pixels.
    representations
        The ways to draw every object, which alternate.
    pictured
        Returns the numbers of the frames whose pictures are kept, given how many there are; None keeps none.
    """

    file: SceneFile
    path_file: Path | None
    path: CameraPath | None
    camera: CameraOptions
    frames: int | None
    warmup: int
    size: tuple[int, int]
    representations: Sequence[RepresentationName]
    pictured: Callable[[int], Sequence[int]] | None = None

    @property
    def frame_count(self) -> int:
        """Return the number of measured frames per representation."""
        if self.frames is not None:
            return self.frames
        return DEFAULT_FRAMES if self.path is None else len(self.path.frames())


def parse_representations(texts: Sequence[str] | None) -> list[RepresentationName]:
    """Return the representations in the options --representation, without duplicates.

    Parameters
    ----------
    texts
        The text of each option, names separated by commas; None, without options, means only `scene`.

    Returns
    -------
    list[RepresentationName]
        The names, in the order of the texts.

    Raises
    ------
    InputError
        For a name that does not exist.
    """
    names = [name.strip() for text in texts or ["scene"] for name in text.split(",")]
    unknown = [name for name in names if name not in set(RepresentationName)]
    if unknown:
        raise InputError(f"--representation {unknown[0]}: must be one of {', '.join(RepresentationName)}")
    return [RepresentationName(name) for name in dict.fromkeys(names)]


@contextmanager
def run_benches(
    plans: Sequence[Plan], inputs: Sequence[Sequence[Path]], cluster: ClusterAddress | None = None
) -> Iterator[list[Report]]:
    """Measure several plans, one after the other, skipping those that an interrupted earlier run has measured.

    Parameters
    ----------
    plans
        What to measure.
    inputs
        For each plan, the files that it reads.
    cluster
        Cluster on which to measure, one plan at a time per worker; None for this process.

    Yields
    ------
    list[Report]
        The reports, in the order of the plans; they are stored until the `with` block ends.

    Raises
    ------
    InputError
        If an asset cannot be used.
    GpuError
        If no OpenGL 3.3 context can be created.
    TaskError, ClusterError
        If a plan cannot be measured on the cluster for another reason, or the cluster is lost for good.
    """
    keys = [digest(_identity(plan), file_states(files)) for plan, files in zip(plans, inputs, strict=True)]

    @contextmanager
    def here() -> Iterator[Callable[[int], Report]]:
        yield lambda number: run_bench(plans[number])

    measurements = Measurements(
        what="scenes",
        names=[str(plan.file.path) for plan in plans],
        tasks=[
            Task(key=f"bench-{key}", function=bench_alone, arguments=(replace(plan, file=plan.file.absolute()),))
            for plan, key in zip(plans, keys, strict=True)
        ],
        here=here,
        named=lambda number, report: replace(report, scene=str(plans[number].file.path)),
        kind=Report,
        journal=Journal("bench", *map(_identity, plans)),
    )
    with measured(measurements, cluster) as reports:
        yield reports


def _identity(plan: Plan) -> tuple[object, ...]:
    """Return values whose `repr` identifies what a plan measures; for the path, that is its file."""
    values = (getattr(plan, member.name) for member in fields(plan) if member.name not in ("path", "pictured"))
    return (*map(str, values), plan.pictured is not None)


def bench_alone(plan: Plan) -> Report:
    """Measure a plan in a worker process, without reporting progress; see `run_bench`."""
    with quiet():
        return run_bench(plan)


def run_bench(plan: Plan) -> Report:
    """Draw and time the frames of a plan in each of its representations.

    Parameters
    ----------
    plan
        The scene, its cameras, and the representations.

    Returns
    -------
    Report
        The times, with a run for each representation.

    Raises
    ------
    InputError
        If the scene or an asset cannot be used.
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    kernels.load()
    scene = plan.file.open()
    with ExitStack() as opened:
        drawn = {
            str(name): opened.enter_context(open_headless(scene, plan.size, representation(name)))
            for name in plan.representations
        }
        first = next(iter(drawn.values()))
        for headless in drawn.values():
            headless.renderer.remembers = True
        if plan.path is not None:
            cameras = sample_path(plan.path, plan.frames)
        else:
            still = plan.camera.apply(scene.camera or first.frame_all())
            cameras = [still] * plan.frame_count
        pictured = plan.pictured(len(cameras)) if plan.pictured else ()
        with frame_progress(", ".join(drawn), len(cameras) * len(drawn)) as advance:
            runs = measure(drawn, cameras, plan.warmup, advance, pictured)
        renderer, timer = first.device.renderer, first.renderer.timers.kind
        driver = first.device.driver
    return Report(
        version=depthwalk.__version__,
        commit=commit(),
        date=datetime.now().astimezone().isoformat(timespec="seconds"),
        machine=machine(),
        renderer=renderer,
        driver=driver,
        timer=timer,
        planning="compiled" if kernels.loaded() else "numpy",
        resolution=plan.size,
        scene=str(scene.path),
        path=None if plan.path_file is None else str(plan.path_file),
        stride=None if plan.path is None else (len(plan.path.frames()) - 1) / max(len(cameras) - 1, 1),
        runs=tuple(runs),
    )
