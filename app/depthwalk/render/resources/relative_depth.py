"""Normalise the depths of planar depth images to the depths of their objects, for height fields."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject

EMPTY = 1e20
"""Depth of a texel without a surface, so large that any blend with other depths lies behind the box."""


def relative_depth(baked: BakedObject) -> NDArray[np.float32]:
    """Return the depths (H, W) of a planar depth image, 0 to 1 over the object's depth; `EMPTY` without a surface."""
    depth = baked.images[0].depth
    return np.where(np.isfinite(depth), depth / np.float32(baked.cylinder.height), np.float32(EMPTY))
