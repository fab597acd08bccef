"""Bake meshes to files, several at a time in separate processes.

Files that are up to date are left unchanged, so an interrupted bake continues where it stopped. Files are written
atomically, and no process outlives the caller, however that ends.
"""

import contextlib
import multiprocessing
import os
import queue
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from functools import partial
from pathlib import Path

from depthwalk.assets.bake_job import Baked, Job, Kept, UnwritableError, bake_job, staging, unwritable
from depthwalk.assets.worker import report_stage, set_up_worker, terminate
from depthwalk.cluster.tasks import TaskError
from depthwalk.errors import InputError
from depthwalk.files import remove_leftovers
from depthwalk.parallel import default_workers, usable_cores

_POLL_SECONDS = 0.1  # between checks for reports from the processes

Stage = Callable[[int, str], None]
"""Called with the number of a job, and the name of the stage that begins."""

Outcome = Baked | Kept | InputError | UnwritableError | TaskError
"""The outcome of a job; an error if its mesh cannot be used, its file not written, or it failed repeatedly on a
cluster."""

Outcomes = Generator[tuple[int, Outcome], None, None]
"""The number of a job, and its outcome."""


def bake_all(jobs: Sequence[Job], processes: int | None, stage: Stage) -> Outcomes:
    """Do jobs, and yield the outcome of each as it ends.

    Callers that leave early close the generator, which ends the running jobs.

    Parameters
    ----------
    jobs
        The jobs; all their files must differ.
    processes
        Number of jobs to do at a time; None: as many as there are cores. With 1 they are done in this process.
    stage
        Called with the number of a job and the name of the stage that begins.

    Yields
    ------
    tuple
        The number of a job, and its outcome; an error if the job failed, while the others continue.
    """
    processes = min(len(jobs), processes or usable_cores())
    with contextlib.ExitStack() as stack:
        for folder in {job.folder for job in jobs if job.folder}:
            remove_leftovers(folder)
        staged = [stack.enter_context(staging(job)) for job in jobs]
        run = _run_here(jobs, staged, stage) if processes < 2 else _run_parallel(jobs, staged, processes, stage)
        for number, outcome in stack.enter_context(contextlib.closing(run)):
            try:
                if staged[number].is_file():  # files that are up to date or were sent to a URL are not staged
                    os.replace(staged[number], jobs[number].out)
            except OSError as error:
                outcome = unwritable(jobs[number].target, error)
            yield number, outcome


def _run_here(jobs: Sequence[Job], staged: Sequence[Path], stage: Stage) -> Outcomes:
    """Do jobs one after another in this process."""
    for number, (job, file) in enumerate(zip(jobs, staged, strict=True)):
        try:
            yield number, bake_job(job, file, lambda name, number=number: stage(number, name))  # type: ignore[misc]
        except (InputError, UnwritableError) as error:
            yield number, error


def _run_parallel(jobs: Sequence[Job], staged: Sequence[Path], processes: int, stage: Stage) -> Outcomes:
    """Do jobs in the given number of processes. Jobs still running when the caller leaves are ended."""
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
                except (InputError, UnwritableError) as error:
                    yield number, error
    finally:
        if running:
            terminate(pool)
        pool.shutdown(cancel_futures=True)
        reports.close()


def _work(number: int, job: Job, staged: Path, workers: int) -> Baked | Kept:
    """Do one job in a worker process."""
    return bake_job(job, staged, partial(report_stage, number), workers)
