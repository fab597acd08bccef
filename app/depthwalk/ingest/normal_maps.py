"""Make tangent-space normal maps of the pictures that MTL files name, some of which are height maps."""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from depthwalk.limits import MAX_NORMAL_SCALE

_BLUER = 24  # of 255: a picture with that much more blue than red and green, on average, holds normals


def is_height_map(texture: NDArray[np.uint8]) -> bool:
    """Return whether a picture (H, W, 4) named by `map_Bump` holds heights.

    MTL defines it as a height map, but exporters such as Blender's name a normal map there. Normals point outward on
    average, which makes such a picture blue; heights are grey.
    """
    red, green, blue = (float(texture[..., channel].mean()) for channel in range(3))
    return blue - max(red, green) < _BLUER


def normals_from_heights(heights: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the normal map of a height map that repeats.

    The format has no unit of height. As in programs that convert such maps, a step from black to white within a texel
    is a slope of 45°; the factor after `-bm` is the map's scale.

    Parameters
    ----------
    heights
        (H, W, 4) uint8, row 0 at the top; the mean of red, green and blue is the height.

    Returns
    -------
    numpy.ndarray
        (H, W, 4) uint8, x to the right, y upward, z outward, as (component + 1) / 2 · 255; alpha is 255.
    """
    height = heights[..., :3].mean(-1, dtype=np.float32) / np.float32(255)
    right = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / 2
    up = (np.roll(height, 1, 0) - np.roll(height, -1, 0)) / 2
    length = np.sqrt(1 + right**2 + up**2)
    made = np.full(heights.shape, 255, np.uint8)
    for channel, component in enumerate((-right, -up, np.ones_like(right))):
        made[..., channel] = np.round((component / length + 1) * 127.5)
    return made


def bump_scale(argument: str) -> float:
    """Return the factor after `-bm` in the argument of `norm` or `map_Bump`; 1 if there is none, or no number.

    It is clipped to plus and minus `MAX_NORMAL_SCALE`.
    """
    words = argument.split()
    following = [after for word, after in pairwise(words) if word.lower() == "-bm"]
    try:
        scale = float(following[0]) if argument.startswith("-") and following else 1.0
    except ValueError:
        return 1.0
    return min(max(scale, -MAX_NORMAL_SCALE), MAX_NORMAL_SCALE) if math.isfinite(scale) else 1.0
