"""`depthwalk bake`: meshes to files of depth images, several at a time."""

import contextlib
import multiprocessing
import os
import queue
import signal
import tempfile
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from depthwalk.bake.cache import sidecar
from depthwalk.bake.file import SUFFIX, write_baked
from depthwalk.bake.parts import ModelParams, bake_model
from depthwalk.commands.console import live_options, log, show_progress
from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.library import mesh_key
from depthwalk.output import check_folder
from depthwalk.scene.scene import MeshAsset

_POLL = 0.1  # seconds between two looks at what the processes report

Outcomes = Generator[tuple[int, "Baked | InputError"], None, None]
Stage = Callable[[int, str], None]  # number of the job, what is being done


@dataclass(frozen=True)
class Job:
    """A mesh to bake and the file to bake it to. staged: where the worker writes; moved to `out` when it is whole."""

    spec: MeshAsset
    params: ModelParams
    out: Path
    staged: Path


@dataclass(frozen=True)
class Baked:
    """What a job came to. parts: objects that share the mesh; images: depth images that see anything; seconds: by
    stage, in order; bytes: of the file."""

    out: Path
    triangles: int
    parts: int
    images: int
    seconds: dict[str, float]
    bytes: int


def output_files(meshes: Sequence[Path], out: Path | None) -> list[Path]:
    """The file of each mesh: in the folder `out`, in the file `out`, or beside the mesh. Raises InputError."""
    if out is None:
        files = [sidecar(mesh) for mesh in meshes]
    elif out.is_dir():
        files = [out / sidecar(mesh).name for mesh in meshes]
    elif len(meshes) > 1:
        raise InputError(f"{out}: several meshes need an existing folder")
    elif not out.name.endswith(".exr"):
        raise InputError(f"{out}: must be an existing folder, or a file that ends in {SUFFIX}")
    else:
        files = [out]
    for number, file in enumerate(files):
        if file in files[:number]:
            raise InputError(f"{file}: {meshes[files.index(file)]} and {meshes[number]} would both be baked to it")
        if out is not None:
            check_folder(file)
    return files


def mesh_spec(mesh: Path, texture: Path | None, up: Literal["y", "z"], height: float | None) -> MeshAsset:
    """The asset that a scene file with the same values describes: both have the same key. Raises InputError."""
    if height is not None and not 0 < height <= 1e6:
        raise InputError(f"--height {height:g}: must be above 0 and at most 1000000 metres")
    return MeshAsset(mesh.stem, mesh, texture, up, height, dpci=None)


def bake_meshes(specs: Sequence[MeshAsset], params: ModelParams, files: Sequence[Path]) -> list[InputError]:
    """Bakes each mesh to its file, says so on stdout, and returns the complaints about those that failed."""
    failures: list[InputError] = []
    with contextlib.ExitStack() as stack:
        staged = [stack.enter_context(_staging(out)) for out in files]
        jobs = [Job(spec, params, *where) for spec, *where in zip(specs, files, staged, strict=True)]
        stage = stack.enter_context(_progress([spec.mesh.name for spec in specs]))
        run = _run_here if len(jobs) == 1 else _run_parallel
        for number, outcome in stack.enter_context(contextlib.closing(run(jobs, stage))):
            if isinstance(outcome, InputError):
                failures.append(outcome)
                log.error("%s", outcome)
            else:
                os.replace(jobs[number].staged, outcome.out)
                print(describe(outcome, params.resolution), flush=True)
    return failures


def bake_job(job: Job, stage: Callable[[str], None]) -> Baked:
    """Reads, bakes and writes one mesh; `stage` is called with the name of each stage. Raises InputError."""
    clock = _Stopwatch(stage)
    clock.start("read")
    key = mesh_key(job.spec, job.params)
    mesh = load_mesh(job.spec.mesh, texture=job.spec.texture, up=job.spec.up, height=job.spec.height)
    check_folder(job.out)
    clock.start("structure")  # what rays are cast against
    model = bake_model(mesh, job.params, key, clock.start)
    clock.start("write")
    write_baked(job.staged, model)
    seconds = clock.stop()
    images = sum(len(part.images) for part in model.parts)
    return Baked(job.out, len(mesh.faces), len(model.parts), images, seconds, job.staged.stat().st_size)


def describe(baked: Baked, resolution: int) -> str:
    """The line that reports a baked mesh."""
    stages = ", ".join(f"{name} {seconds:.2f}" for name, seconds in baked.seconds.items())
    parts = f"{baked.parts} parts, " if baked.parts > 1 else ""
    side = f"at most {resolution}" if baked.parts > 1 else f"{resolution}"
    return (
        f"{baked.out}: {baked.triangles} triangles, {parts}{baked.images} images of {side}², "
        f"{baked.bytes / 1e6:.1f} MB; {sum(baked.seconds.values()):.2f} s ({stages})"
    )


class _Stopwatch:
    """Seconds per stage; a stage ends where the next begins."""

    def __init__(self, announce: Callable[[str], None]) -> None:
        self._announce = announce
        self._seconds: dict[str, float] = {}
        self._stage = ""

    def start(self, stage: str) -> None:
        self.stop()
        self._announce(stage)
        self._stage, self._began = stage, time.perf_counter()

    def stop(self) -> dict[str, float]:
        if self._stage:
            elapsed = time.perf_counter() - self._began
            self._seconds[self._stage] = self._seconds.get(self._stage, 0.0) + elapsed
            self._stage = ""
        return self._seconds


@contextlib.contextmanager
def _staging(out: Path) -> Iterator[Path]:
    """A file name in a new folder beside `out`, on the same disk. The folder vanishes with whatever a killed worker
    left in it."""
    try:
        folder = tempfile.TemporaryDirectory(prefix=".bake-", dir=out.parent)
    except OSError:  # no such folder as the mesh's own, say: its job will tell
        yield out
        return
    with folder as name:
        yield Path(name) / out.name


def _run_here(jobs: Sequence[Job], stage: Stage) -> Outcomes:
    for number, job in enumerate(jobs):
        try:
            yield number, bake_job(job, lambda name, number=number: stage(number, name))  # type: ignore[misc]
        except InputError as error:
            yield number, error


def _run_parallel(jobs: Sequence[Job], stage: Stage) -> Outcomes:
    """A process per job and core. What is still running when the caller leaves is ended."""
    context = multiprocessing.get_context("spawn")
    reports = context.Queue()
    workers = min(len(jobs), os.cpu_count() or 1)
    pool = ProcessPoolExecutor(workers, context, _set_up_worker, (reports,))
    running: dict[Future[Baked], int] = {pool.submit(_work, number, job): number for number, job in enumerate(jobs)}
    try:
        while running:
            done, _ = wait(running, timeout=_POLL, return_when=FIRST_COMPLETED)
            with contextlib.suppress(queue.Empty):
                while True:
                    stage(*reports.get_nowait())
            for future in done:
                number = running.pop(future)
                try:
                    yield number, future.result()
                except InputError as error:
                    yield number, error
    finally:
        if running:
            for child in multiprocessing.active_children():
                child.terminate()
        pool.shutdown(cancel_futures=True)
        reports.close()


_reports: Any = None  # of a worker process: where it says what it does


def _set_up_worker(reports: Any) -> None:
    global _reports
    _reports = reports
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides


def _work(number: int, job: Job) -> Baked:
    return bake_job(job, lambda stage: _reports.put((number, stage)))


@contextlib.contextmanager
def _progress(names: Sequence[str]) -> Iterator[Stage]:
    """One line per mesh on stderr that says its stage."""
    if not show_progress():
        yield lambda number, stage: log.info("%s: %s", names[number], stage)
        return
    from rich.markup import escape
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), TextColumn("{task.fields[stage]}"), TimeElapsedColumn()
    with Progress(*columns, **live_options()) as progress:
        tasks = [progress.add_task(escape(name), stage="waiting", start=False) for name in names]

        def stage(number: int, name: str) -> None:
            progress.start_task(tasks[number])
            progress.update(tasks[number], stage=name)

        yield stage
