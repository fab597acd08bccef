"""Define the hierarchy of clusters of a mesh, from which each view selects those that are just fine enough.

`cook.cluster_builder` builds it. Drawing clusters does not need the builder, so this imports no library for building.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array

CLUSTERS_VERSION = 4  # raise it when the same mesh would be divided differently
SIZE = 128  # most triangles of a cluster


@dataclass(frozen=True, kw_only=True)
class MeshClusters:
    """Hold the c clusters of a mesh, from those of the mesh itself to the coarsest, and the g groups between them.

    Clusters come level by level, the finest first. The clusters of level 0 are the mesh itself; those of level k + 1
    are the simplified groups of level k.

    Attributes
    ----------
    positions, normals, colours, uv : (v, …) the vertices of all clusters, see `Mesh`; those of the mesh come first.
    faces : (t, 3) uint32, rows of these; the triangles of one cluster after the other.
    first : (c + 1,) first triangle of each cluster.
    solid : whether the mesh is closed, so that back faces are never visible, see `is_solid`.
    part : (c,) number of the part of the mesh that each cluster belongs to.
    centre, radius : (c, 3) and (c,) bounding spheres of the clusters, metres, asset frame.
    axis, sine : (c, 3) and (c,) cones that hold the normals of the clusters, see `Meshlets`.
    made_by : (c,) the group whose simplification each cluster belongs to; −1 for triangles of the mesh itself.
    group : (c,) the group in which each cluster is simplified; −1 if it is not simplified further.
    level_first : (levels + 1,) first group of each level; the last is g.
    error : (g,) distance of the simplified groups from the mesh in place, colour and normals, metres; at least that of
        their clusters.
    group_centre, group_radius : (g, 3) and (g,) spheres that enclose the groups, and the spheres of the groups that
        made their clusters, metres, asset frame.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    colours: NDArray[np.uint8]
    uv: NDArray[np.float32]
    faces: NDArray[np.uint32]
    first: NDArray[np.int64]
    solid: bool
    part: NDArray[np.int64]
    centre: Array
    radius: Array
    axis: Array
    sine: Array
    made_by: NDArray[np.int64]
    group: NDArray[np.int64]
    level_first: NDArray[np.int64]
    error: Array
    group_centre: Array
    group_radius: Array

    def __len__(self) -> int:
        """Return the number of clusters."""
        return len(self.part)
