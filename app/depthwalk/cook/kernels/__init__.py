"""Build mesh clusters in loops that numba compiles, in place of NumPy.

`cook.group_collapse`, `cook.cluster_error` and `geometry.spatial_order` compute the same with NumPy: the tests compare
both, and without numba, an extra of this package, they are used. Loops are loaded for large meshes only: compiling them
takes longer than NumPy takes for a small one.
"""

from pathlib import Path
from types import ModuleType

from depthwalk.kernels import compiled_code

_FILES = Path(__file__).parent
_WORTHWHILE = 200_000  # triangles of a mesh from which loops are compiled for it

_loops: ModuleType | None = None


def loaded() -> ModuleType | None:
    """Return the module `cook.kernels.loops`, whose functions replace NumPy code; None before `load`."""
    return _loops


def load() -> bool:
    """Load the compiled loops, see `compiled_code.loaded`; return whether they are."""
    global _loops
    _loops = _loops or compiled_code.loaded(_FILES, f"{__name__}.loops", "meshes are divided into clusters")
    return _loops is not None


def load_for(triangles: int) -> None:
    """Load the loops if they are worth it for a mesh with so many triangles, or only have to be read."""
    if compiled_code.is_available() and (triangles >= _WORTHWHILE or compiled_code.is_complete(_FILES)):
        load()


def unload() -> None:
    """Go back to NumPy."""
    global _loops
    _loops = None
