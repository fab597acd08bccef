"""Bake meshes to files, several at a time in processes of their own.

Files that are up to date are left as they are, so that an interrupted bake goes on where it stopped. A file appears
whole or not at all, and no process outlives the caller, however that ends.
"""

import contextlib
import multiprocessing
import os
import queue
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from depthwalk.assets.asset_files import clusters_key, levels_key, mesh_key, mesh_source, read_body
from depthwalk.assets.worker import report_stage, set_up_worker, terminate
from depthwalk.bake.cache import BAKED, find_cached, read_model
from depthwalk.bake.coverage import measure_left_out
from depthwalk.bake.file import write_baked
from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import bake_model
from depthwalk.cache import forget
from depthwalk.cluster.store import fetch_file, send_file
from depthwalk.cluster.tasks import TaskError
from depthwalk.cook.cook import GRID_TEXELS, CookOptions, cook_object
from depthwalk.cook.cooked_file import cooked_key, read_cooked, write_cooked
from depthwalk.errors import InputError
from depthwalk.files import check_folder, copy, remove_leftovers, staging_folder, temporary_folder
from depthwalk.ingest.formats import is_cooked_file
from depthwalk.ingest.sources import Sources
from depthwalk.parallel import default_workers, usable_cores
from depthwalk.scene.scene import MeshAsset

_POLL_SECONDS = 0.1  # between two looks at what the processes report

Stage = Callable[[int, str], None]
"""Called with the number of a job, and the name of the stage that begins."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """Say which mesh to bake, and to which file.

    Attributes
    ----------
    spec
        The asset whose mesh is baked.
    params
        How it is baked.
    out
        The file, which is replaced where it exists; it holds cooked depth images where its name ends in `.dpci.npz`.
    url
        Where the file is stored instead, by a driver of fsspec; `out` then is a bare name. "" stores it at `out`.
    force
        Whether to bake although the file, or one in the cache, is up to date; the cache then forgets the mesh, too.
    """

    spec: MeshAsset
    params: ModelParams
    out: Path
    url: str = ""
    force: bool = False

    @property
    def target(self) -> Path | str:
        """Return where the file is stored."""
        return self.url or self.out

    @property
    def folder(self) -> Path | None:
        """Return the folder in which the file appears; None where that is none of this machine."""
        return None if self.url else self.out.parent


@dataclass(frozen=True, kw_only=True)
class Baked:
    """Report that a job baked its mesh.

    Attributes
    ----------
    out
        The file, or its URL.
    triangles
        Number of triangles of the mesh.
    parts
        Number of objects that the mesh was divided into.
    images
        Number of depth images that hold samples.
    seconds
        Seconds that each stage took, in the order of the stages.
    bytes
        Size of the file.
    left_out
        The part of the visible surface that no image holds, 0 to 1.
    """

    out: Path | str
    triangles: int
    parts: int
    images: int
    seconds: dict[str, float]
    bytes: int
    left_out: float


@dataclass(frozen=True)
class Kept:
    """Report that a job needed no bake.

    Attributes
    ----------
    out
        The file, or its URL.
    cached
        Whether the file was copied from the user's cache folder; else it was there and up to date.
    """

    out: Path | str
    cached: bool


Outcome = Baked | Kept | InputError | TaskError
"""What a job came to; the error of one whose mesh cannot be used, or that failed on a cluster again and again."""

Outcomes = Generator[tuple[int, Outcome], None, None]
"""The number of a job, and what it came to."""


def bake_all(jobs: Sequence[Job], processes: int | None, stage: Stage) -> Outcomes:
    """Do jobs, and yield what became of each as it ends.

    Callers that leave before the end close the generator, which ends what still runs.

    Parameters
    ----------
    jobs
        The jobs, whose files all differ.
    processes
        How many jobs to do at a time; None: as many as there are cores. With one they are done in this process.
    stage
        Called with the number of a job and the name of the stage that it begins.

    Yields
    ------
    tuple
        The number of a job, and what became of it; an InputError where the job failed, while the others go on.
    """
    processes = min(len(jobs), processes or usable_cores())
    with contextlib.ExitStack() as stack:
        for folder in {job.folder for job in jobs if job.folder}:
            remove_leftovers(folder)
        staged = [stack.enter_context(_staging(job)) for job in jobs]
        run = _run_here(jobs, staged, stage) if processes < 2 else _run_parallel(jobs, staged, processes, stage)
        for number, outcome in stack.enter_context(contextlib.closing(run)):
            try:
                if staged[number].is_file():  # neither a file that is up to date nor one that has been sent is staged
                    os.replace(staged[number], jobs[number].out)
            except OSError as error:
                outcome = _unwritable(jobs[number].target, error)
            yield number, outcome


def bake_whole(job: Job, workers: int | None = None) -> Baked | Kept:
    """Do a job, so that its file appears whole or not at all; `workers` and errors are those of `bake_job`."""
    with _staging(job) as staged:
        outcome = bake_job(job, staged, lambda stage: None, workers)
        try:
            if staged.is_file():
                os.replace(staged, job.out)
        except OSError as error:
            raise _unwritable(job.target, error) from error
        return outcome


def bake_job(job: Job, staged: Path, stage: Callable[[str], None], workers: int | None = None) -> Baked | Kept:
    """Bake a mesh to a file, unless the file is up to date or can be copied from the cache.

    Parameters
    ----------
    job
        The job.
    staged
        Where to write the file; the caller moves it to `job.out` when it is whole. Nothing is written where `job.out`
        is up to date, and nothing stays where the file is stored at a URL.
    stage
        Called with the name of each stage as it begins.
    workers
        How many threads to use; None: as many as `default_workers` returns.

    Returns
    -------
    Baked | Kept
        What was done.

    Raises
    ------
    InputError
        Where the mesh cannot be used or the file cannot be written.
    OSError
        Where a URL cannot be reached.
    """
    outcome = _make(job, staged, stage, workers)
    if job.url and staged.is_file():
        stage("store")
        try:
            send_file(staged, job.url)
        finally:  # else the caller would move it
            staged.unlink()
    return outcome


def _make(job: Job, staged: Path, stage: Callable[[str], None], workers: int | None) -> Baked | Kept:
    """Write the file of a job to `staged`, unless it is up to date; see `bake_job`."""
    cooked = is_cooked_file(job.out)
    clock = _Stopwatch(stage)
    clock.start("read")
    sources = Sources()
    source = mesh_source(job.spec, sources)
    key = mesh_key(job.spec, job.params, source)
    if not job.url:
        check_folder(job.out)
    if job.force:
        forget(key)
        forget(levels_key(job.spec, source))
        forget(clusters_key(job.spec, source))
    elif _is_stored(job, staged, key):
        return Kept(job.target, cached=False)
    elif not cooked and find_cached(key) is not None and _copied(BAKED.file(key), staged):
        return Kept(job.target, cached=True)
    mesh = read_body(job.spec, sources)
    del sources  # frees the bytes of the files
    clock.start("structure")  # that rays are cast against
    # Cooking makes its own coarse levels of larger images, from the finest grids.
    max_stepped = GRID_TEXELS if cooked else None
    model = bake_model(mesh, job.params, key, clock.start, workers, max_stepped)
    clock.start("coverage")
    left_out = measure_left_out(mesh, model)
    clock.start("cook" if cooked else "write")
    try:
        if cooked:
            write_cooked(staged, key, tuple(cook_object(part, CookOptions()) for part in model.parts), left_out)
        else:
            write_baked(staged, replace(model, left_out=left_out))
    except OSError as error:
        raise _unwritable(job.target, error) from error
    return Baked(
        out=job.target,
        triangles=len(mesh.faces),
        parts=len(model.parts),
        images=sum(len(part.images) for part in model.parts),
        seconds=clock.stop(),
        bytes=staged.stat().st_size,
        left_out=left_out,
    )


def _copied(cached: Path, staged: Path) -> bool:
    """Copy a file of the cache, and return whether that worked: another process may have removed it to make room."""
    try:
        copy(cached, staged)
    except OSError:
        return False
    return True


def _unwritable(out: Path | str, error: OSError) -> InputError:
    """Return the complaint that the file of one job cannot be written; the other jobs go on."""
    return InputError(f"{out}: cannot be written: {error.strerror or error}")


def _is_stored(job: Job, staged: Path, key: str) -> bool:
    """Return whether the file of a job is up to date; one at a URL is fetched to a name beside `staged` and read."""
    if not job.url:
        return _is_up_to_date(job.out, key)
    fetched = staged.with_name(f"stored-{staged.name}")
    try:
        return fetch_file(job.url, fetched) and _is_up_to_date(fetched, key)
    finally:
        fetched.unlink(missing_ok=True)


def _is_up_to_date(file: Path, key: str) -> bool:
    """Return whether a file holds the depth images of `key`, cooked or not, undamaged."""
    # Read as a whole: its pixels may be damaged though its header is not.
    if not is_cooked_file(file):
        return read_model(file, key) is not None
    try:
        return cooked_key(file) == key and all(cooked.load() for cooked in read_cooked(file))
    except InputError:
        return False


class _Stopwatch:
    """Measure the stages of a job; a stage ends where the next begins."""

    def __init__(self, announce: Callable[[str], None]) -> None:
        """Measure nothing yet. announce: called with the name of each stage that begins."""
        self._announce = announce
        self._seconds: dict[str, float] = {}
        self._stage = ""

    def start(self, stage: str) -> None:
        """Begin a stage, which may have been measured before."""
        self.stop()
        self._announce(stage)
        self._stage, self._began = stage, time.perf_counter()

    def stop(self) -> dict[str, float]:
        """End the last stage; return the seconds that each took."""
        if self._stage:
            elapsed = time.perf_counter() - self._began
            self._seconds[self._stage] = self._seconds.get(self._stage, 0.0) + elapsed
            self._stage = ""
        return self._seconds


@contextlib.contextmanager
def _staging(job: Job) -> Iterator[Path]:
    """Provide a file name in a new folder: beside the file of a job, on the same disk, or in one for temporary files.

    The folder is removed with whatever a worker that was ended left in it. Where this process is killed, the next bake
    to the same place removes it.
    """
    try:
        folder = staging_folder(job.folder) if job.folder else temporary_folder()
    except OSError:  # the folder does not exist, say: the job will complain of it
        yield job.out.with_name(f".{job.out.name}")
        return
    with folder as name:
        yield Path(name) / job.out.name


def _run_here(jobs: Sequence[Job], staged: Sequence[Path], stage: Stage) -> Outcomes:
    """Do jobs one after another in this process."""
    for number, (job, file) in enumerate(zip(jobs, staged, strict=True)):
        try:
            yield number, bake_job(job, file, lambda name, number=number: stage(number, name))  # type: ignore[misc]
        except InputError as error:
            yield number, error


def _run_parallel(jobs: Sequence[Job], staged: Sequence[Path], processes: int, stage: Stage) -> Outcomes:
    """Do jobs in so many processes. Those that still run when the caller leaves are ended."""
    context = multiprocessing.get_context("spawn")
    reports = context.Queue()
    pool = ProcessPoolExecutor(processes, context, set_up_worker, (reports,))
    workers = default_workers(processes)
    running: dict[Future[Baked | Kept], int] = {}
    try:
        for number, job in enumerate(zip(jobs, staged, strict=True)):
            running[pool.submit(_work, number, *job, workers)] = number
        while running:
            done, _ = wait(running, timeout=_POLL_SECONDS, return_when=FIRST_COMPLETED)
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
            terminate(pool)
        pool.shutdown(cancel_futures=True)
        reports.close()


def _work(number: int, job: Job, staged: Path, workers: int) -> Baked | Kept:
    """Do one job in a worker process."""
    return bake_job(job, staged, partial(report_stage, number), workers)
