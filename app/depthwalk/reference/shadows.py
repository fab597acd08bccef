"""Twin of shaders/common/shadow_map.glsl and of what looks there."""

import numpy as np

from depthwalk.render.shadows.casters import MapView
from depthwalk.render.view.view import matrix_array
from depthwalk.types import Array


def lifted(point: Array, normal: Array, axis: Array, texel: Array | float, filter_width: int, error: float) -> Array:
    """Points (n, 3) moved along normals (n, 3) so far that a plane does not shadow itself. normal, axis (3,): unit, the
    latter the map's; texel: metres, of each point (n,) or of all; filter_width, error: texels."""
    sine = np.linalg.norm(np.cross(normal, axis), axis=1)
    return np.asarray(point + normal * np.atleast_1d(texel * (0.5 * filter_width * sine + 0.5 + error))[:, None])


def light_share(depth: Array, view: MapView, point: Array, filter_width: int) -> Array:
    """What part of the light (n,) reaches points (n, 3), world, moved as by `lifted`; NaN outside the map. depth:
    (resolution, resolution), row 0 at the bottom."""
    clip_from_centre = matrix_array(view.clip_from_centre)
    clip = (point - np.array(view.centre)) @ clip_from_centre[:, :3].T + clip_from_centre[:, 3]
    at = clip[:, :3] / clip[:, 3:] / 2 + 0.5
    taps = np.arange(filter_width - 1) - 0.5 * filter_width + 1
    x, y = np.meshgrid(taps, taps)
    margin = 0.5 * filter_width / view.resolution
    inside = (clip[:, 3] > 0) & (np.abs(at - 0.5) <= 0.5 - margin * np.array([1, 1, 0])).all(1)
    texels = at[:, None, :2] * view.resolution + np.stack([x.ravel(), y.ravel()], -1) - 0.5
    low = np.floor(np.where(inside[:, None, None], texels, 0)).astype(int)
    part = texels - low
    share = np.zeros(len(point))
    for corner in np.ndindex(2, 2):
        column, row = np.clip(low + corner, 0, view.resolution - 1).transpose(2, 0, 1)
        weight = np.abs(1 - np.array(corner) - part).prod(-1)
        share += (weight * (at[:, 2:] <= depth[row, column])).mean(1)
    return np.where(inside, share, np.nan)
