"""Store simplified meshes in the user's cache folder as NumPy archives, found by their key."""

from typing import Any

import numpy as np

from depthwalk.array_file import Arrays, check_array
from depthwalk.cache import ArrayCache
from depthwalk.ingest.mesh import MOST_LEVELS, Mesh, MeshLevel, Part

# For each vertex attribute: number of components and their type.
_VERTEX = {"positions": (3, np.float32), "normals": (3, np.float32), "colours": (3, np.uint8), "uv": (2, np.float32)}
_ARRAYS = (*_VERTEX, "faces")


def _arrays(levels: tuple[MeshLevel, ...]) -> Arrays:
    """Return the arrays that a file holds of the levels; the mesh itself is not stored."""
    arrays: Arrays = {"error": np.array([level.error for level in levels[1:]])}
    for number, level in enumerate(levels[1:]):
        parts = [(part.first_face, part.face_count, part.material) for part in level.mesh.parts]
        arrays |= {f"{name}.{number}": getattr(level.mesh, name) for name in _ARRAYS}
        arrays[f"parts.{number}"] = np.array(parts)
    return arrays


def _parse(stored: Arrays, mesh: Mesh) -> tuple[MeshLevel, ...]:
    """Return `mesh` and its levels from a file. Raises ValueError or KeyError if they cannot be drawn."""
    error = stored["error"]
    if error.ndim != 1 or error.dtype.kind != "f" or len(error) >= MOST_LEVELS:
        raise ValueError("its errors are not a list of numbers")
    if not (np.isfinite(error).all() and (np.diff(error, prepend=0) >= 0).all()):
        raise ValueError("its errors are not rising numbers")
    return MeshLevel(mesh, 0.0), *(_level(mesh, stored, number, float(value)) for number, value in enumerate(error))


def _level(mesh: Mesh, stored: Arrays, number: int, error: float) -> MeshLevel:
    """Return one level of `mesh`. Raises ValueError or KeyError if it cannot be drawn."""
    arrays = {name: stored[f"{name}.{number}"] for name in _ARRAYS}
    faces, rows = arrays["faces"], stored[f"parts.{number}"]
    count = len(np.atleast_1d(arrays["positions"]))
    for name, (width, kind) in _VERTEX.items():
        check_array(f"level {number}: {name}", arrays[name], (count, width), np.dtype(kind))
    low, high = mesh.bounds
    margin = np.linalg.norm(high - low)  # vertices move by at most the error of a level, which is less
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


LEVELS = ArrayCache(suffix=".levels.npz", content="simplified meshes", arrays=_arrays, parse=_parse, compressed=True)
"""A mesh and its simplified levels, the finest first, by the mesh."""
