"""Level of detail of polygon meshes: the coarsest one whose error the viewer cannot see."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.mesh import MOST_LEVELS, MeshLevel
from depthwalk.render.lod.selection import error_level
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.types import Array


@dataclass(kw_only=True)
class MeshLevels:
    """Of each of a meshes the levels of detail: error (a, levels), metres, and triangles (a, levels), see `MeshLevel`;
    +inf and 0 where a mesh has no such level, or has not come yet."""

    error: Array
    triangles: NDArray[np.int64]

    @classmethod
    def empty(cls, count: int) -> "MeshLevels":
        """For `count` numbers."""
        return cls(error=np.full((count, MOST_LEVELS), np.inf), triangles=np.zeros((count, MOST_LEVELS), np.int64))

    def add(self, number: int, levels: Sequence[MeshLevel]) -> None:
        """Mesh `number` has come."""
        self.error[number, : len(levels)] = [level.error for level in levels]
        self.triangles[number, : len(levels)] = [len(level.mesh.faces) for level in levels]


def mesh_level(view: View, objects: Objects, nearest: Array, errors: Array, allowed: float) -> NDArray[np.int64]:
    """The level (n,) at which each of n objects is drawn if it is a mesh; 0, the mesh itself, but for mesh-lod.

    nearest: (n,) metres, objects' frames, from the viewer to the cylinders that hold them; errors: (a, levels) metres
    by asset and level, rising, +inf where there is no such level; allowed: pixels.
    """
    metres = allowed * nearest / view.focal_pixels
    level = error_level(errors[objects.asset], metres)
    return np.where(objects.representation == Representation.MESH_LOD, level, 0)
