"""Sort lamps into clusters of the view: records of the lamps in sight, and a list of those that reach each cluster.

A cluster is a square of the picture, sliced by distance (Olsson, Billeter and Assarsson 2012, "Clustered Deferred and
Forward Shading"). Each pixel goes through the list of its cluster and reads the G-buffer once; drawing a rectangle for
each lamp would read it, and blend, once per lamp. shaders/light/lamps.glsl reads the clusters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from depthwalk.colour import linear_from_srgb
from depthwalk.geometry.spatial_order import stable_order
from depthwalk.render import kernels
from depthwalk.render.shadows.spot_maps import lamp_spot
from depthwalk.render.view.bounds import Bounds, extents
from depthwalk.render.view.view import View
from depthwalk.types import Array, Rows

if TYPE_CHECKING:
    from depthwalk.scene.environment import LampParams


SQUARE = 32  # pixels along the edge of a cluster in the picture
SLICES_PER_DOUBLING = 2  # slices in which the distance doubles
SLICES = 16  # the first ends at √2 m, each further one √2 times as far as the one before; the last has no end
FADE = 0.8  # part of a cone's angle within which it has its full brightness

LAMP_RECORD = np.dtype([("place", "4f4"), ("light", "4f4"), ("cone", "4f4"), ("shadow", "4f4")])
"""A lamp as shaders fetch it.

place: its position relative to the viewer, metres, and its range, metres. light: its linear RGB at 1 m, and the cosine
at which its cone ends. cone: the unit vector in which it shines, and 1 over the difference between the cosines where
the cone is brightest and where it ends. shadow: the vector to the right across its shadow map, as long as 1 over half
the map's width at 1 m, and the map's tile, −1 for none.
"""

NUMBERS_RECORD = np.dtype([("numbers", "4f4")])
"""Four numbers as shaders fetch them."""

_NO_TILES: Mapping[int, int] = MappingProxyType({})


@dataclass(frozen=True, kw_only=True)
class LightClusters:
    """Hold the lamps of a view, by cluster.

    Attributes
    ----------
    records
        (n,) LAMP_RECORD of the lamps in sight.
    cells
        (k,) NUMBERS_RECORD of the clusters, slice by slice, row by row from the lower left: where the cluster's list
        begins in `lists`, how many lamps it has, and how many of these have shadow maps, which come first.
    lists
        (l,) NUMBERS_RECORD, each with four rows of `records`: the lists of all clusters, one after the other.
    across
        Number of columns and of rows of squares.
    """

    records: NDArray[np.void]
    cells: NDArray[np.void]
    lists: NDArray[np.void]
    across: tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class LampTable:
    """Hold the lamps of a scene in arrays, as long as none of them changes.

    Attributes
    ----------
    bounds
        The spheres that n lamps light, metres, world.
    records
        (n,) LAMP_RECORD of the lamps, without what differs from frame to frame: their positions relative to the viewer
        are 0, and they have no shadow maps, though spot lights have the vector across one.
    """

    bounds: Bounds
    records: NDArray[np.void]


def lamp_table(lights: Sequence["LampParams"]) -> LampTable:
    """Return the arrays of all lamps of a scene, `lights`."""
    position = np.array([light.position for light in lights], float).reshape(-1, 3)
    reach = np.array([light.range for light in lights], float)
    return LampTable(bounds=Bounds(position, reach), records=_lamp_records(lights))


def visible_lamps(view: View, lamps: LampTable, tiles: Mapping[int, int] = _NO_TILES) -> LightClusters:
    """Find the lamps that may light something in sight, and sort them into clusters.

    Parameters
    ----------
    view
        The view of the picture.
    lamps
        All lamps of the scene.
    tiles
        The tile of the shadow map of each lamp that has one, by the lamp's number among all.

    Returns
    -------
    LightClusters
        The lamps in sight and the lists of the clusters.
    """
    tile = np.full(len(lamps.records), -1)
    tile[list(tiles)] = list(tiles.values())
    across = -(-view.size[0] // SQUARE), -(-view.size[1] // SQUARE)
    shape = np.array([*across, SLICES])
    if (loops := kernels.loaded()) is None:
        seen, mapped, first, last = boxes_in_sight(view, lamps.bounds, tile)
        cells, lists = cluster_lists(first, last, shape, mapped)
    else:
        seen, mapped, first, last = loops.boxes_in_sight(
            centre=lamps.bounds.centre,
            reach=lamps.bounds.bounding_radius,
            tile=tile,
            eye=view.position,
            axes=view.axes,
            tangent=np.array(view.half_extent),
            shear=np.array(view.shear),
            near=view.depth_range[0],
            squares=np.array(view.size) / SQUARE,
            slices=SLICES_PER_DOUBLING,
        )
        cells, lists = loops.cluster_lists(first, last, shape, mapped)
    records = lamps.records[seen]
    records["place"][:, :3] = lamps.bounds.centre[seen] - view.position
    records["shadow"][:, 3] = tile[seen]
    return LightClusters(
        records=records, cells=cells.view(NUMBERS_RECORD)[:, 0], lists=lists.view(NUMBERS_RECORD)[:, 0], across=across
    )


def _lamp_records(lights: Sequence["LampParams"]) -> NDArray[np.void]:
    """Return `LampTable.records` (n,) of lamps."""
    records = np.zeros(len(lights), LAMP_RECORD)
    if not lights:
        return records
    colour = linear_from_srgb([light.colour for light in lights])
    axis = np.array([light.direction or (0, -1, 0) for light in lights], float)
    half = np.radians([light.angle / 2 for light in lights])
    spot = np.array([light.direction is not None for light in lights])
    edge, full = np.cos(half), np.cos(FADE * half)
    records["place"][:, 3] = [light.range for light in lights]
    records["light"][:, :3] = colour * np.array([light.intensity for light in lights])[:, None]
    records["light"][:, 3] = np.where(spot, edge, -3)  # every direction is in the middle of a point light's cone
    records["cone"][:, :3] = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    records["cone"][:, 3] = np.where(spot, 1 / (full - edge), 1)
    records["shadow"][:, 3] = -1
    for record, light in zip(records, lights, strict=True):
        if light.direction is not None:
            seen = lamp_spot(light, 1)
            record["shadow"][:3] = seen.axes[0] / seen.tangent
    return records


def boxes_in_sight(view: View, bounds: Bounds, tile: Rows) -> tuple[Rows, int, Array, Array]:
    """Find the lamps that may light something in sight, and the boxes of clusters that they reach.

    Parameters
    ----------
    view
        The view of the picture.
    bounds
        The spheres that n lamps light, metres, world.
    tile
        (n,) the tile of each lamp's shadow map, −1 for none.

    Returns
    -------
    tuple[Rows, int, Array, Array]
        (k,) rows of the lamps, first those with shadow maps, how many these are, and (k, 3) lower and upper corners of
        their boxes, in columns, rows and slices of clusters.
    """
    low, high = extents(view, bounds)
    forward = (bounds.centre - view.position) @ view.axes[2]
    seen = np.flatnonzero((forward + bounds.bounding_radius > 0) & (low < high).all(1))
    is_mapped = tile[seen] >= 0
    seen = np.concatenate([seen[is_mapped], seen[~is_mapped]])
    forward, radius = forward[seen, None], bounds.bounding_radius[seen, None]
    first, last = (
        np.column_stack(
            [(corner[seen] + 1) / 2 * view.size / SQUARE, SLICES_PER_DOUBLING * np.log2(np.maximum(distance, 1))]
        )
        for corner, distance in ((low, forward - radius), (high, forward + radius))
    )
    return seen, int(is_mapped.sum()), first, last


def cluster_lists(first: Array, last: Array, shape: Rows, mapped: int) -> tuple[Array, Array]:
    """List the boxes that overlap each of c clusters, those of the first cluster first, rising within each.

    Parameters
    ----------
    first, last
        (n, 3) lower and upper corners of the boxes, in columns, rows and slices of clusters.
    shape
        (3,) number of columns, rows and slices.
    mapped
        How many boxes, the first of them, are those of lamps with shadow maps.

    Returns
    -------
    tuple[Array, Array]
        (c, 4) and (l, 4) float32, the columns of `LightClusters.cells` and `LightClusters.lists`.
    """
    numbers, counts = _boxes_by_cluster(first, last, shape)
    cells = np.zeros((len(counts), 4), np.float32)
    cells[:, 0], cells[:, 1] = np.cumsum(counts) - counts, counts
    cluster = np.repeat(np.arange(len(counts)), counts)
    cells[:, 2] = np.bincount(cluster[numbers < mapped], minlength=len(counts))
    lists = np.zeros((-(-len(numbers) // 4), 4), np.float32)
    lists.reshape(-1)[: len(numbers)] = numbers
    return cells, lists


def _boxes_by_cluster(first: Array, last: Array, shape: Rows) -> tuple[Rows, Rows]:
    """List for each cluster the boxes that overlap it, cluster by cluster; see `cluster_lists`.

    Returns
    -------
    numbers
        (m,) indices of boxes, those of the first cluster first, rising within each.
    counts
        (c,) how many of these belong to each cluster, column by column within a row, row by row within a slice.
    """
    begin = np.clip(np.floor(first).astype(int), 0, shape - 1)
    size = np.clip(np.floor(last).astype(int), 0, shape - 1) - begin + 1
    volume = size.prod(1)
    number = np.repeat(np.arange(len(volume)), volume)
    within = np.arange(len(number)) - np.repeat(np.cumsum(volume) - volume, volume)  # counts the clusters of each box
    cluster, stride = np.zeros_like(number), 1
    for axis, length in enumerate(shape.tolist()):
        cluster += stride * (begin[number, axis] + within % size[number, axis])
        within, stride = within // size[number, axis], stride * length
    return number[stable_order(cluster)], np.bincount(cluster, minlength=stride)
