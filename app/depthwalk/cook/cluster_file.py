"""Keep the clusters of meshes in the user's cache folder, found by their key, as NumPy archives."""

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.cache import Cache, check_array, read_arrays, write_arrays
from depthwalk.cook.mesh_clusters import SIZE, MeshClusters
from depthwalk.ingest.mesh import Mesh

CLUSTERS = Cache(suffix=".clusters.npz", content="mesh clusters")

_NAMES = tuple(field.name for field in fields(MeshClusters))
# Their length, by what they describe, their further axes and their type.
_SHAPES: dict[str, tuple[str, tuple[int, ...], str]] = {
    "positions": ("v", (3,), "f"),
    "normals": ("v", (3,), "f"),
    "colours": ("v", (3,), "u"),
    "uv": ("v", (2,), "f"),
    "faces": ("t", (3,), "u"),
    "first": ("c1", (), "i"),
    "part": ("c", (), "i"),
    "centre": ("c", (3,), "f"),
    "radius": ("c", (), "f"),
    "axis": ("c", (3,), "f"),
    "sine": ("c", (), "f"),
    "made_by": ("c", (), "i"),
    "group": ("c", (), "i"),
    "level_first": ("l", (), "i"),
    "error": ("g", (), "f"),
    "group_centre": ("g", (3,), "f"),
    "group_radius": ("g", (), "f"),
}


def find_clusters(mesh: Mesh, key: str) -> MeshClusters | None:
    """Find the clusters of a mesh in the cache, and remove a damaged file, with a warning.

    Parameters
    ----------
    mesh
        The mesh.
    key
        The key under which `keep_clusters` kept them.

    Returns
    -------
    MeshClusters | None
        The clusters; None where the cache does not hold them.
    """
    return CLUSTERS.find(key, lambda path: _read(path, mesh))


def keep_clusters(clusters: MeshClusters, key: str) -> Path:
    """Store the clusters of a mesh in the cache folder.

    Parameters
    ----------
    clusters
        The clusters.
    key
        Hash of all that they depend on.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    arrays = {name: np.asarray(getattr(clusters, name)) for name in _NAMES}
    return CLUSTERS.keep(key, lambda path: write_arrays(path, arrays))


def _read(path: Path, mesh: Mesh) -> MeshClusters:
    """Read the clusters of `mesh` from a file. Raises OSError; ValueError or KeyError where they cannot be drawn."""
    stored = read_arrays(path)
    lengths = {
        "v": len(np.atleast_1d(stored["positions"])),
        "t": len(np.atleast_1d(stored["faces"])),
        "c": len(np.atleast_1d(stored["part"])),
        "g": len(np.atleast_1d(stored["error"])),
        "l": len(np.atleast_1d(stored["level_first"])),
    }
    lengths["c1"] = lengths["c"] + 1
    for name, (length, axes, kind) in _SHAPES.items():
        check_array(name, stored[name], (lengths[length], *axes), kind)
    _check_numbers(stored, len(mesh.parts))
    solid = bool(stored["solid"])
    return MeshClusters(**{name: stored[name] for name in _SHAPES}, solid=solid)


def _check_numbers(stored: dict[str, NDArray[Any]], parts: int) -> None:
    """Raise ValueError where something refers to what does not exist."""
    groups = len(stored["error"])
    for name, least, limit in (
        ("faces", 0, len(stored["positions"])),
        ("part", 0, parts),
        ("made_by", -1, groups),
        ("group", -1, groups),
    ):
        values = stored[name]
        if values.size and not least <= int(values.min()) <= int(values.max()) < limit:
            raise ValueError(f"{name} refer to what does not exist")
    first, levels, made_by = stored["first"], stored["level_first"], stored["made_by"]
    count = np.diff(first)
    if first[0] != 0 or first[-1] != len(stored["faces"]) or (count < 1).any() or (count > SIZE).any():
        raise ValueError("its clusters do not cover its triangles")
    if len(levels) < 1 or levels[0] != 0 or levels[-1] != groups or (np.diff(levels) < 1).any():
        raise ValueError("its levels do not cover its groups")
    if (np.diff(made_by) < 0).any():
        raise ValueError("its clusters are not in order")
    inner = np.flatnonzero((made_by >= 0) & (stored["group"] >= 0))
    if (stored["error"][stored["group"][inner]] < stored["error"][made_by[inner]]).any():
        raise ValueError("its errors fall from level to level")
