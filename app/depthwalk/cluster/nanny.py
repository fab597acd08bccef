"""Start worker processes quickly: fork each from one process that has imported what tasks need.

A worker started from nothing spends more than a second of processor time on imports, every time one is lost. Dask's
nannies start workers as `multiprocessing` does. With its method "forkserver", a process without threads imports once,
and is forked for each worker. OpenGL contexts are created after the fork, by the tasks.

The nannies of a cluster on other machines do the same if they are given `--preload-nanny depthwalk.cluster.nanny`, and
they outlive their scheduler.
"""

import multiprocessing
import os
import sys
from typing import Any

# By name, since most lie above this package: the process that is forked imports them, this one need not. The later
# ones are what functions import when they are called.
PRELOADED = (
    "distributed.nanny",
    "distributed.cli.dask_worker",
    "distributed.comm.tcp",
    "distributed.http.health",
    "distributed.http.statics",
    "distributed.http.worker.prometheus",
    "multiprocessing.popen_forkserver",
    "multiprocessing.synchronize",
    "tornado.platform.asyncio",
    "depthwalk.cluster.lasting_worker",
    "depthwalk.commands.cli",
    "depthwalk.assets.batch_bake",
    "depthwalk.commands.comparison",
    "depthwalk.commands.frame_chunks",
    "depthwalk.ingest.trimesh_reader",
    "depthwalk.bake.parts",
    "depthwalk.scene.scatter",
    "PIL.JpegImagePlugin",
    "PIL.PngImagePlugin",
    "embreex.mesh_construction",
    "embreex.rtcore_scene",
    "glcontext.egl",
    "scipy.interpolate",
    "scipy.ndimage",
    "scipy.spatial.transform",
)
_IMPORTER = "depthwalk.commands.worker_start"

_TICK_MS = 500  # between checks of whether a server still responds

# Dask's monitoring of workers and nannies costs one core in twenty, and is not used here.
_CONFIG = {
    "distributed.admin.tick.interval": f"{_TICK_MS}ms",  # by default fifty times a second, a hundredth of a core
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.gil.enabled": False,
    "distributed.scheduler.active-memory-manager.start": False,
    "distributed.worker.daemon": False,  # since FLIP and measured bakes start processes of their own
}
# With Dask's value, the C library returns every large array to the system at once, and the next one is zeroed: until
# the second frame there are twice as many page faults.
_UNSET = ("MALLOC_TRIM_THRESHOLD_",)
# Use huge pages for large arrays, with glibc on systems that provide them on request: a worker touches 150 MB for its
# first frame, with a tenth of the page faults.
_SET = {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"}


def worker_config() -> dict[str, object]:
    """Return Dask's configuration for nannies and their workers, which are forked if the system supports it.

    Windows cannot fork, and libraries of macOS may not be used in forked processes.
    """
    can_fork = sys.platform != "darwin" and "forkserver" in multiprocessing.get_all_start_methods()
    variables = {f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in _environment().items()}
    return _CONFIG | variables | ({"distributed.worker.multiprocessing-method": "forkserver"} if can_fork else {})


def _environment() -> dict[str, str | None]:
    """Return the environment for workers, with None to unset what Dask would set; the user's own variables stay."""
    return dict.fromkeys(_UNSET) | {name: os.environ.get(name, value) for name, value in _SET.items()}


def preload() -> None:
    """Make the process from which workers are forked import what tasks need; `worker_config` must be in effect."""
    from distributed.utils import get_mp_context

    context = get_mp_context()
    if context.get_start_method() == "forkserver":
        context.set_forkserver_preload([_IMPORTER])  # instead of Dask's list, which `get_mp_context` has set


def ask_versions() -> None:
    """Cache the versions that workers report to the scheduler, before any is forked: finding them starts a program."""
    from distributed.versions import get_versions

    get_versions()


def dask_setup(nanny: Any) -> None:
    """Prepare a nanny; Dask calls this when it preloads the module, before the nanny has a worker."""
    import dask

    from depthwalk.cluster.lasting_worker import LastingWorker

    dask.config.set(worker_config())
    # It has already copied the configuration, including the environment.
    nanny.config = dask.config.merge(nanny.config, dask.config.config)
    for name, value in _environment().items():
        nanny.env.pop(name, None)
        if value is None:
            nanny.pre_spawn_env.pop(name, None)
        else:
            nanny.pre_spawn_env[name] = value
    nanny.periodic_callbacks["tick"].callback_time = _TICK_MS  # likewise
    nanny.Worker = LastingWorker
    preload()
