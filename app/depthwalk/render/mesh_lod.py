"""Level of detail of polygon meshes: the coarsest one whose error the viewer cannot see."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.params import Params, param
from depthwalk.render.view import View
from depthwalk.scene.arrays import Objects, Representation

Array = NDArray[np.floating]


class MeshLodParams(Params):
    """How coarse meshes may be."""

    error: float = param(
        1.0,
        "How far the surface of a simplified mesh (mesh-lod) may be off, seen from where its bounds are nearest",
        unit="pixels",
        ge=0,
        le=1000,
    )


def mesh_level(view: View, objects: Objects, nearest: Array, errors: Array, allowed: float) -> NDArray[np.int64]:
    """The level (n,) at which each of n objects is drawn if it is a mesh; 0, the mesh itself, but for mesh-lod.

    nearest: (n,) metres, objects' frames, from the viewer to the cylinders that hold them; errors: (a, levels) metres
    by asset and level, rising, +inf where there is no such level; allowed: pixels.
    """
    metres = allowed * nearest / view.focal_pixels
    level = (errors[objects.asset, 1:] <= metres[:, None]).sum(1)
    return np.where(objects.representation == Representation.MESH_LOD, level, 0)
