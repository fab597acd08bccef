"""What the pass `material_resolve` is told: the objects that may be visible, by the numbers that passes write."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.view.bounds import Bounds, extents
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.scene.arrays import Objects
from depthwalk.types import Array

# What material_resolve.frag reads per object: the viewer in its frame, and its scale; its rotation; the depth that stands
# for its asset, and nothing else.
SURFACE_RECORD = np.dtype([("viewer", "4f4"), ("rotation", "4f4"), ("level", "4f4")])


_CROWD = 1 << 14  # objects of an asset, of which it is not asked where they are: likely everywhere
# Assets are told apart by depths CLOSED + k / LEVELS, which float32 and a depth buffer of 24 bits hold apart; pixels
# that one covers in part by k / LEVELS, in front of all others.
LEVELS = 1 << 17
FULL_COVERAGE = 0.5


@dataclass(frozen=True, kw_only=True)
class MaterialRecords:
    """records: (1 + n,) SURFACE_RECORD by number, 0 is none, at the far plane; assets: (a,) those that may be visible;
    level: (a,) the depth that stands for each, see FULL_COVERAGE; low, high: (a, 2), corners of the part of the picture in
    which it may be, −1 to 1, y upward."""

    records: NDArray[np.void]
    assets: NDArray[np.integer]
    level: Array
    low: Array
    high: Array


def shading(view: View, objects: Objects, bounds: Bounds, tiled: NDArray[np.bool_]) -> MaterialRecords:
    """For n objects in the order of their numbers, which are 1 and on. tiled: (n,), they have intermediate images."""
    viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
    assets, group = np.unique(objects.asset, return_inverse=True)
    level = FULL_COVERAGE + (1 + np.arange(len(assets))) / LEVELS
    records = np.zeros(1 + len(objects), SURFACE_RECORD)
    records["viewer"][1:] = np.column_stack([viewer, objects.scale])
    records["rotation"][1:] = objects.rotation
    records["level"][0, 0] = 1
    records["level"][1:, :2] = np.column_stack([level[group], tiled])
    low, high = np.ones((len(assets), 2)), -np.ones((len(assets), 2))
    crowd = np.bincount(group, minlength=len(assets)) > _CROWD
    low[crowd], high[crowd] = -1, 1
    few = np.flatnonzero(~crowd[group])
    for corner, gather, each in zip(
        (low, high), (np.minimum, np.maximum), extents(view, bounds.take(few)), strict=True
    ):
        gather.at(corner, group[few], each)
    half_pixel = 1 / np.array(view.size)  # as far a pixel's samples may be from its middle
    return MaterialRecords(records=records, assets=assets, level=level, low=low - half_pixel, high=high + half_pixel)
