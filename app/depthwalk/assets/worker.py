"""Set up processes that bake for another one: they report their progress to it, and end with it.

Nothing here takes long to import, so that a process can import the rest while it waits for its first task.
"""

import contextlib
import importlib
import multiprocessing
import os
import signal
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from typing import Any

_IMPORTS = (  # for baking and cooking, including what their functions import when they are called
    "depthwalk.assets.bake_pool",
    "depthwalk.bake.parts",
    "embreex.mesh_construction",
    "embreex.rtcore_scene",
    "scipy.ndimage",
    "scipy.spatial.transform",
)
# The first picture comes first; but if other processes keep all cores busy, work must not wait long for the imports.
_NICENESS_OF_IMPORTS = 5

_reports: Any = None  # in a worker process: the queue for its progress reports


def set_up_worker(reports: Any) -> None:
    """Prepare a worker process: it leaves Ctrl-C to its parent, and ends with it.

    Parameters
    ----------
    reports
        The `multiprocessing` queue into which `report_stage` puts this process's stages.
    """
    global _reports
    _reports = reports
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    threading.Thread(target=_end_with_parent, daemon=True).start()


def set_up_ahead(reports: Any, niceness: int) -> None:
    """Prepare a worker process that is started before there is work: `set_up_worker`, then import what work needs.

    Parameters
    ----------
    reports
        See `set_up_worker`.
    niceness
        How much its priority is lowered. Importing ahead has even lower priority, if threads have priorities.
    """
    set_up_worker(reports)
    threading.Thread(target=_import_ahead, daemon=True).start()
    with contextlib.suppress(OSError, AttributeError):
        os.nice(niceness)


def report_stage(number: int, stage: str) -> None:
    """Report to the parent of this worker process that the stage `stage` of the job numbered `number` begins."""
    _reports.put((number, stage))


def terminate(pool: ProcessPoolExecutor) -> None:
    """End the processes of `pool`, whatever they are doing; the standard library has no public way to do so."""
    for process in list((pool._processes or {}).values()):
        process.terminate()


def _import_ahead() -> None:
    """Import what baking and cooking need; failures occur again, and are reported, where it is needed."""
    if sys.platform == "linux":  # elsewhere this would be the priority of the process
        os.nice(_NICENESS_OF_IMPORTS)
    with contextlib.suppress(ImportError):
        for name in _IMPORTS:
            importlib.import_module(name)


def _end_with_parent() -> None:
    """End this process when its parent has ended: nothing else ends the workers of a parent that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
