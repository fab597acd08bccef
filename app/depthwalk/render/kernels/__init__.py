"""Plan frames in loops over objects that numba compiles, in place of NumPy.

The NumPy code in the other folders computes the same. It is the reference that the tests compare the loops with, and is
used as long as they are not loaded. For the few hundred objects of a frame, NumPy spends its time on the overhead of
some four thousand calls, which compiled loops avoid.

`load` loads the loops, `load_behind` does so in the background of a window, and `loaded` returns them, or None. A
single picture never needs them, so nothing here imports numba before one of the two is called. numba is an extra of
this package, `depthwalk[fast]`; without it NumPy is used.

`depthwalk.kernels` keeps the compiled code in the cache folder. If that cannot be written, NumPy is used, as compiling
in every process would take longer than it saves.
"""

import gc
import logging
import os
import subprocess
import sys
import threading
from pathlib import Path
from types import ModuleType

from depthwalk.kernels import compiled_code

_LOG = logging.getLogger(__name__)
_FILES = Path(__file__).parent
_PURPOSE = "frames are planned"
# At low priority, so that frames of a window come first; on Windows Python cannot set one.
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
    """Return the module `render.kernels.loops`, whose functions replace NumPy code; None before `load`."""
    return _loops


def available() -> bool:
    """Return whether numba is installed."""
    return compiled_code.is_available()


def load() -> bool:
    """Load the compiled loops, which all later frames use.

    This takes half a second; some twenty if they must be compiled first.

    Returns
    -------
    Whether they are loaded. They are not if numba is not installed, or, with a warning, if it fails or the cache folder
    cannot be written.
    """
    global _loops
    if available() and _loops is None:
        _loops = compiled_code.loaded(_FILES, f"{__name__}.loops", _PURPOSE)
    return _loops is not None


def unload() -> None:
    """Go back to NumPy."""
    global _loops
    _loops = None


def load_behind() -> threading.Thread:
    """Load the loops in a background thread; if they must be compiled first, in a separate process.

    Returns
    -------
    The thread, which need not be joined.
    """
    global _loader
    if _loader is None or not _loader.is_alive():
        _loader = threading.Thread(target=_load_behind, name="kernels", daemon=True)
        _loader.start()
    return _loader


def _load_behind() -> None:
    """Compile the loops in another process unless they are compiled, then load them."""
    if _loops is not None or not available() or not compiled_code.is_writable(_FILES, _PURPOSE):
        return
    if not compiled_code.is_complete(_FILES):
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
            _LOG.warning(
                "frames are planned by NumPy, which is slower, since numba fails: %s", done.stderr.strip()[-200:]
            )
            return
    # Searching what numba creates while it loads, and once more later, would stop frames for some 100 ms in all.
    collects = gc.isenabled()
    gc.disable()
    try:
        load()
    finally:
        if collects:
            gc.freeze()
            gc.enable()
