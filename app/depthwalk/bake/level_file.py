"""Keep simplified meshes in the user's cache folder, found by their key, as NumPy archives."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.cache import Cache, check_array, read_arrays, write_arrays
from depthwalk.ingest.mesh import MOST_LEVELS, Mesh, MeshLevel, Part

LEVELS = Cache(suffix=".levels.npz", content="simplified meshes")

# Of each vertex: how many numbers, of what type.
_VERTEX = {"positions": (3, np.float32), "normals": (3, np.float32), "colours": (3, np.uint8), "uv": (2, np.float32)}
_ARRAYS = (*_VERTEX, "faces")


def find_levels(mesh: Mesh, key: str) -> tuple[MeshLevel, ...] | None:
    """Find the simplified levels of a mesh in the cache, and remove a damaged file, with a warning.

    Parameters
    ----------
    mesh
        The mesh, which is the first level itself.
    key
        The key under which `keep_levels` kept the others.

    Returns
    -------
    tuple | None
        `mesh` and its levels, the finest first; None where the cache does not hold them.
    """
    levels = LEVELS.find(key, lambda path: _read(path, mesh))
    return None if levels is None else (MeshLevel(mesh, 0.0), *levels)


def keep_levels(levels: tuple[MeshLevel, ...], key: str) -> Path:
    """Store the simplified levels of a mesh in the cache folder.

    Parameters
    ----------
    levels
        The mesh, which is not stored, and its levels.
    key
        Hash of all that the levels depend on.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    arrays: dict[str, Any] = {"error": np.array([level.error for level in levels[1:]])}
    for number, level in enumerate(levels[1:]):
        parts = [(part.first_face, part.face_count, part.material) for part in level.mesh.parts]
        arrays |= {f"{name}.{number}": getattr(level.mesh, name) for name in _ARRAYS}
        arrays[f"parts.{number}"] = np.array(parts)
    return LEVELS.keep(key, lambda path: write_arrays(path, arrays, compressed=True))


def _read(path: Path, mesh: Mesh) -> list[MeshLevel]:
    """Read the levels of `mesh` from a file. Raises OSError; ValueError or KeyError where they cannot be drawn."""
    stored = read_arrays(path)
    error = stored["error"]
    if error.ndim != 1 or error.dtype.kind != "f" or len(error) >= MOST_LEVELS:
        raise ValueError("its errors are not a list of numbers")
    if not (np.isfinite(error).all() and (np.diff(error, prepend=0) >= 0).all()):
        raise ValueError("its errors are not rising numbers")
    return [_level(mesh, stored, number, float(value)) for number, value in enumerate(error)]


def _level(mesh: Mesh, stored: dict[str, NDArray[Any]], number: int, error: float) -> MeshLevel:
    """Return one level of `mesh`. Raises ValueError or KeyError where it cannot be drawn."""
    arrays = {name: stored[f"{name}.{number}"] for name in _ARRAYS}
    faces, rows = arrays["faces"], stored[f"parts.{number}"]
    count = len(np.atleast_1d(arrays["positions"]))
    for name, (width, kind) in _VERTEX.items():
        check_array(f"level {number}: {name}", arrays[name], (count, width), np.dtype(kind))
    low, high = mesh.bounds
    margin = np.linalg.norm(high - low)  # vertices are moved by the error of a level, which is less
    if (arrays["positions"] < low - margin).any() or (arrays["positions"] > high + margin).any():
        raise ValueError(f"level {number}: a vertex lies outside the mesh")
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype != np.int32 or not len(faces):
        raise ValueError(f"level {number}: faces are {faces.dtype} of {faces.shape}")
    if faces.min() < 0 or faces.max() >= count:
        raise ValueError(f"level {number}: a face refers to a vertex that does not exist")
    if rows.ndim != 2 or rows.shape[1] != 3 or rows.dtype.kind not in "iu" or not len(rows):
        raise ValueError(f"level {number}: parts are {rows.dtype} of {rows.shape}")
    first, length, material = rows.astype(np.int64).T
    ends = np.cumsum(length)
    if (length <= 0).any() or ends[-1] != len(faces) or (first != ends - length).any():
        raise ValueError(f"level {number}: its parts do not cover its faces")
    if material.min() < 0 or material.max() >= len(mesh.materials):
        raise ValueError(f"level {number}: a part is of a material that does not exist")
    parts = tuple(Part(*row) for row in rows.tolist())
    columns: dict[str, Any] = arrays
    return MeshLevel(Mesh(**columns, parts=parts, materials=mesh.materials), error)
