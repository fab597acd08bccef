"""Bake meshes to files on a cluster, whose workers see the same files by the same names."""

import hashlib
from collections.abc import Callable, Sequence

from depthwalk.assets.bake_job import Job, bake_whole
from depthwalk.assets.batch_bake import Outcomes
from depthwalk.cluster.connection import Cluster
from depthwalk.cluster.tasks import Progress, Task, run_tasks
from depthwalk.files import remove_leftovers


def bake_on(cluster: Cluster, jobs: Sequence[Job], progress: Progress, heed: Callable[[], None]) -> Outcomes:
    """Do jobs on a cluster, whose workers see the same files by the same names; yield what became of each as it ends.

    Parameters
    ----------
    cluster
        Where the meshes are baked.
    jobs
        The jobs, whose files all differ.
    progress, heed
        As for `run_tasks`.

    Yields
    ------
    tuple
        The number of a job, and what became of it.

    Raises
    ------
    ClusterError
        Where the cluster is lost for good.
    """
    folders = {job.folder for job in jobs if job.folder}
    for folder in folders:  # once, not for each of the files in it
        remove_leftovers(folder)
    tasks = [
        Task(key=f"bake-{_job_key(job)}", function=bake_whole, arguments=(job, cluster.threads_per_task))
        for job in jobs
    ]
    cluster.folders |= folders
    yield from run_tasks(cluster, tasks, progress, heed)  # type: ignore[misc]  # what `bake_whole` returns


def _job_key(job: Job) -> str:
    """Return a name for a job, 64 hex digits.

    The mesh is told by its name, size and time, since the caller would read 10⁵ meshes before the first is baked; the
    worker finds by the bytes whether there is anything to do.
    """
    try:
        status = job.spec.mesh.stat()
        state = status.st_size, status.st_mtime_ns
    except OSError:  # the job will complain of it
        state = 0, 0
    return hashlib.sha256(repr((job, state)).encode()).hexdigest()
