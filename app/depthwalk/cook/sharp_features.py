"""What plane a surface has at each of its samples, though the triangles around these may cut off a ridge.

Samples lie on the surface, and ridges mostly between them. Planes on both sides of one meet in it: so Kobbelt, Botsch,
Schwanecke and Seidel 2001, "Feature Sensitive Surface Extraction from Volume Data", find it, who know the normals. Here
the flattest of the triangles around a sample tells its plane, as ENO schemes take derivatives from the side of a shock
on which the function is smooth.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.geometry.triangles import face_normals
from depthwalk.types import Array, Ints


@dataclass(frozen=True)
class SharpFeatures:
    """Planes. point: (n, 3) metres; normal: (n, 3), unit."""

    point: Array
    normal: Array


def find_sharp_features(point: Array, triangles: Ints) -> SharpFeatures:
    """The planes of points (n, 3) of triangles (t, 3): of each point's triangles, that of the one which its neighbours
    are turned against least."""
    normal = face_normals(point[triangles])[0]
    roughest_first = np.argsort(_turns(triangles, normal), kind="stable")[::-1]
    flattest = np.zeros(len(point), np.int64)
    flattest[triangles[roughest_first]] = roughest_first[:, None]  # the last written stays
    return SharpFeatures(point, normal[flattest])


def _turns(triangles: Ints, normal: Array) -> Array:
    """How far triangles (t, 3) with normals (t, 3) are turned against those across their edges: the sums (t,) of
    1 − cosine. Where the surface ends they are not."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    count = int(triangles.max()) + 1
    key, back = start * count + end, end * count + start
    rising = np.argsort(back)
    across = rising[np.searchsorted(back, key, sorter=rising).clip(max=len(back) - 1)]
    edge = np.arange(len(key))
    other = np.where(back[across] == key, across, edge)
    cosine = np.einsum("ij,ij->i", normal[edge // 3], normal[other // 3])
    return np.asarray((1 - cosine).reshape(-1, 3).sum(1))
