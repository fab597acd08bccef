"""Bake meshes to files on a cluster whose workers see the same files under the same names."""

import hashlib
from collections.abc import Callable, Sequence

from depthwalk.assets.bake_job import Job, bake_whole
from depthwalk.assets.batch_bake import Outcomes
from depthwalk.cluster.connection import Cluster
from depthwalk.cluster.tasks import Progress, Task, run_tasks
from depthwalk.files import remove_leftovers


def bake_on(cluster: Cluster, jobs: Sequence[Job], progress: Progress, check_interrupt: Callable[[], None]) -> Outcomes:
    """Do jobs on a cluster whose workers see the same files under the same names; yield each outcome as the job ends.

    Parameters
    ----------
    cluster
        The cluster that bakes the meshes.
    jobs
        The jobs; all their files must differ.
    progress, check_interrupt
        As in `run_tasks`.

    Yields
    ------
    tuple
        The number of a job, and its outcome.

    Raises
    ------
    ClusterError
        If the cluster is lost for good.
    """
    folders = {job.folder for job in jobs if job.folder}
    for folder in folders:  # once, not for each of its files
        remove_leftovers(folder)
    tasks = [
        Task(key=f"bake-{_job_key(job)}", function=bake_whole, arguments=(job, cluster.threads_per_task))
        for job in jobs
    ]
    cluster.folders |= folders
    yield from run_tasks(cluster, tasks, progress, check_interrupt)  # type: ignore[misc]  # the results of `bake_whole`


def _job_key(job: Job) -> str:
    """Return a name for a job, 64 hex digits.

    The mesh is identified by its name, size and time, since hashing would make the caller read 10⁵ meshes before the
    first is baked; the worker determines from the bytes whether there is anything to do.
    """
    try:
        status = job.spec.mesh.stat()
        state = status.st_size, status.st_mtime_ns
    except OSError:  # the job will report it
        state = 0, 0
    return hashlib.sha256(repr((job, state)).encode()).hexdigest()
