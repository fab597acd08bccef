"""Hold the clusters and groups of a mesh while they are built, with the spheres and cones that bound them."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from depthwalk.geometry.soa import StructOfArrays
from depthwalk.geometry.triangles import face_normals
from depthwalk.types import Array, Ints, Rows

_ROUNDING = 1e-7  # added to radii, since positions are stored in single precision; the mesh has size 1
_TOGETHER = 1 << 11  # clusters at a time


@dataclass(kw_only=True)
class Clusters(StructOfArrays):
    """Hold n clusters.

    number: (n,) among all clusters; count: (n,) triangles of each; part, made_by, centre, radius, axis, sine: as in
    `MeshClusters`, but in the builder's frame; error, lod_centre, lod_radius: those of the groups that made them, or
    for the mesh itself 0 and the bounding spheres.
    """

    number: Ints
    count: Ints
    part: Ints
    made_by: Ints
    centre: Array
    radius: Array
    axis: Array
    sine: Array
    error: Array
    lod_centre: Array
    lod_radius: Array

    def __len__(self) -> int:
        return len(self.number)


@dataclass(kw_only=True)
class Groups(StructOfArrays):
    """Hold g groups: their distance from the mesh once they are simplified, and their spheres."""

    error: Array
    centre: Array
    radius: Array

    def __len__(self) -> int:
        return len(self.error)

    @classmethod
    def none(cls) -> "Groups":
        """Return no groups."""
        return cls(error=np.zeros(0), centre=np.zeros((0, 3)), radius=np.zeros(0))


class Bounds(NamedTuple):
    """Hold centres (n, 3) and radii (n,) of n clusters, and axes (n, 3) and sines (n,) of cones of their normals."""

    centre: Array
    radius: Array
    axis: Array
    sine: Array


def enclosing(clusters: Clusters, group: Ints) -> Groups:
    """Return groups with bounding spheres and errors of their clusters, given the `group` (n,) of each cluster."""
    order = np.argsort(group, kind="stable")
    first = np.flatnonzero(np.diff(group[order], prepend=-1))
    centre, radius = clusters.lod_centre[order], clusters.lod_radius[order, None]
    low, high = np.minimum.reduceat(centre - radius, first), np.maximum.reduceat(centre + radius, first)
    middle = (low + high) / 2
    reach = np.linalg.norm(centre - middle[group[order]], axis=1) + radius[:, 0]
    return Groups(
        error=np.maximum.reduceat(clusters.error[order], first),
        centre=middle,
        radius=np.maximum.reduceat(reach, first) * (1 + 1e-12),
    )


def cluster_bounds(point: Array, corners: Rows, count: Ints) -> Bounds:
    """Return the bounds of clusters, whose triangles come one cluster after the other.

    Parameters
    ----------
    point
        (p, 3) places.
    corners
        (t, 3) rows of `point`.
    count
        (n,) triangles of each cluster.
    """
    ends = np.cumsum(count)
    parts = [Bounds(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.zeros(0))]
    for begin in range(0, len(count), _TOGETHER):
        own = count[begin : begin + _TOGETHER]
        last = int(ends[min(begin + _TOGETHER, len(count)) - 1])
        placed = point[corners[last - int(own.sum()) : last]].astype(np.float64)
        first = np.cumsum(own) - own
        parts.append(Bounds(*_spheres(placed, first), *_cones(face_normals(placed)[0], first)))
    return Bounds(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _spheres(corners: Array, first: Ints) -> tuple[Array, Array]:
    """Return centres (n, 3) and radii (n,) of spheres around runs of triangles (t, 3, 3) that begin at `first` (n,)."""
    low, high = np.minimum.reduceat(corners.min(1), first), np.maximum.reduceat(corners.max(1), first)
    centre = (low + high) / 2
    of = np.repeat(np.arange(len(first)), np.diff(first, append=len(corners)))
    reach = np.square(corners - centre[of][:, None]).sum(-1).max(1)
    return centre, np.sqrt(np.maximum.reduceat(reach, first)) + _ROUNDING


def _cones(normal: Array, first: Ints) -> tuple[Array, Array]:
    """Return axes (n, 3) and sines (n,) of the cones around runs of normals (t, 3), see `MeshClusters`."""
    axis = np.add.reduceat(normal, first)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.divide(axis, length, out=np.zeros_like(axis), where=length > 0)
    of = np.repeat(np.arange(len(first)), np.diff(first, append=len(normal)))
    cosine = np.minimum.reduceat(np.einsum("ij,ij->i", normal, axis[of]), first)
    return axis, np.where(cosine > 0, np.sqrt(np.maximum(1 - cosine**2, 0)), 1.0)
