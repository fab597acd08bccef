"""Choose the axis of an object's cylinder so that its depth images sample the surface best."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.params import NAMED, BakeParams, Direction
from depthwalk.bake.placement import cylinder_around, extent, place_along
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.sampling import Probes, sampled_footprints, squared_texels
from depthwalk.geometry.triangles import spread_directions
from depthwalk.types import Array

_SPREAD = 20  # directions to try besides the named ones and the principal axes
_LEAST_GAIN = 0.2  # part of the mean squared footprint that an axis other than y must save


def choose_axis(caster: RayCaster, points: Array, probes: Probes, params: BakeParams) -> Direction:
    """Choose the cylinder's axis whose images sample an object best, by the mean squared footprint.

    The axis is +Y unless another one is clearly better, and it never points down.

    Parameters
    ----------
    caster
        The object, ready for ray casting, asset frame.
    points
        (n, 3) metres, asset frame: the object's vertices, which the cylinder must enclose.
    probes
        Points spread over the object's surface, at which the footprints are measured.
    params
        How the object would be baked; an axis given there is ignored.

    Returns
    -------
    Direction
        The axis, a unit vector (3,) in the asset frame.
    """
    axes = candidate_axes(probes)
    texel = extent(cylinder_around(place_along(NAMED["y"], points), points)) / params.resolution
    squares = []
    for axis in axes:
        placement = place_along(axis, points)
        footprint = sampled_footprints(caster, probes, placement, cylinder_around(placement, points), params)
        squares.append(np.average(squared_texels(footprint, texel), weights=probes.weight))
    best = int(np.argmin(squares))
    x, y, z = axes[best if squares[best] < (1 - _LEAST_GAIN) * squares[0] else 0].tolist()
    return x, y, z


def candidate_axes(probes: Probes) -> NDArray[np.float64]:
    """Return the unit directions (c, 3), asset frame, to try as the axis for a surface with these `probes`.

    They are y, x and z, the principal axes of the probes, and others spread over the upper half of the sphere; none
    points down.
    """
    around = spread_directions(2 * _SPREAD)[:_SPREAD]
    axes = np.concatenate([[NAMED["y"], NAMED["x"], NAMED["z"]], probes.principal_axes(), around])
    return axes * np.where(axes[:, 1:2] < 0, -1.0, 1.0)
