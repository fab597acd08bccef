"""Keep the code that numba compiles in the cache folder.

numba only checks whether the file of a function has changed, not the files that it imports. So each state of the files
of a package of loops has its own folder; folders that have not been used for some weeks are removed. To the state
belong the files' place and time: where these differ, numba compiles again, whatever the files hold.
"""

import gc
import hashlib
import importlib
import importlib.util
import logging
import shutil
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any

from depthwalk.cache import cache_folder

try:
    import fcntl
except ImportError:  # Windows, where two processes may compile the same
    fcntl = None  # type: ignore[assignment]

log = logging.getLogger(__name__)

_COMPLETE = "complete"  # a file in a folder whose loops are all compiled; its time is that of their last use
_LOCK = "lock"  # a file in such a folder, locked by the process that compiles
_KEEPING = threading.RLock()  # numba has one folder for all code that is compiled at a time
_COLLECTS_SELDOM = 20_000, 10, 20  # thresholds of `gc`, whose searches would take a tenth of the time to compile
_UNUSED = 21 * 86_400  # seconds after which the code of another state of files is removed


def is_available() -> bool:
    """Return whether numba is installed."""
    return importlib.util.find_spec("numba") is not None


def folder(loops: Path) -> Path:
    """Return the folder for the compiled code of a package, in its present state and for the installed numba.

    loops: the folder with the package's files; all functions take it.
    """
    sources = [*sorted(loops.glob("*.py")), Path(__file__).with_name("compilation.py")]
    state = b"".join(path.read_bytes() for path in sources) + version("numba").encode()
    state += "".join(f"{path.absolute()} {path.stat().st_mtime_ns} " for path in sources).encode()
    return cache_folder().parent / "compiled" / hashlib.sha256(state).hexdigest()[:16]


def is_writable(loops: Path, purpose: str) -> bool:
    """Return whether compiled code can be kept; if not, log a warning that names what the loops do."""
    try:
        folder(loops).mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder(loops)).close()
    except OSError as error:
        log.warning(
            "%s by NumPy, which is slower, since %s cannot be written: %s",
            purpose,
            folder(loops),
            error.strerror or error,
        )
        return False
    return True


_failed: set[Path] = set()  # packages of loops with which numba has failed


def loaded(loops: Path, module: str, purpose: str) -> ModuleType | None:
    """Import a module of loops, compiling what is not compiled yet; half a second if all is, some twenty if nothing is.

    Parameters
    ----------
    loops
        The folder with the package's files.
    module
        The full name of the module that imports all its loops.
    purpose
        What the loops do, for the warning.

    Returns
    -------
    ModuleType | None
        The module; None where numba is not installed, or, with a warning, where it fails or the cache folder cannot be
        written.
    """
    if loops in _failed or not is_available() or not is_writable(loops, purpose):
        return None
    try:
        with kept(loops):
            return importlib.import_module(module)
    except Exception as error:  # of any kind, where numba does not fit NumPy or the processor
        _failed.add(loops)
        reason = str(error).strip()[:200] or type(error).__name__
        log.warning("%s by NumPy, which is slower, since numba fails: %s", purpose, reason)
        return None


@contextmanager
def kept(loops: Path) -> Iterator[None]:
    """Let numba keep in the package's folder what is compiled within the `with` block; record that it is complete.

    If another process is compiling the same at this time, wait for it, and read what it has compiled.
    """
    with _KEEPING, _alone(loops):
        import numba

        config: Any = numba.config
        default, config.CACHE_DIR = config.CACHE_DIR, str(folder(loops))
        thresholds = gc.get_threshold()
        gc.set_threshold(*_COLLECTS_SELDOM)
        try:
            yield
        finally:
            gc.set_threshold(*thresholds)
            config.CACHE_DIR = default  # for other users of numba in this process
    mark_complete(loops)
    remove_unused(loops)


@contextmanager
def _alone(loops: Path) -> Iterator[None]:
    """Let one process at a time into the `with` block, unless all loops are compiled or the folder cannot be locked."""
    if fcntl is None or is_complete(loops):
        yield
        return
    with (folder(loops) / _LOCK).open("wb") as file:
        with suppress(OSError):  # some network file systems have no locks
            fcntl.flock(file, fcntl.LOCK_EX)  # given back when the file is closed, or the process ends
        yield


def is_complete(loops: Path) -> bool:
    """Return whether all loops are compiled, so that loading them only reads files."""
    return (folder(loops) / _COMPLETE).is_file()


def mark_complete(loops: Path) -> None:
    """Record that all loops are compiled, and used now."""
    with suppress(OSError):  # the folder was removed meanwhile, or the disk is full
        (folder(loops) / _COMPLETE).touch()


def remove_unused(loops: Path) -> None:
    """Remove the compiled code of other states of files that has not been used for some weeks.

    The mark `complete` is removed first, so that a process that needs a half removed folder compiles what is missing.
    """
    for other in folder(loops).parent.iterdir():
        with suppress(OSError):  # another process removes it too, or the disk is read-only
            mark = other / _COMPLETE
            used = (mark if mark.is_file() else other).stat().st_mtime
            if other != folder(loops) and time.time() - used > _UNUSED:
                mark.unlink(missing_ok=True)
                shutil.rmtree(other)
