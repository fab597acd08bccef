"""Simplified meshes are made once and kept in the user's cache folder, found by their key; any NumPy reads them."""

import contextlib
import io
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from depthwalk.bake.cache import cache_folder, make_room
from depthwalk.ingest.mesh import Mesh, MeshLevel, Part
from depthwalk.output import write_bytes

_SUFFIX = ".levels.npz"
_ARRAYS = ("positions", "normals", "colours", "uv", "faces")


def find_levels(mesh: Mesh, key: str) -> tuple[MeshLevel, ...] | None:
    """Return `mesh` and its simplified levels, if they are in the cache under `key`; a damaged file is passed over."""
    path = _path(key)
    try:
        # By its bytes: NumPy leaves a damaged file open.
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as stored:
            arrays = dict(stored)
            levels = [_level(mesh, arrays, number, error) for number, error in enumerate(arrays["error"].tolist())]
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile):  # EOFError: an empty file
        return None
    with contextlib.suppress(OSError):  # removed meanwhile, or a cache that is read-only
        os.utime(path)  # its age is that of its last use
    return (MeshLevel(mesh, 0.0), *levels)


def keep_levels(levels: tuple[MeshLevel, ...], key: str) -> Path:
    """Store all levels but the mesh itself in the cache folder and return the file's path.

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
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    path = _path(key)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, stream.getvalue())
    make_room(path)
    return path


def _path(key: str) -> Path:
    return cache_folder() / (key + _SUFFIX)


def _level(mesh: Mesh, stored: dict[str, np.ndarray], number: int, error: float) -> MeshLevel:
    arrays = {name: stored[f"{name}.{number}"] for name in _ARRAYS}
    parts = tuple(Part(*row) for row in stored[f"parts.{number}"].tolist())
    return MeshLevel(Mesh(**arrays, parts=parts, materials=mesh.materials), error)
