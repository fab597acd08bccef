"""Give the depths of planar depth images as parts of their objects' depths, as height fields have them."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject

EMPTY = 1e20
"""Depth of a texel without a surface. Blended with others, however little of it, it lies behind the box."""


def relative_depth(baked: BakedObject) -> NDArray[np.float32]:
    """Return the depths (H, W) of one planar depth image as parts of the object's depth, `EMPTY` where none is."""
    depth = baked.images[0].depth
    return np.where(np.isfinite(depth), depth / np.float32(baked.cylinder.height), np.float32(EMPTY))
