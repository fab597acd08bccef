"""Build mesh clusters in loops that numba compiles, in place of NumPy.

`cook.group_collapse`, `cook.cluster_error` and `geometry.spatial_order` compute the same with NumPy: the tests compare
both, and without numba, an extra of this package, they are used. Loops are loaded for large meshes only: compiling them
takes longer than NumPy takes for a small one.
"""

import logging
from pathlib import Path
from types import ModuleType

from depthwalk.kernels import compiled_code

_LOG = logging.getLogger(__name__)
_FILES = Path(__file__).parent
_WORTHWHILE = 200_000  # triangles of a mesh from which loops are compiled for it

_loops: ModuleType | None = None
_failed = False  # numba is installed, but does not work


def loaded() -> ModuleType | None:
    """Return the module `cook.kernels.loops`, whose functions replace NumPy code; None before `load`."""
    return _loops


def load() -> bool:
    """Load the compiled loops; return whether they are.

    They are not if numba is not installed, or, with a warning, if it fails or the cache folder cannot be written.
    """
    global _loops, _failed
    if (
        _loops is None
        and not _failed
        and compiled_code.is_available()
        and compiled_code.is_writable(_FILES, "meshes are divided into clusters")
    ):
        try:
            with compiled_code.kept(_FILES):
                from depthwalk.cook.kernels import loops
        except Exception as error:  # of any kind, where numba does not fit NumPy or the processor
            _failed = True
            reason = str(error).strip()[:200] or type(error).__name__
            _LOG.warning("meshes are divided into clusters by NumPy, which is slower, since numba fails: %s", reason)
            return False
        _loops = loops
    return _loops is not None


def load_for(triangles: int) -> None:
    """Load the loops if they are worth it for a mesh with so many triangles, or only have to be read."""
    if compiled_code.is_available() and (triangles >= _WORTHWHILE or compiled_code.is_complete(_FILES)):
        load()


def unload() -> None:
    """Go back to NumPy."""
    global _loops
    _loops = None
