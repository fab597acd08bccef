"""Compute for each object what a frame decides about it, in loops that numba compiles.

NumPy does the same at the places where its arrays are used, and says what is meant: it is the reference that the tests
compare the loops with, and it serves as long as they are not loaded. For the few hundred objects of a frame NumPy
spends its time on calls, some four thousand of them; a loop does not.

`load` loads the loops, `load_behind` does so beside the frames of a window, and `loaded` returns them, or None. Who
draws a single picture never needs them, so nothing here imports numba before one of the two is called. numba is an
extra of this package, `depthwalk[fast]`; without it NumPy goes on to serve.

The compiled code is kept in the cache folder (`compiled_code`). Where that cannot be written, NumPy serves: compiling
anew in every process would take longer than it saves.
"""

import importlib.util
import logging
import os
import subprocess
import sys
import threading
from types import ModuleType

from depthwalk.render.kernels import compiled_code

_LOG = logging.getLogger(__name__)
# Behind the frames of a window; Windows has no such priority for Python to set.
_COMPILE = """
import os
if hasattr(os, "nice"):
    os.nice(10)
from depthwalk.render import kernels
kernels.load()
"""

_loops: ModuleType | None = None
_loader: threading.Thread | None = None


def loaded() -> ModuleType | None:
    """Return the module `render.kernels.loops`, whose functions serve in the place of NumPy; None before `load`."""
    return _loops


def available() -> bool:
    """Return whether numba is installed."""
    return importlib.util.find_spec("numba") is not None


def load() -> bool:
    """Load the compiled loops, which all frames from now on use.

    This takes half a second; some twenty where they are still to be compiled.

    Returns
    -------
    Whether they are loaded: not where numba is not installed, nor where the cache folder cannot be written, which a
    warning says.
    """
    global _loops
    if available() and _loops is None and compiled_code.is_writable():
        from depthwalk.render.kernels import loops

        compiled_code.mark_complete()
        compiled_code.remove_unused()
        _loops = loops
    return _loops is not None


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
    if _loops is not None or not available() or not compiled_code.is_writable():
        return
    if not compiled_code.is_complete():
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
