"""Find the part of the picture that holds all objects, outside which only the background is seen."""

from dataclasses import replace

import numpy as np

from depthwalk.render.culling.occlusion_test import screen_extents
from depthwalk.render.view.bounds import Cylinders
from depthwalk.render.view.view import View

MOST_OBJECTS = 64
"""Scenes with more objects in sight rarely leave much of the picture empty."""

_MARGIN = 2.0  # pixels, for what closes cracks and smooths edges
_NEARER = 0.1  # of the near plane, which is fitted to spheres that may be smaller than the cylinders
_WORTH = 0.75  # of the picture: for a larger part, what a rasteriser spends on cutting it out is not saved

Part = tuple[int, int, int, int]
"""A part of the picture: x and y of its lower left corner, width and height, pixels."""


def objects_part(view: View, enclosing: Cylinders) -> Part | None:
    """Return the part of the picture in which n objects are seen.

    Parameters
    ----------
    view : the view of the picture, near and far plane fitted.
    enclosing : cylinders that enclose the objects, world.

    Returns
    -------
    The part, at least one pixel large; None where it may be most of the picture, as for an object close to the
    viewer.
    """
    nearer = replace(view, near=_NEARER * view.depth_range[0])
    extents = screen_extents(nearer, enclosing, _MARGIN)
    if not len(extents.depth) or not (extents.depth > 0).all():
        return None
    size = np.array(view.size)
    low = np.clip(np.floor(extents.low.min(0)), 0, size - 1).astype(int)
    high = np.clip(np.ceil(extents.high.max(0)), low + 1, size).astype(int)
    width, height = (high - low).tolist()
    if width * height > _WORTH * size.prod():
        return None
    return int(low[0]), int(low[1]), width, height
