"""What reading a file costs, measured in a process of its own.

Each file is read in a process forked from one that has imported the readers and done nothing else: to fork takes
milliseconds, and the peak of memory is that of the reader.
"""

import multiprocessing
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext
from pathlib import Path

from depthwalk.errors import InputError

_READERS = (
    "costs",
    "depthwalk.ingest.ply_polygons",
    "depthwalk.ingest.trimesh_reader",
    "depthwalk.ingest.material_library",
    "depthwalk.ingest.range_image",
)
_PICTURES = (f"PIL.{kind}ImagePlugin" for kind in ("Png", "Tiff", "WebP", "Jpeg", "Gif"))
_LIBRARIES = "depthwalk.scene.loader", "depthwalk.scene.places", "OpenEXR", *_PICTURES
_MOST_SECONDS, _MOST_BYTES = 20, 3 << 30  # then the process is ended


@dataclass(frozen=True)
class Cost:
    """What became of a file: the message of the error, "" where there was none; seconds of a processor; bytes at the
    peak beyond those before."""

    message: str
    seconds: float
    bytes: int


def cost(read: Callable[[Path], object], path: Path) -> Cost:
    """What it costs to read `path`. Raises EOFError where the process was ended because it took far too much."""
    receiver, sender = _context().Pipe(duplex=False)
    process = _context().Process(target=_read, args=(read, path, sender))
    process.start()
    sender.close()
    try:
        return Cost(*receiver.recv())
    finally:
        process.join()


@cache
def _context() -> ForkServerContext:
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["__main__", *_READERS, *_LIBRARIES])
    return context


def _read(read: Callable[[Path], object], path: Path, sender: Connection) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (_MOST_SECONDS, _MOST_SECONDS))
    resource.setrlimit(resource.RLIMIT_AS, (_MOST_BYTES, _MOST_BYTES))
    before, start = _peak(), time.process_time()
    message = ""
    try:
        read(path)
    except InputError as error:
        message = str(error)
    sender.send((message, time.process_time() - start, _peak() - before))


def _peak() -> int:
    """The most bytes that this process has held in memory."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
