"""Detect whether a mesh is the surface of a solid."""

import numpy as np

from depthwalk.geometry.triangles import row_ids
from depthwalk.ingest.mesh import Mesh
from depthwalk.parallel import batches

_BATCH = 1 << 18  # faces at a time


def is_solid(mesh: Mesh) -> bool:
    """Return whether a mesh is the closed surface of a solid, whose back faces are never visible from outside.

    This holds if faces traverse every edge equally often in both directions, and enclose a positive volume.

    Parameters
    ----------
    mesh
        The mesh; vertices at one position count as one.

    Returns
    -------
    bool
        True for a closed surface; False also if it is inside out, or cut out by the alpha of a texture.
    """
    if any(material.cutoff is not None for material in mesh.materials):
        return False  # the inside is visible where the surface is cut out
    if not len(mesh.faces):  # the whole mesh is translucent
        return True
    return _is_closed(mesh) and _volume(mesh) > 0


def _is_closed(mesh: Mesh) -> bool:
    """Return whether faces traverse every edge equally often in both directions."""
    faces = row_ids(mesh.positions)[0][mesh.faces]
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    # The direction is the last bit, so that numbers are sorted in place: an order would take several times the memory.
    key = np.minimum(start, end) * np.int64(2 * len(mesh.positions))
    key += 2 * np.maximum(start, end)
    key += end > start
    key = key[start != end]
    key.sort()
    runs = np.flatnonzero(np.diff(key >> 1, prepend=-1))  # one for each edge
    return not len(runs) or not np.add.reduceat(2 * (key & 1) - 1, runs).any()


def _volume(mesh: Mesh) -> float:
    """Return six times the volume that faces enclose, cubic metres; negative if they are inside out."""
    volume = 0.0
    for batch in batches(len(mesh.faces), _BATCH):
        corners = mesh.positions[mesh.faces[batch]].astype(np.float64)
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners.transpose(1, 2, 0)
        volume += float((ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)).sum())
    return volume
