"""Look up shadow maps, as the twin of shaders/common/shadow_map.glsl and of the shaders that include it.

A point is lit if nothing is nearer to the light; averaging that answer over neighbouring texels softens the edges
(percentage-closer filtering: Reeves, Salesin and Cook 1987, "Rendering Antialiased Shadows with Depth Maps"). Points
are first moved along their normals, so that the filter does not find the surface itself in front of them.
"""

import numpy as np

from depthwalk.render.shadows.casters import LightView
from depthwalk.render.view.view import matrix_array
from depthwalk.types import Array


def lifted(point: Array, normal: Array, axis: Array, texel: Array | float, filter_width: int, error: float) -> Array:
    """Move points along their normals just far enough that a plane does not shadow itself.

    Let w be half the filter's width, and α the angle between the normal and `axis`. Over the distance w, the plane
    comes nearer to the light by w tan α. Moving a point along the normal by w sin α compensates for this. Half a texel
    is added because the map holds depths only at the centres of texels.

    Parameters
    ----------
    point
        (n, 3) points of surfaces, metres, world.
    normal
        (n, 3) their unit normals, world.
    axis
        (3,) unit vector along which the map looks, world.
    texel
        Width of a texel of the map, metres: one for each point (n,), or one number for all.
    filter_width
        Width of the filter, texels.
    error
        Possible error of the surfaces in the map, texels.

    Returns
    -------
    Array
        (n, 3) moved points, metres, world.
    """
    sine = np.linalg.norm(np.cross(normal, axis), axis=1)
    return np.asarray(point + normal * np.atleast_1d(texel * (0.5 * filter_width * sine + 0.5 + error))[:, None])


def light_share(depth: Array, view: LightView, point: Array, filter_width: int) -> Array:
    """Return the part of the light that reaches points, by a filtered lookup in a shadow map.

    Parameters
    ----------
    depth
        (resolution, resolution) depths of the map, 0 to 1, row 0 at the bottom.
    view
        The cascade or spot map: its projection from the world, and its resolution in texels.
    point
        (n, 3) points, metres, world, moved as by `lifted`.
    filter_width
        Width of the filter, texels.

    Returns
    -------
    Array
        (n,) parts of the light, 0 to 1; NaN outside the map, and so near its edges that the filter would leave it.
    """
    clip_from_centre = matrix_array(view.clip_from_centre)
    clip = (point - np.array(view.centre)) @ clip_from_centre[:, :3].T + clip_from_centre[:, 3]
    at = clip[:, :3] / clip[:, 3:] / 2 + 0.5
    taps = np.arange(filter_width - 1) - 0.5 * filter_width + 1
    x, y = np.meshgrid(taps, taps)
    margin = 0.5 * filter_width / view.resolution
    inside = (clip[:, 3] > 0) & (np.abs(at - 0.5) <= 0.5 - margin * np.array([1, 1, 0])).all(1)
    texels = at[:, None, :2] * view.resolution + np.stack([x.ravel(), y.ravel()], -1) - 0.5
    low = np.floor(np.where(inside[:, None, None], texels, 0)).astype(int)
    fraction = texels - low
    share = np.zeros(len(point))
    for corner in np.ndindex(2, 2):  # bilinear comparison, as in hardware
        column, row = np.clip(low + corner, 0, view.resolution - 1).transpose(2, 0, 1)
        weight = np.abs(1 - np.array(corner) - fraction).prod(-1)
        share += (weight * (at[:, 2:] <= depth[row, column])).mean(1)
    return np.where(inside, share, np.nan)
