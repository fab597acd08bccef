"""Tell whether a mesh is the surface of a solid."""

import numpy as np

from depthwalk.geometry.triangles import row_ids
from depthwalk.ingest.mesh import Mesh


def is_solid(mesh: Mesh) -> bool:
    """Return whether a mesh is the closed surface of a solid, of which nobody outside sees a back face.

    It is so if faces run through every edge as often one way as the other, and enclose a positive volume.

    Parameters
    ----------
    mesh
        The mesh; vertices at one position count as one.

    Returns
    -------
    bool
        True for a closed surface; False also where it is inside out.
    """
    faces = row_ids(mesh.positions)[0][mesh.faces]
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = np.int64(len(mesh.positions))
    if not np.array_equal(np.sort(start * count + end), np.sort(end * count + start)):
        return False
    a, b, c = mesh.positions[mesh.faces].astype(np.float64).transpose(1, 0, 2)
    return bool(np.einsum("ij,ij->", a, np.cross(b, c)) > 0)
