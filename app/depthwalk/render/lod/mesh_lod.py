"""Choose the level of detail of polygon meshes: the coarsest one whose error the viewer cannot see."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthwalk.ingest.mesh import MOST_LEVELS, MeshLevel
from depthwalk.render.lod.selection import error_level
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import SIMPLIFIED, Objects
from depthwalk.types import Array, Ints, Rows

# Most triangles of a fallback mesh that is read without simplified levels: two cores draw that many in 30 ms, and
# simplifying them takes 4 s. A light mesh is read with its levels, as these may be quicker than depth images from afar;
# simplifying 20,000 triangles takes a second. A heavier mesh rarely has a level with as few as its pixels allow there.
MOST_UNSIMPLIFIED = 200_000
MOST_LIGHT = 20_000


def is_simplified(triangles: int) -> bool:
    """Return whether a mesh with `triangles` triangles that replaces depth images is read with simplified levels."""
    return not MOST_LIGHT < triangles <= MOST_UNSIMPLIFIED


@dataclass(kw_only=True)
class MeshLevels:
    """Hold the levels of detail of the meshes that are loaded; `a` is how many numbers `CookedParts` gives.

    Attributes
    ----------
    error : (a, levels) metres, see `MeshLevel`; +inf where a mesh has no such level, or is not loaded yet.
    triangles : (a, levels) number of triangles; 0 where `error` is +inf.
    """

    error: Array
    triangles: Ints

    @classmethod
    def empty(cls, count: int) -> "MeshLevels":
        """Return a table for `count` numbers of `CookedParts`, whose meshes are not loaded yet."""
        return cls(error=np.full((count, MOST_LEVELS), np.inf), triangles=np.zeros((count, MOST_LEVELS), np.int64))

    def drawn(self, mesh: Rows, metres: Array) -> Ints:
        """Return the triangles (n,) of the coarsest level of each mesh (n,) whose error is at most `metres` (n,)."""
        return np.asarray(self.triangles[mesh, error_level(self.error[mesh], metres)])

    def add(self, number: int, levels: Sequence[MeshLevel]) -> None:
        """Fill in the levels of a mesh that was loaded.

        Parameters
        ----------
        number : the number of the mesh in `CookedParts`.
        levels : the levels of detail of the mesh, the finest first.
        """
        self.error[number, : len(levels)] = [level.error for level in levels]
        self.triangles[number, : len(levels)] = [len(level.mesh.faces) for level in levels]


def mesh_level(view: View, objects: Objects, nearest: Array, errors: Array, allowed: float) -> Ints:
    """Choose the level of detail at which each of n objects is drawn if it is a mesh.

    The level is 0, the mesh itself, for all but objects whose representation is among `SIMPLIFIED`.

    Parameters
    ----------
    view : the view of the picture.
    objects : the n objects.
    nearest : (n,) distance from the viewer to the cylinders that enclose the objects, metres in their frames.
    errors : (a, levels) error by asset and level, metres, rising; +inf where there is no such level.
    allowed : the error that the level may have, pixels.

    Returns
    -------
    (n,) levels.
    """
    metres = allowed * nearest / view.detail_pixels
    level = error_level(errors[objects.asset], metres)
    return np.where(np.isin(objects.representation, SIMPLIFIED), level, 0)
