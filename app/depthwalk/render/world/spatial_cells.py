"""Sort objects into cells of neighbours: a bounding volume hierarchy of one level.

Culling tests the boxes of cells first, then only the objects of cells that may be visible.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.spatial_order import cell_members, kd_tree_order
from depthwalk.render import kernels
from depthwalk.render.view.bounds import Bounds, Cylinders, box_cylinders
from depthwalk.render.view.view import View
from depthwalk.types import Array, Ints, Mask, Rows

_OBJECTS = 256  # per cell; 64 and 1024 took as long
_LEAF = 64  # objects per run, within a cell, that lie even closer together


@dataclass(kw_only=True)
class SpatialCells:
    """Hold n objects sorted into c cells of neighbours.

    Attributes
    ----------
    order : (n,) rows of the objects, cell by cell.
    first : (c + 1,) where each cell begins in `order`.
    low : (c, 3) least corner of the box around all bounding spheres of a cell, metres, world.
    high : (c, 3) greatest corner of that box, metres, world.
    largest : (c,) the largest bounding radius of a cell's objects, metres.
    version : (c,) how often the box of each cell was refitted to objects that moved.
    """

    order: NDArray[np.int32]
    first: Ints
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    largest: NDArray[np.float32]
    version: Ints

    @cached_property
    def cell_of_row(self) -> NDArray[np.int32]:
        """Return the cell (n,) of each object."""
        cell = np.empty(len(self.order), np.int32)
        cell[self.order] = np.repeat(np.arange(len(self.low), dtype=np.int32), np.diff(self.first))
        return cell

    def batches(self, view: View, min_pixels: float, size: int) -> list[Rows]:
        """Return the cells whose objects may be seen, the nearest first, in batches that grow.

        The first batch has about `size` objects, the next four times as many, and so on; at least one batch is
        returned, which may be empty.

        Parameters
        ----------
        view : the view of the picture.
        min_pixels : diameter of objects, pixels, below which they are not drawn.
        size : how many objects the first batch has, about.

        Returns
        -------
        For each batch (k,) numbers of its cells.
        """
        loops = kernels.loaded()
        if loops is not None:
            seen_through = view.position, view.axes, np.array(view.half_extent), min_pixels / (2 * view.detail_pixels)
            cells, nearest_corner = loops.cells_in_sight(self.low, self.high, self.largest, *seen_through)
        else:
            cells = np.flatnonzero(self._may_show(view, min_pixels))
            forward, reach = self.along(view, cells)
            nearest_corner = forward - reach
        cells = cells[np.argsort(nearest_corner, kind="stable")]
        objects = self.first[cells + 1] - self.first[cells]
        before = np.cumsum(objects) - objects
        batch = np.log2(3 * before / size + 1) // 2  # size · (1 + 4 + … + 4^(k − 1)) objects come before batch k
        ends = [0, *((batch[1:] != batch[:-1]).nonzero()[0] + 1).tolist(), len(cells)]
        return [cells[start:end] for start, end in pairwise(ends)]

    def count_objects(self, cells: Rows) -> int:
        """Return how many objects the cells with the numbers `cells` (k,) have together."""
        return int((self.first[cells + 1] - self.first[cells]).sum())

    def along(self, view: View, cells: Rows) -> tuple[Array, Array]:
        """Return where cells lie along the view axis.

        Parameters
        ----------
        view : the view of the picture.
        cells : (k,) numbers of the cells.

        Returns
        -------
        (k,) distances of the middles of the cells' boxes, and (k,) how far the boxes reach to either side of these,
        metres along the view axis.
        """
        low, high = self.low.take(cells, 0), self.high.take(cells, 0)
        middle, half = (high + low) / 2, (high - low) / 2
        return (middle - view.position) @ view.axes[2], half @ np.abs(view.axes[2])

    def cylinders(self, cells: Rows) -> Cylinders:
        """Return the upright cylinders, world, about the boxes of the cells with the numbers `cells` (k,)."""
        return box_cylinders(self.low[cells], self.high[cells])

    def visible(self, view: View, bounds: Bounds, min_pixels: float, cells: Rows) -> tuple[Rows, Array]:
        """Return the objects of `cells` that the view may show, cell by cell, and their distances.

        Parameters
        ----------
        view : the view of the picture.
        bounds : bounding spheres of all objects, world.
        min_pixels : diameter of objects, pixels, below which they are left out.
        cells : (k,) numbers of the cells.

        Returns
        -------
        (m,) int64 rows of the objects, neighbours close together, and (m,) distances of their centres, metres along the
        view axis.
        """
        return _in_sight(view, bounds, min_pixels, self.order, self.first, cells)

    def _may_show(self, view: View, min_pixels: float) -> Mask:
        """Return whether any object of each cell (c,) may be seen."""
        tan_x, tan_y = view.half_extent
        outward = [[1, 0, -tan_x], [-1, 0, -tan_x], [0, 1, -tan_y], [0, -1, -tan_y], [0, 0, -1]]
        planes = np.array(outward) @ view.axes  # normals (5, 3) of the frustum's sides, and of the viewer's back
        half, middle = (self.high - self.low) / 2, (self.high + self.low) / 2 - view.position
        inside = (middle @ planes.T < half @ np.abs(planes).T).all(1)
        gap = np.linalg.norm(np.maximum(np.abs(middle) - half, 0), axis=1)
        return np.asarray(inside & (2 * view.detail_pixels * self.largest >= min_pixels * gap))

    def refit(self, bounds: Bounds, rows: Rows) -> None:
        """Refit the boxes of cells whose objects moved.

        Objects stay in their cells: one that moves far from the others makes its cell large.

        Parameters
        ----------
        bounds : bounding spheres of all objects, world.
        rows : the rows of the objects that moved.
        """
        cells = np.unique(self.cell_of_row[rows])
        of_cells = cell_members(self.first, cells)
        starts = np.cumsum(np.diff(self.first)[cells]) - np.diff(self.first)[cells]
        fitted = enclosing_boxes(bounds.take(self.order[of_cells]), starts)
        self.low[cells], self.high[cells], self.largest[cells] = fitted
        self.version[cells] += 1


def sort_into_cells(bounds: Bounds) -> SpatialCells:
    """Sort objects into cells of 256 neighbours each, and within these into runs of 64 that lie closer together.

    Parameters
    ----------
    bounds : (n,) bounding spheres of the objects, world.

    Returns
    -------
    The cells, with boxes that hold the spheres.
    """
    count = len(bounds.bounding_radius)
    order = kd_tree_order(bounds.centre, _LEAF).astype(np.int32)
    first = np.append(np.arange(0, count, _OBJECTS), count)
    low, high, largest = enclosing_boxes(bounds.take(order), first[:-1])
    version = np.zeros(len(low), np.int64)
    return SpatialCells(order=order, first=first, low=low, high=high, largest=largest, version=version)


def in_sight(view: View, bounds: Bounds, min_pixels: float, rows: Rows) -> tuple[Rows, Array]:
    """Return which of the objects `rows` the view may show, as `SpatialCells.visible` does for those of cells.

    Parameters
    ----------
    view : the view of the picture.
    bounds : bounding spheres of all objects, world.
    min_pixels : diameter of objects, pixels, below which they are left out.
    rows : (k,) rows of the objects.

    Returns
    -------
    (m,) int64 rows of those in sight, in the given order, and (m,) distances of their centres, metres along the view
    axis.
    """
    return _in_sight(view, bounds, min_pixels, rows.astype(np.int32), np.array([0, len(rows)]), np.zeros(1, np.int64))


def _in_sight(
    view: View, bounds: Bounds, min_pixels: float, order: Rows, first: Rows, cells: Rows
) -> tuple[Rows, Array]:
    """Return the objects of `cells` (k,) that a view may show; order, first: see `SpatialCells`."""
    loops = kernels.loaded()
    if loops is not None:
        rows, forward = loops.visible(
            centre=bounds.centre,
            radius=bounds.bounding_radius,
            order=order,
            first=first,
            cells=cells,
            position=view.position,
            axes=view.axes,
            tangent=np.array(view.half_extent),
            shear=np.array(view.shear),
            min_size=min_pixels / (2 * view.detail_pixels),
        )
        return rows, forward
    rows = order[cell_members(first, cells)].astype(np.int64)
    near = bounds.take(rows)
    seen, forward = near.seen(view)
    if min_pixels:
        apart = near.centre.take(seen, 0) - view.position
        squared = np.einsum("ni,ni->n", apart, apart)  # a norm takes five times as long
        large = 2 * view.detail_pixels * near.bounding_radius[seen] >= min_pixels * np.sqrt(squared)
        seen, forward = seen[large], forward[large]
    return rows[seen], forward


def nearest_first(rows: Rows, forward: Array) -> Rows:
    """Sort objects by their distance; equally distant ones keep their order.

    Parameters
    ----------
    rows : (m,) rows of the objects.
    forward : (m,) distances of their centres, metres along the view axis.

    Returns
    -------
    (m,) the rows, the nearest first.
    """
    return rows[np.argsort(forward, kind="stable")]


def nearest(forward: Array, count: int) -> Rows:
    """Return which objects are nearest, without sorting the others.

    Parameters
    ----------
    forward : (m,) distances of the objects' centres, metres along the view axis.
    count : how many to return, at least 1.

    Returns
    -------
    (count,), or (m,) if these are fewer: indices of the nearest; among equally distant ones, the first.
    """
    if len(forward) <= count:
        return np.arange(len(forward))
    (candidates,) = (forward <= np.partition(forward, count - 1)[count - 1]).nonzero()
    return nearest_first(candidates, forward[candidates])[:count]


def boxes_about(bounds: Bounds, rows: Rows, size: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the boxes around each run of `size` consecutive objects.

    Parameters
    ----------
    bounds : bounding spheres of all objects, world.
    rows : (m,) rows of the objects.
    size : how many objects a box holds; the last box may hold fewer.

    Returns
    -------
    (k, 3) least and (k, 3) greatest corners, metres, world.
    """
    loops = kernels.loaded()
    if loops is not None:
        low, high = loops.boxes_about(rows, bounds.centre, bounds.bounding_radius, size)
        return low, high
    low, high, _ = enclosing_boxes(bounds.take(rows), np.arange(0, len(rows), size))
    return low, high


def enclosing_boxes(
    bounds: Bounds, starts: Rows
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Return the box around each run of spheres, and the largest radius in it.

    Parameters
    ----------
    bounds : spheres, world, run by run.
    starts : (c,) number of the first sphere of each run.

    Returns
    -------
    (c, 3) least and (c, 3) greatest corners of the boxes, metres, world, and (c,) largest radii, metres, all float32.
    """
    if not len(starts):
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32), np.zeros(0, np.float32)
    radius = bounds.bounding_radius[:, None]
    low = np.minimum.reduceat(bounds.centre - radius, starts)
    high = np.maximum.reduceat(bounds.centre + radius, starts)
    # Rounding to float32 must not shrink the boxes.
    return (
        np.nextafter(low.astype(np.float32), np.float32(-np.inf)),
        np.nextafter(high.astype(np.float32), np.float32(np.inf)),
        np.maximum.reduceat(bounds.bounding_radius, starts).astype(np.float32),
    )
