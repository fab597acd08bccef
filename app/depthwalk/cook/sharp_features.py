"""Restore sharp features: estimate the plane of the surface at each sample beside ridges that triangles cut off.

Samples lie on the surface, but ridges mostly lie between them, so triangles across a ridge cut it off. The planes on
both sides of the ridge intersect in it. Kobbelt, Botsch, Schwanecke and Seidel 2001, "Feature Sensitive Surface
Extraction from Volume Data", restore ridges this way from known normals. Here the plane of a sample is that of the
flattest triangle around it, as ENO schemes take derivatives from the smooth side of a shock.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.geometry.indexed_triangles import normals_and_areas, opposite_edges
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


def find_sharp_features(point: Array, triangles: Ints, opposite: Ints | None = None) -> SharpFeatures:
    """Fit a plane to each sample that keeps ridges sharp: the plane of the flattest triangle around the sample.

    The flattest triangle is the one that is turned least against its neighbours across its edges.

    Parameters
    ----------
    point
        (n, 3) positions of the samples, metres.
    triangles
        (t, 3) rows of `point`, with at least one triangle at every sample.
    opposite
        (3 t,) the result of `opposite_edges` for the triangles, if it is known.

    Returns
    -------
    SharpFeatures
        n planes.
    """
    normal, _ = normals_and_areas(point, triangles)
    roughness = _roughness(normal, opposite_edges(triangles) if opposite is None else opposite)
    roughest_first = np.argsort(roughness, kind="stable")[::-1]
    flattest = np.zeros(len(point), np.int64)
    flattest[triangles.take(roughest_first, 0)] = roughest_first[:, None]  # the last one written stays
    return SharpFeatures(point, normal.take(flattest, 0))


def _roughness(normal: Array, opposite: Ints) -> Array:
    """Return the sums (t,) of 1 − cosine between the normals (t, 3) of triangles and their neighbours'.

    opposite: (3 t,), see `opposite_edges`; edges without a neighbour add nothing.
    """
    edge = np.arange(len(opposite))
    across = normal.take(np.where(opposite < 0, edge, opposite) // 3, 0).reshape(-1, 3, 3)
    a, b, c = (1 - np.einsum("ij,ij->i", normal, across[:, side]) for side in range(3))
    return np.asarray(a + b + c)
