"""Derive tangent frames from positions and texture coordinates, and turn normals in them as normal maps ask."""

from typing import NamedTuple

import numpy as np

from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array

_LEAST = 1e-30  # below this square, a vector has no direction that single precision holds


class Tangents(NamedTuple):
    """Hold the directions of texture coordinates on n surfaces.

    Attributes
    ----------
    along_u
        (n, 3) the direction in which u grows and v does not, of any length; zero where coordinates are degenerate.
    handedness
        (n,) 1 where u, v and the side from which corners run counter-clockwise are right-handed, −1 where the texture
        is mirrored, 0 where coordinates are degenerate.
    across
        (n, 3) cross product of the two edges: the normal on that side, of any length.
    """

    along_u: Array
    handedness: Array
    across: Array


def tangents(first: Array, second: Array, first_uv: Array, second_uv: Array) -> Tangents:
    """Return the directions of texture coordinates in the planes that two edges each span.

    Coordinates are linear in a plane, so any two steps in it give the same direction: edges of a triangle, or the
    derivatives along the rows and columns of a picture (Schüler 2013, "Followup: Normal Mapping Without Precomputed
    Tangents").

    Parameters
    ----------
    first, second
        (n, 3) two steps within each plane, metres.
    first_uv, second_uv
        (n, 2) the changes of texture coordinates along them, v upward.

    Returns
    -------
    Tangents
        The directions.
    """
    (du, dv), (eu, ev) = first_uv.T, second_uv.T
    sign = np.sign(du * ev - dv * eu)
    return Tangents(sign[:, None] * (first * ev[:, None] - second * dv[:, None]), sign, np.cross(first, second))


def turned_normals(normal: Array, directions: Tangents, mapped: Array) -> Array:
    """Turn normals as the texels of a tangent-space normal map say.

    The frame is that of glTF 2.0 (§3.7.2.1) and MikkTSpace (Mikkelsen 2008): the tangent is the direction of u,
    projected onto the plane across the normal; the bitangent is at right angles to both, on the side to which v grows.

    Parameters
    ----------
    normal
        (n, 3) interpolated unit normals.
    directions
        The directions of the texture coordinates there.
    mapped
        (n, 3) what the map holds there: x towards u, y towards v, z outward; of any length.

    Returns
    -------
    Array
        (n, 3) unit normals; `normal` itself where texture coordinates are degenerate.
    """
    tangent = directions.along_u - normal * np.einsum("ni,ni->n", normal, directions.along_u)[:, None]
    square = np.einsum("ni,ni->n", tangent, tangent)
    outward = np.sign(np.einsum("ni,ni->n", normal, directions.across))
    tangent = tangent / np.sqrt(np.maximum(square, _LEAST))[:, None]
    bitangent = (directions.handedness * outward)[:, None] * np.cross(normal, tangent)
    turned = mapped[:, :1] * tangent + mapped[:, 1:2] * bitangent + mapped[:, 2:] * normal
    length = lengths(turned)
    known = (square > _LEAST) & (directions.handedness != 0) & (length > 0)
    return np.where(known[:, None], turned / np.where(length > 0, length, 1)[:, None], normal)
