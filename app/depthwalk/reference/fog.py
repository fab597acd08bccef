"""Twin of shaders/fog/fog.frag."""

import numpy as np

from depthwalk.types import Array


def fog_density(y: Array, density: float, height: float, falloff: float) -> Array:
    """Part of the light lost per metre at the heights `y`: `density` up to `height`, e-fold thinner per `falloff`."""
    return density * np.exp(np.minimum(height - y, 0) / falloff)


def fog_through(viewer_y: float, way: Array, density: float, height: float, falloff: float) -> Array:
    """Part (n,) of the light that comes through along `way` (n, 3), metres, from a viewer at the height `viewer_y`:
    exp of minus the density's integral."""

    def below(y: Array) -> Array:
        return np.where(y < height, y - height, falloff * -np.expm1(np.minimum(height - y, 0) / falloff))

    start, rise = np.array(viewer_y), way[:, 1]
    level = np.abs(rise) < 1e-6 * falloff
    mean = (below(start + rise) - below(start)) / np.where(level, 1, rise)
    mean = np.where(level, fog_density(start + rise / 2, 1, height, falloff), mean)
    return np.exp(-density * mean * np.linalg.norm(way, axis=1))


def fog_before_sky(viewer_y: float, rise: Array, density: float, height: float, falloff: float) -> Array:
    """The same (n,) for endless ways; rise: y (n,) of their unit vectors."""
    left = falloff * np.exp(min(height - viewer_y, 0) / falloff) + max(height - viewer_y, 0)
    return np.where(rise > 0, np.exp(-density * left / np.maximum(rise, 1e-6)), 0.0)
