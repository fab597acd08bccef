"""Meshes baked to files, several at a time in processes of their own. What is baked already is left as it is, so that
who was interrupted goes on where it stopped."""

import contextlib
import multiprocessing
import os
import queue
import shutil
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from depthwalk.bake.cache import BAKED, bake_key, find_cached, read_model
from depthwalk.bake.file import write_baked
from depthwalk.bake.levels import FEWEST, RATIOS
from depthwalk.bake.parts import ModelParams, bake_model
from depthwalk.cache import forget
from depthwalk.errors import InputError
from depthwalk.files import check_folder, staging_folder
from depthwalk.ingest.loader import check_height, load_mesh
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.sources import Sources, source_hash
from depthwalk.parallel import default_workers
from depthwalk.scene.scene import MeshAsset
from depthwalk.scene.schema import DpciParams

_POLL = 0.1  # seconds between two looks at what the processes report

Stage = Callable[[int, str], None]  # number of the job, what is being done


@dataclass(frozen=True)
class Job:
    """A mesh to bake and the file to bake it to. anew: also where that file is there already; what the cache holds of
    the mesh is then made anew, too."""

    spec: MeshAsset
    params: ModelParams
    out: Path
    anew: bool = False


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


@dataclass(frozen=True)
class Kept:
    """A job that had been done before. cached: its file comes from the user's cache folder."""

    out: Path
    cached: bool


Outcome = Baked | Kept | InputError
Outcomes = Generator[tuple[int, Outcome], None, None]


def bake_all(jobs: Sequence[Job], processes: int | None, stage: Stage) -> Outcomes:
    """Does the jobs and yields the number of each with what it came to, as they end. A file appears whole or not at
    all. Whoever leaves before the end, closes the generator: what still runs then ends.

    processes: at a time, None: as many as there are cores; one works in this process. stage: told what is being done.
    """
    processes = min(len(jobs), processes or os.cpu_count() or 1)
    with contextlib.ExitStack() as stack:
        staged = [stack.enter_context(_staging(job.out)) for job in jobs]
        run = _run_here(jobs, staged, stage) if processes < 2 else _run_parallel(jobs, staged, processes, stage)
        for number, outcome in stack.enter_context(contextlib.closing(run)):
            if staged[number].is_file():  # a job that was done before leaves none
                os.replace(staged[number], jobs[number].out)
            yield number, outcome


def bake_job(job: Job, staged: Path, stage: Callable[[str], None], workers: int | None = None) -> Baked | Kept:
    """Reads and bakes one mesh and writes it to `staged`, which takes the place of `job.out` when it is whole; `stage`
    is called with the name of each stage. workers: see `thread_map`. Raises InputError."""
    clock = _Stopwatch(stage)
    clock.start("read")
    sources = Sources()
    source = source_hash(job.spec.mesh, job.spec.texture, sources)
    key = mesh_key(job.spec, job.params, source)
    check_folder(job.out)
    if job.anew:
        forget(key)
        forget(levels_key(job.spec, source))
    elif read_model(job.out, key) is not None:  # as a whole: pixels may be damaged under a header that is not
        return Kept(job.out, cached=False)
    elif find_cached(key) is not None:
        shutil.copyfile(BAKED.file(key), staged)
        return Kept(job.out, cached=True)
    mesh = read_body(job.spec, sources)
    del sources  # no file's bytes are needed any more
    clock.start("structure")  # what rays are cast against
    model = bake_model(mesh, job.params, key, clock.start, workers)
    clock.start("write")
    write_baked(staged, model)
    seconds = clock.stop()
    images = sum(len(part.images) for part in model.parts)
    return Baked(job.out, len(mesh.faces), len(model.parts), images, seconds, staged.stat().st_size)


def read_mesh(spec: MeshAsset, sources: Sources | None = None) -> Mesh:
    """The mesh in the asset's frame. sources: where its files are read from. Raises InputError."""
    return load_mesh(spec.mesh, texture=spec.texture, up=spec.up, height=spec.height, sources=sources)


def read_hashed(spec: MeshAsset) -> tuple[Mesh, str]:
    """The mesh in the asset's frame, and the `source_hash` of the bytes that it was read from. Raises InputError."""
    sources = Sources()
    mesh = read_mesh(spec, sources)
    return mesh, source_hash(spec.mesh, spec.texture, sources)


def read_body(spec: MeshAsset, sources: Sources | None = None) -> Mesh:
    """As `read_mesh`, of an asset that is to have depth images. Raises InputError where they could not show it."""
    mesh = read_mesh(spec, sources)
    check_height(mesh, spec.mesh)
    return mesh


def model_params(dpci: DpciParams) -> ModelParams:
    """How a scene wants an asset baked."""
    return ModelParams(
        resolution=dpci.resolution, layers=dpci.layers, method=dpci.method, parts=dpci.parts, axis=dpci.axis
    )


def mesh_key(spec: MeshAsset, params: ModelParams, source: str | None = None) -> str:
    """The key of a mesh asset's depth images. source: the `source_hash` of what they are baked from; None: of what its
    files hold now. Raises InputError."""
    # Defaults go without saying: files baked before there was a choice keep their keys.
    default = ModelParams()
    chosen = {name: getattr(params, name) for name in ("method", "parts", "axis")}
    return bake_key(
        source or source_hash(spec.mesh, spec.texture),
        up=spec.up,
        height=spec.height,
        resolution=params.resolution,
        layers=params.layers,
        **{name: value for name, value in chosen.items() if value != getattr(default, name)},
    )


def levels_key(spec: MeshAsset, source: str) -> str:
    """The key of a mesh asset's simplified levels. source: the `source_hash` of the mesh that they are made of."""
    return bake_key(source, up=spec.up, height=spec.height, ratios=RATIOS, fewest=FEWEST)


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
    left in it; where this process is killed, the next bake to the same place removes it."""
    try:
        folder = staging_folder(out.parent)
    except OSError:  # no such folder as the mesh's own, say: its job will tell
        yield out.with_name(f".{out.name}")
        return
    with folder as name:
        yield Path(name) / out.name


def _run_here(jobs: Sequence[Job], staged: Sequence[Path], stage: Stage) -> Outcomes:
    for number, (job, file) in enumerate(zip(jobs, staged, strict=True)):
        try:
            yield number, bake_job(job, file, lambda name, number=number: stage(number, name))  # type: ignore[misc]
        except InputError as error:
            yield number, error


def _run_parallel(jobs: Sequence[Job], staged: Sequence[Path], processes: int, stage: Stage) -> Outcomes:
    """A process per job, so many at a time. What is still running when the caller leaves is ended."""
    context = multiprocessing.get_context("spawn")
    reports = context.Queue()
    pool = ProcessPoolExecutor(processes, context, _set_up_worker, (reports,))
    work, workers = enumerate(zip(jobs, staged, strict=True)), default_workers(processes)
    running: dict[Future[Baked | Kept], int] = {
        pool.submit(_work, number, *job, workers): number for number, job in work
    }
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
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Nobody ends the workers of a parent that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _work(number: int, job: Job, staged: Path, workers: int) -> Baked | Kept:
    return bake_job(job, staged, lambda stage: _reports.put((number, stage)), workers)
