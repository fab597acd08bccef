"""Compute for each object what a frame decides about it, in loops that numba compiles.

NumPy does the same at the places where its arrays are used, and says what is meant: it is the reference that the tests
compare the loops with, and it serves as long as they are not loaded. For the few hundred objects of a frame NumPy
spends its time on calls, some four thousand of them; a loop does not.

`load` loads the loops, `load_behind` does so beside the frames of a window, and `loaded` returns them, or None. Who
draws a single picture never needs them, so nothing here imports numba before one of the two is called. numba is an
extra of this package, `depthwalk[fast]`; without it NumPy goes on to serve.

The compiled code is kept in the cache folder. numba looks only at the file of a function before it takes it from there,
not at what that file imports, so each state of these files has a folder of its own; those of other states are removed
when nobody has used them for some weeks. Where the cache cannot be written, NumPy serves: compiling anew in every
process would take longer than it saves.
"""

import hashlib
import importlib.util
import logging
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

from depthwalk.cache import cache_folder

_LOG = logging.getLogger(__name__)
# Behind the frames of a window; Windows has no such priority for Python to set.
_COMPILE = """
import os
if hasattr(os, "nice"):
    os.nice(10)
from depthwalk.render import kernels
kernels.load()
"""
_COMPLETE = "complete"  # a file in a folder whose loops are all compiled, as old as their last use
_UNUSED = 21 * 86_400  # seconds after which the code of another state of these files is removed

_loops: ModuleType | None = None
_loader: threading.Thread | None = None


def loaded() -> ModuleType | None:
    """Return the module `render.kernels.loops`, whose functions serve in the place of NumPy; None before `load`."""
    return _loops


def available() -> bool:
    """Return whether numba is installed."""
    return importlib.util.find_spec("numba") is not None


def folder() -> Path:
    """Return the folder in which the compiled code of these files is kept, for the version of numba that is here."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    state = b"".join(path.read_bytes() for path in sources) + version("numba").encode()
    return cache_folder().parent / "compiled" / hashlib.sha256(state).hexdigest()[:16]


def load() -> bool:
    """Load the compiled loops, which all frames from now on use.

    This takes half a second; some twenty where they are still to be compiled.

    Returns
    -------
    Whether they are loaded: not where numba is not installed, nor where the cache folder cannot be written, which a
    warning says.
    """
    global _loops
    if available() and _loops is None and _writable():
        from depthwalk.render.kernels import loops

        with suppress(OSError):  # removed meanwhile, or the disk is full
            (folder() / _COMPLETE).touch()
        _remove_unused()
        _loops = loops
    return _loops is not None


def _writable() -> bool:
    """Return whether compiled code can be kept; warn where it cannot."""
    try:
        folder().mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder()).close()
    except OSError as error:
        _LOG.warning("frames are planned by NumPy, since %s cannot be written: %s", folder(), error.strerror or error)
        return False
    return True


def _remove_unused() -> None:
    """Remove what other states of these files were compiled to, if nobody has used it for some weeks.

    The mark `complete` goes first. Whoever needs a folder that is half removed then compiles what is missing.
    """
    for other in folder().parent.iterdir():
        with suppress(OSError):  # of another process, which removes it too, or on a read-only disk
            mark = other / _COMPLETE
            used = (mark if mark.is_file() else other).stat().st_mtime
            if other != folder() and time.time() - used > _UNUSED:
                mark.unlink(missing_ok=True)
                shutil.rmtree(other)


def unload() -> None:
    """Go back to NumPy."""
    global _loops
    _loops = None


def load_behind() -> threading.Thread:
    """Load the loops beside the frames of a window; where they are still to be compiled, by a process of its own.

    Returns
    -------
    The thread that does so. Nobody need wait for it.
    """
    global _loader
    if _loader is None or not _loader.is_alive():
        _loader = threading.Thread(target=_load_behind, name="kernels", daemon=True)
        _loader.start()
    return _loader


def _load_behind() -> None:
    """Compile the loops in another process where that was not done yet, then load them."""
    if _loops is not None or not available() or not _writable():
        return
    if not (folder() / _COMPLETE).is_file():
        paths = os.pathsep.join(path for path in sys.path if path)
        done = subprocess.run(
            [sys.executable, "-c", _COMPILE],
            env=os.environ | {"PYTHONPATH": paths},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            _LOG.warning("frames are planned by NumPy, since numba fails: %s", done.stderr.strip()[-200:])
            return
    load()
