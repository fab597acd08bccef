"""Store the clusters of meshes in the user's cache folder as NumPy archives, found by their key."""

from dataclasses import fields

import numpy as np

from depthwalk.array_file import Arrays, check_array
from depthwalk.cache import ArrayCache
from depthwalk.cook.mesh_clusters import SIZE, MeshClusters
from depthwalk.ingest.mesh import Mesh

_NAMES = tuple(field.name for field in fields(MeshClusters))
# What determines an array's length, its further axes and its type.
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


def _arrays(clusters: MeshClusters) -> Arrays:
    """Return the arrays that a file holds of clusters."""
    return {name: np.asarray(getattr(clusters, name)) for name in _NAMES}


def _parse(stored: Arrays, mesh: Mesh) -> MeshClusters:
    """Return the clusters of `mesh` from a file. Raises ValueError or KeyError if they cannot be drawn."""
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


def _check_numbers(stored: Arrays, parts: int) -> None:
    """Raise ValueError if a number refers to something that does not exist."""
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


CLUSTERS = ArrayCache(suffix=".clusters.npz", content="mesh clusters", arrays=_arrays, parse=_parse)
"""Mesh clusters, by their mesh."""
