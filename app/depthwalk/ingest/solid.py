"""Detect whether a mesh is the surface of a solid."""

import numpy as np

from depthwalk.geometry.spatial_order import stable_order
from depthwalk.geometry.triangles import row_ids
from depthwalk.ingest.mesh import Mesh


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
    faces = row_ids(mesh.positions)[0][mesh.faces]
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edge = np.minimum(start, end) * np.int64(len(mesh.positions)) + np.maximum(start, end)
    order = stable_order(edge)
    edge = edge[order]
    runs = np.flatnonzero(np.diff(edge, prepend=-1))  # one for each edge
    if np.add.reduceat(np.sign(end - start)[order], runs).any():
        return False
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = mesh.positions.astype(np.float64)[mesh.faces].transpose(1, 2, 0)
    return bool((ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)).sum() > 0)
