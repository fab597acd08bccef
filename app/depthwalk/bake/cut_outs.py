"""Find where alpha in a mesh's textures cuts out its surface, as around the leaves on a card."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.mesh import Mesh
from depthwalk.types import Array, Mask


class CutOuts:
    """Distinguish solid points of a mesh from points that its materials cut out.

    Parameters
    ----------
    mesh
        The mesh; at least one of its materials must have a `cutoff`.
    """

    def __init__(self, mesh: Mesh) -> None:
        self._mesh = mesh
        cut = [number for number, material in enumerate(mesh.materials) if material.cutoff is not None]
        self._parts = [part for part in mesh.parts if part.material in cut]

    def solid(self, face: NDArray[np.integer], u: Array, v: Array) -> Mask:
        """Return which points are on solid surface.

        Parameters
        ----------
        face
            (n,) numbers of faces.
        u, v
            (n,) barycentric weights of the faces' second and third corners.

        Returns
        -------
        numpy.ndarray
            (n,) bool, False where alpha is below the cutoff of the face's material.
        """
        solid = np.ones(len(face), bool)
        for part in self._parts:
            rows = np.flatnonzero((face >= part.first_face) & (face < part.first_face + part.face_count))
            material = self._mesh.materials[part.material]
            if len(rows) and material.texture is not None and material.cutoff is not None:
                corners = self._mesh.uv.take(self._mesh.faces.take(face[rows], 0), 0)
                weights = np.stack([1 - u[rows] - v[rows], u[rows], v[rows]], -1)
                uv = np.einsum("nk,nkc->nc", weights, corners)
                solid[rows] = alpha_at(material.texture, uv) >= material.cutoff
        return solid


def cut_outs(mesh: Mesh) -> CutOuts | None:
    """Return the cut-outs of `mesh`; None if no material cuts anything out."""
    return CutOuts(mesh) if any(material.cutoff is not None for material in mesh.materials) else None


def alpha_at(texture: NDArray[np.uint8], uv: Array) -> NDArray[np.float32]:
    """Sample alpha (n,), 0 to 1, bilinearly at `uv` (n, 2) in a repeating texture (H, W, 4) with row 0 at v = 1."""
    height, width = texture.shape[:2]
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    right, below = (x - column).astype(np.float32), (y - row).astype(np.float32)
    alpha = texture[..., 3]
    upper, lower = (
        alpha[at % height, column % width] * (1 - right) + alpha[at % height, (column + 1) % width] * right
        for at in (row, row + 1)
    )
    return np.asarray((upper * (1 - below) + lower * below) / np.float32(255))
