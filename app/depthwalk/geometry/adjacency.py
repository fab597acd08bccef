"""Find the edges of a mesh and the two faces that meet in each: once per mesh, since it is independent of the view."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.triangles import doubled_areas, row_ids
from depthwalk.types import Ints

Shape = tuple[NDArray[np.float32], NDArray[np.uint32]]  # positions (v, 3) and triangles (t, 3)


@dataclass(frozen=True, kw_only=True)
class EdgeAdjacency:
    """Hold the edges of f triangles of a mesh, and the faces on both sides of each.

    They suffice to find silhouettes, where a front face meets a back face, without looking at the triangles. An edge is
    open if it belongs to only one face.

    Attributes
    ----------
    points
        (v, 3) float32, positions of the vertices, metres, object frame.
    ends
        (e, 2) int32, rows of `points`: both ends of each edge, in the direction in which its first face runs.
    faces
        (e, 2) int32, rows of `planes`: both faces of each edge; the second is the last row if the edge is open.
    planes
        (f + 1, 4) float32: unit normal of each face, and the distance of its plane from the origin along the normal,
        metres. Faces without area, and the last row, are zero, so that they never count as front faces.
    folds
        (e,) float32, cosine of the angle between the normals of the two faces; 1 if an edge is open.
    density
        How much silhouette to expect, 1/m: projected length of silhouettes over projected area of front faces, each
        averaged over all view directions.
    """

    points: NDArray[np.float32]
    ends: NDArray[np.int32]
    faces: NDArray[np.int32]
    planes: NDArray[np.float32]
    folds: NDArray[np.float32]
    density: float

    @property
    def open(self) -> NDArray[np.bool_]:
        """Return which edges have only one face, (e,) bool."""
        return np.asarray(self.faces[:, 1] == len(self.planes) - 1)


def build_adjacency(positions: NDArray[np.floating], triangles: NDArray[np.integer]) -> EdgeAdjacency:
    """Pair the faces that meet at each edge of a mesh.

    Vertices at one position count as one, and triangles that this leaves without three corners are dropped. Where more
    than two faces meet, they are paired in order.

    Parameters
    ----------
    positions
        (v, 3) float, metres, object frame.
    triangles
        (f, 3) int, rows of `positions`, counter-clockwise seen from the front.

    Returns
    -------
    EdgeAdjacency
        The edges, each with its one or two faces.
    """
    names, first = row_ids(positions)
    corners = names[triangles]
    corners = corners[(corners != np.roll(corners, 1, axis=1)).all(1)]
    points = np.asarray(positions[first], np.float32)
    across = doubled_areas(points.astype(np.float64), corners)
    area = np.linalg.norm(across, axis=1, keepdims=True)
    normal = across / np.where(area > 0, area, 1)
    offset = np.einsum("fi,fi->f", normal, points[corners[:, 0]])
    planes = np.zeros((len(corners) + 1, 4), np.float32)
    planes[:-1, :3], planes[:-1, 3] = normal, offset
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    name = np.minimum(start, end) * np.int64(len(points)) + np.maximum(start, end)
    half = np.argsort(name, kind="stable")  # half-edges, with those between the same two points adjacent
    name = name[half]
    begins = np.concatenate([[True], name[1:] != name[:-1]])
    rank = np.arange(len(half)) - np.flatnonzero(begins)[np.cumsum(begins) - 1]
    one = np.flatnonzero(rank % 2 == 0)
    paired = np.append(~begins, False)[one + 1]
    other = np.where(paired, half[np.minimum(one + 1, len(half) - 1)] // 3, len(corners))
    ends = np.stack([start[half[one]], end[half[one]]], -1)
    faces = np.stack([half[one] // 3, other], -1)
    cosine = np.einsum("ei,ei->e", *(planes[faces[:, k], :3] for k in (0, 1)))
    folds = np.where(paired, np.clip(cosine, -1, 1), np.float32(1))
    # The part of all directions from which an edge is on the silhouette is the angle between its faces over half a turn
    # (Cauchy–Crofton).
    turn = np.where(paired, np.arccos(folds), np.pi)
    length = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)
    density = float(turn @ length) / max(float(area.sum()) / 2, 1e-12)
    return EdgeAdjacency(
        points=points,
        ends=ends.astype(np.int32),
        faces=faces.astype(np.int32),
        planes=planes,
        folds=folds,
        density=density,
    )


def connected_groups(count: int, one: Ints, other: Ints) -> NDArray[np.int64]:
    """Find the groups of things that are connected by links, directly or indirectly.

    Each round joins every group to the lowest group that it is linked to, which at least halves the number of groups
    along a chain. (SciPy does the same, but takes a third of a second to import.)

    Parameters
    ----------
    count
        Number of things.
    one, other
        (n,) the things at the two ends of each link.

    Returns
    -------
    NDArray[np.int64]
        (count,) the group of each thing. Groups are numbered in the order of their first members.
    """
    least = np.arange(count)  # a member of the same group, finally its first
    while len(one):
        np.minimum.at(least, np.maximum(one, other), np.minimum(one, other))
        while ((further := least[least]) != least).any():
            least = further
        one, other = least[one], least[other]
        apart = one != other
        one, other = one[apart], other[apart]
    return (np.cumsum(least == np.arange(count)) - 1)[least]
