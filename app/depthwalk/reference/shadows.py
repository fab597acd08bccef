"""Twin of shaders/shadows/sun.frag."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.cascades import Cascade

Array = NDArray[np.floating]


def lifted(point: Array, normal: Array, to_sun: Array, texel: float, filter_width: int, error: float) -> Array:
    """Points (n, 3) moved along normals (n, 3) so far that a plane does not shadow itself. normal, to_sun (3,): unit;
    texel: metres; filter_width, error: texels."""
    sine = np.linalg.norm(np.cross(normal, to_sun), axis=1, keepdims=True)
    return point + normal * (texel * (0.5 * filter_width * sine + 0.5 + error))


def sun_share(depth: Array, cascade: Cascade, point: Array, filter_width: int) -> Array:
    """What part of the sun's light (n,) reaches points (n, 3), world, moved as by `lifted`; NaN outside the map. depth:
    (resolution, resolution), row 0 at the bottom."""
    at = (point - np.array(cascade.centre)) @ cascade.clip_from_centre[:3, :3].T / 2 + 0.5
    taps = np.arange(filter_width - 1) - 0.5 * filter_width + 1
    x, y = np.meshgrid(taps, taps)
    texels = at[:, None, :2] * cascade.resolution + np.stack([x.ravel(), y.ravel()], -1) - 0.5
    low = np.floor(texels).astype(int)
    part = texels - low
    share = np.zeros(len(point))
    for corner in np.ndindex(2, 2):
        column, row = np.clip(low + corner, 0, cascade.resolution - 1).transpose(2, 0, 1)
        weight = np.abs(1 - np.array(corner) - part).prod(-1)
        share += (weight * (at[:, 2:] <= depth[row, column])).mean(1)
    margin = 0.5 * filter_width / cascade.resolution
    inside = (np.abs(at[:, :2] - 0.5) <= 0.5 - margin).all(1)
    return np.where(inside, share, np.nan)
