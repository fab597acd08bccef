"""Start worker processes quickly: fork each from one process that has imported what tasks need.

A worker that starts from nothing spends more than a second of a processor on imports, for each one that is lost. Dask's
nannies start workers as `multiprocessing` does; by its method "forkserver" a process without threads imports once, and
is forked for each worker. OpenGL contexts are created after the fork, by the tasks.

The nannies of a cluster on other machines do the same where they are given `--preload-nanny depthwalk.cluster.nanny`,
and outlive their scheduler.
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

_TICK_MS = 500  # between two looks at whether a server still answers

# What watches workers and nannies costs one core in twenty, and nobody looks at it here.
_CONFIG = {
    "distributed.admin.tick.interval": f"{_TICK_MS}ms",  # by default fifty times a second, a hundredth of a core
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.gil.enabled": False,
    "distributed.scheduler.active-memory-manager.start": False,
    "distributed.worker.daemon": False,  # FLIP and measured bakes start processes of their own
}
# With Dask's value the C library gives every large array back to the system at once, and the next one is zeroed: until
# the second frame there are twice as many page faults.
_UNSET = ("MALLOC_TRIM_THRESHOLD_",)
# Large arrays in huge pages, where the C library is glibc and the system has such pages for who asks for them: a worker
# touches 150 MB for its first frame, in a tenth as many page faults.
_SET = {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"}


def worker_config() -> dict[str, object]:
    """Return Dask's configuration for nannies and their workers, which are forked where the system bears it.

    Windows cannot fork, and libraries of macOS may not be used in forked processes.
    """
    can_fork = sys.platform != "darwin" and "forkserver" in multiprocessing.get_all_start_methods()
    variables = {f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in _environment().items()}
    return _CONFIG | variables | ({"distributed.worker.multiprocessing-method": "forkserver"} if can_fork else {})


def _environment() -> dict[str, str | None]:
    """Return the variables that workers start with, None for one that Dask would set; the user's own ones stay."""
    return dict.fromkeys(_UNSET) | {name: os.environ.get(name, value) for name, value in _SET.items()}


def preload() -> None:
    """Have the process that workers are forked from import what tasks need; `worker_config` must be in force."""
    from distributed.utils import get_mp_context

    context = get_mp_context()
    if context.get_start_method() == "forkserver":
        context.set_forkserver_preload([_IMPORTER])  # in the place of Dask's list, which `get_mp_context` has made


def ask_versions() -> None:
    """Find out, before a worker is forked, what each tells the scheduler: Python starts a program for it, but once."""
    from distributed.versions import get_versions

    get_versions()


def dask_setup(nanny: Any) -> None:
    """Prepare a nanny; Dask calls this where it preloads the module, before the nanny has a worker."""
    import dask

    from depthwalk.cluster.lasting_worker import LastingWorker

    dask.config.set(worker_config())
    # It has copied the configuration already, and of that the environment.
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
