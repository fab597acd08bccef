"""Point and spot lights as the shaders take them: records, and a list of those that reach each cell of the view.

Cells are squares of the picture, sliced by distance (Olsson, Billeter and Assarsson 2012, "Clustered Deferred and
Forward Shading"). A pixel goes through the list of its own and reads the G-buffer once, where drawing each lamp's
rectangle would read it, and blend, once per lamp.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from depthwalk.colour import linear_from_srgb
from depthwalk.render.shadows.spot_maps import spot_of
from depthwalk.render.view.bounds import Bounds, extents
from depthwalk.render.view.view import View
from depthwalk.types import Array

if TYPE_CHECKING:
    from depthwalk.scene.environment import LampParams


SQUARE = 32  # pixels
SLICES_PER_DOUBLING = 2  # of the distance
SLICES = 16  # the first ends at √2 m, each of the others √2 times as far as the one before; the last has no end
FADE = 0.8  # part of a cone's angle within which it is as bright as it gets
# Where it is, relative to the viewer, and its range; its light at 1 m, linear, and the cosine at which its cone ends;
# where it shines, and 1 over how much more the cosine is where the cone is brightest; to the right across its shadow
# map, 1 over half the map's width at 1 m long, and the map's tile, −1 for none.
LAMP_RECORD = np.dtype([("place", "4f4"), ("light", "4f4"), ("cone", "4f4"), ("shadow", "4f4")])
NUMBERS_RECORD = np.dtype([("numbers", "4f4")])
_NONE: Mapping[int, int] = MappingProxyType({})


@dataclass(frozen=True, kw_only=True)
class LightClusters:
    """records: (n,) LAMP_RECORD of those in sight; cells: (k,) NUMBERS_RECORD, slice by slice, row by row from the
    lower left: the first in the list, how many, and how many of these have shadow maps, which come first; lists: their
    numbers, four to a NUMBERS_RECORD; across: columns and rows of squares."""

    records: NDArray[np.void]
    cells: NDArray[np.void]
    lists: NDArray[np.void]
    across: tuple[int, int]


def visible_lamps(view: View, lights: Sequence["LampParams"], tiles: Mapping[int, int] = _NONE) -> LightClusters:
    """tiles: those of the shadow maps of the lights, by their numbers, that have one."""
    position = np.array([light.position for light in lights], float).reshape(-1, 3)
    bounds = Bounds(position, np.array([light.range for light in lights], float))
    low, high = extents(view, bounds)
    forward = (position - view.position) @ view.axes[2]
    seen = np.flatnonzero((forward + bounds.bounding_radius > 0) & (low < high).all(1))
    mapped = np.isin(seen, list(tiles))
    seen = np.concatenate([seen[mapped], seen[~mapped]])
    forward, reach = forward[seen, None], bounds.bounding_radius[seen, None]
    across = -(-view.size[0] // SQUARE), -(-view.size[1] // SQUARE)
    shape = *across, SLICES
    first, last = (
        np.column_stack(
            [(corner[seen] + 1) / 2 * view.size / SQUARE, SLICES_PER_DOUBLING * np.log2(np.maximum(distance, 1))]
        )
        for corner, distance in ((low, forward - reach), (high, forward + reach))
    )
    numbers, counts = lamps_by_cluster(first, last, shape)
    cells = np.zeros(len(counts), NUMBERS_RECORD)
    cells["numbers"][:, 0] = np.cumsum(counts) - counts
    cells["numbers"][:, 1] = counts
    cells["numbers"][:, 2] = lamps_by_cluster(first[: mapped.sum()], last[: mapped.sum()], shape)[1]
    lists = np.zeros(-(-len(numbers) // 4), NUMBERS_RECORD)
    lists["numbers"].reshape(-1)[: len(numbers)] = numbers
    records = lamp_records(view, [lights[k] for k in seen.tolist()])
    for record, number in zip(records, seen[: mapped.sum()].tolist(), strict=False):
        spot = spot_of(lights[number], 1)
        record["shadow"] = *(spot.axes[0] / spot.tangent), tiles[number]
    return LightClusters(records=records, cells=cells, lists=lists, across=across)


def lamp_records(view: View, lights: Sequence["LampParams"]) -> NDArray[np.void]:
    """Of lights without shadow maps."""
    records = np.zeros(len(lights), LAMP_RECORD)
    if not lights:
        return records
    colour = linear_from_srgb([light.colour for light in lights])
    axis = np.array([light.direction or (0, -1, 0) for light in lights], float)
    half = np.radians([light.angle / 2 for light in lights])
    spot = np.array([light.direction is not None for light in lights])
    edge, full = np.cos(half), np.cos(FADE * half)
    records["place"][:, :3] = np.array([light.position for light in lights], float) - view.position
    records["place"][:, 3] = [light.range for light in lights]
    records["light"][:, :3] = colour * np.array([light.intensity for light in lights])[:, None]
    records["light"][:, 3] = np.where(spot, edge, -3)  # all directions are a cone's middle
    records["cone"][:, :3] = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    records["cone"][:, 3] = np.where(spot, 1 / (full - edge), 1)
    records["shadow"][:, 3] = -1
    return records


def lamps_by_cluster(
    first: Array, last: Array, shape: tuple[int, int, int]
) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Numbers (m,) of n boxes, cell by cell, and how many there are in each of the cells. first, last: (n, 3), where
    the boxes begin and end, in columns, rows and slices of cells; shape: how many there are of these."""
    begin = np.clip(np.floor(first).astype(int), 0, np.array(shape) - 1)
    size = np.clip(np.floor(last).astype(int), 0, np.array(shape) - 1) - begin + 1
    each = size.prod(1)
    number = np.repeat(np.arange(len(each)), each)
    left = np.arange(len(number)) - np.repeat(np.cumsum(each) - each, each)
    cell, stride = np.zeros_like(number), 1
    for axis, cells in enumerate(shape):
        cell += stride * (begin[number, axis] + left % size[number, axis])
        left, stride = left // size[number, axis], stride * cells
    return number[np.argsort(cell, kind="stable")], np.bincount(cell, minlength=stride)
