"""Bake and cook single assets in other processes, which report their progress, into the cache or a folder beside it."""

import contextlib
import multiprocessing
import os
import queue
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.worker import report_stage, set_up_ahead, terminate
from depthwalk.cook.cook import CookOptions
from depthwalk.cook.cooked_file import find_cooked, write_cooked
from depthwalk.files import temporary_folder
from depthwalk.ingest.formats import COOKED_SUFFIX
from depthwalk.ingest.mesh import Mesh
from depthwalk.scene.scene import Asset

_NICENESS = 2  # of the processes that bake: frames come first, but baking must not starve
_MOST_HANDED_OVER = 64e6  # bytes of a mesh: copying more would delay a frame, and such files are read quickly
_PATIENCE = 2.0  # seconds until processes that were ended are gone; they take some milliseconds


class BakePool:
    """Own the processes that bake, or the thread, and the folder for results that the cache cannot store.

    Attributes
    ----------
    executor
        Runs the bakes; None before the first `begin`, and after `end`.
    """

    def __init__(self) -> None:
        self.executor: Executor | None = None
        self._lock = threading.Lock()
        self._closed = False
        self._manager: Any = None  # the thread of the executor that was ended last
        self._reports: Any = None
        self._spill: TemporaryDirectory[str] | None = None

    def begin(self, processes: int | None) -> None:
        """Start the executor, unless it exists; a process begins to import. Threads may call this, too.

        Parameters
        ----------
        processes
            Number of processes; None: as many as there are cores; 0: a thread of this process.
        """
        with self._lock:
            if self.executor is not None or self._closed:
                return
            if processes == 0:
                self._reports, self.executor = queue.Queue(), ThreadPoolExecutor(1, "bake")
                return
            context = multiprocessing.get_context("spawn")
            self._reports = context.Queue()
            set_up = set_up_ahead, (self._reports, _NICENESS)
            self.executor = ProcessPoolExecutor(processes or os.cpu_count() or 1, context, *set_up)
            self.executor.submit(os.getpid)  # processes are started only when there is something to do

    def submit(
        self, asset: int, spec: Asset, options: CookOptions, read: tuple[Mesh, str] | None
    ) -> "Future[str | None]":
        """Submit an asset for baking and cooking; `begin` must have been called.

        Parameters
        ----------
        asset
            Its number, under which its stages are reported.
        spec
            The asset.
        options
            How it is cooked.
        read
            Its mesh, and the hash of the bytes that it was read from; None if it has not been read yet.

        Returns
        -------
        Future[str | None]
            None if the cache stores the result; otherwise the file that holds it.
        """
        assert self.executor is not None
        if self._spill is None:
            self._spill = temporary_folder()
        out = str(Path(self._spill.name) / f"{asset}-{'-'.join(str(int(chosen)) for chosen in options)}{COOKED_SUFFIX}")
        in_process = isinstance(self.executor, ProcessPoolExecutor)
        report = partial(report_stage, asset) if in_process else partial(_put, self._reports, asset)
        if read is not None and read[0].nbytes > _MOST_HANDED_OVER:
            read = None
        return self.executor.submit(_make, spec, read, options, out, report)

    def reports(self) -> Iterator[tuple[int, str]]:
        """Yield the reports since the last call: the number of an asset, and the stage that began."""
        with contextlib.suppress(queue.Empty, OSError, EOFError):
            while self._reports is not None:
                yield self._reports.get_nowait()

    def end(self) -> None:
        """End the processes; `begin` starts others. A thread finishes its current task."""
        with self._lock:
            if self.executor is None:
                return
            if isinstance(self.executor, ProcessPoolExecutor):
                self._manager = getattr(self.executor, "_executor_manager_thread", None)
                terminate(self.executor)
                self._reports.close()
            self.executor.shutdown(wait=False, cancel_futures=True)
            self.executor = self._reports = None

    def close(self) -> None:
        """End the processes for good, and remove the files that were written outside the cache."""
        with self._lock:
            self._closed = True  # a thread may be about to start a process
        self.end()
        if self._manager is not None:
            # If Python ends while the executor's thread closes its pipe, it may write to that pipe, and show an error.
            self._manager.join(_PATIENCE)
        if self._spill is not None:
            with contextlib.suppress(OSError):
                self._spill.cleanup()
            self._spill = None


def _put(reports: "queue.Queue[tuple[int, str]]", asset: int, stage: str) -> None:
    """Report a stage from a thread of the drawing program."""
    reports.put((asset, stage))


def _make(
    spec: Asset, read: tuple[Mesh, str] | None, options: CookOptions, out: str, report: Callable[[str], None]
) -> str | None:
    """Bake and cook an asset into the cache; if that cannot store it, into the file `out`, which is returned.

    Parameters
    ----------
    spec
        The asset.
    read
        Its mesh, and the hash of the bytes that it was read from; None if it has not been read yet.
    options
        How it is cooked.
    out
        The file to write if the cache stores nothing.
    report
        Called with the name of each stage.
    """
    library = SceneLibrary((spec,), lambda name, stage: report(stage))
    if read is not None:
        library.take_mesh(0, *read)
    objects = library.cooked(0, options)
    if find_cooked(library.key(0), options) is not None:
        return None
    write_cooked(Path(out), library.key(0), objects)
    return out
