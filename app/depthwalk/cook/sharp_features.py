"""Restore sharp features: find the plane of the surface at each sample, beside ridges that triangles cut off.

Samples lie on the surface, and ridges mostly between them, so triangles across a ridge cut it off. The planes on both
sides of the ridge meet in it: so Kobbelt, Botsch, Schwanecke and Seidel 2001, "Feature Sensitive Surface Extraction
from Volume Data", restore it, who know the normals. Here the flattest of the triangles around a sample tells its plane,
as ENO schemes take derivatives from the side of a shock on which the function is smooth.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.geometry.triangles import face_normals
from depthwalk.types import Array, Ints


@dataclass(frozen=True)
class SharpFeatures:
    """Hold one plane per sample.

    Attributes
    ----------
    point
        (n, 3) the samples, which lie on their planes, metres.
    normal
        (n, 3) unit normals of the planes.
    """

    point: Array
    normal: Array


def find_sharp_features(point: Array, triangles: Ints) -> SharpFeatures:
    """Fit a plane to each sample that keeps ridges sharp: the plane of the flattest triangle around the sample.

    The flattest triangle is the one that is turned least against its neighbours across its edges.

    Parameters
    ----------
    point
        (n, 3) positions of the samples, metres.
    triangles
        (t, 3) rows of `point`, in which every sample has a triangle.

    Returns
    -------
    SharpFeatures
        n planes.
    """
    normal = face_normals(point[triangles])[0]
    roughest_first = np.argsort(_roughness(triangles, normal), kind="stable")[::-1]
    flattest = np.zeros(len(point), np.int64)
    flattest[triangles[roughest_first]] = roughest_first[:, None]  # the last written stays
    return SharpFeatures(point, normal[flattest])


def _roughness(triangles: Ints, normal: Array) -> Array:
    """Return the sums (t,) of 1 − cosine between the normals (t, 3) of triangles (t, 3) and their neighbours'.

    Edges without a neighbour add nothing.
    """
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    count = int(triangles.max()) + 1
    key, back = start * count + end, end * count + start
    rising = np.argsort(back)
    across = rising[np.searchsorted(back, key, sorter=rising).clip(max=len(back) - 1)]
    edge = np.arange(len(key))
    other = np.where(back[across] == key, across, edge)
    cosine = np.einsum("ij,ij->i", normal[edge // 3], normal[other // 3])
    return np.asarray((1 - cosine).reshape(-1, 3).sum(1))
