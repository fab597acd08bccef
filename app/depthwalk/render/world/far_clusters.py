"""Group far neighbours into clusters that share one impostor: a hierarchical level of detail (HLOD).

An object a few pixels high costs little to draw, but as much as any other to plan, cache and composite. From far away,
neighbours hardly move against each other, so their common tile is reused like any other, within a bound given by the
box that holds them all (`render.impostors.reprojection_error`). A frame then costs what its clusters cost, until one is
warped again. This module holds their data; `render.draw.far_cluster_planner` decides when and how they are drawn.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.lod_geometry import IMAGE_BITS
from depthwalk.geometry.spatial_order import cell_members, within_runs
from depthwalk.render.view.bounds import Bounds, Cylinders, box_cylinders
from depthwalk.render.view.view import View
from depthwalk.render.world.spatial_cells import SpatialCells, enclosing_boxes
from depthwalk.types import Ints, Mask, Rows

MEMBERS = 1 << 16 - IMAGE_BITS  # at most: a texel of the atlas holds the member in the bits that its image leaves
# Least distance, in half diagonals of a cell. The four clusters of a cell are about half as wide as it, so that the
# parallax within one is an eighth of its own.
_FAR = 4.0


@dataclass(kw_only=True)
class FarClusters:
    """Hold k clusters: runs of neighbouring objects, each within one of c spatial cells.

    Attributes
    ----------
    order : (n,) rows of the objects, see `SpatialCells`.
    first : (k + 1,) where each cluster begins in `order`.
    of_cell : (c + 1,) the first cluster of each cell.
    able : (c,) whether all objects of the cell may share tiles.
    low : (k, 3) least corner of each cluster's box, metres, world.
    high : (k, 3) greatest corner of each cluster's box, metres, world.
    version : (k,) how often objects of each cluster's cell have moved.
    cell_version : (c,) how often objects of each cell had moved when the boxes were fitted, see `SpatialCells.version`.
    """

    order: NDArray[np.int32]
    first: Rows
    of_cell: Rows
    able: Mask
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    version: Ints
    cell_version: Ints

    def __len__(self) -> int:
        return len(self.version)

    def far(self, view: View, cells: SpatialCells, numbers: Rows, pixels: float) -> Mask:
        """Return which cells may be drawn by clusters.

        Such cells are far away for their size, and no object in them is `pixels` pixels across. They lie entirely below
        or above the viewer: at eye level most of their objects hide each other, so that it is cheaper to test these one
        by one.

        Parameters
        ----------
        view : the view of the picture.
        cells : the cells that the clusters were made of.
        numbers : (m,) numbers of the cells to test.
        pixels : diameter above which objects are drawn one by one, pixels.

        Returns
        -------
        (m,) whether each cell may.
        """
        low, high = cells.low[numbers], cells.high[numbers]
        half, middle = (high - low) / 2, (high + low) / 2 - view.position
        apart = np.maximum(np.abs(middle) - half, 0)
        gap = np.linalg.norm(apart, axis=1)
        small = 2 * view.detail_pixels * cells.largest[numbers] < pixels * gap
        beside = apart[:, 1] == 0
        return np.asarray(self.able[numbers] & small & ~beside & (gap > _FAR * np.linalg.norm(half, axis=1)))

    def visible(self, view: View, cells: Rows) -> Rows:
        """Return the clusters that the view may show.

        Parameters
        ----------
        view : the view of the picture.
        cells : (m,) numbers of the cells whose clusters are tested.

        Returns
        -------
        (n,) numbers of the clusters, nearest first.
        """
        numbers = cell_members(self.of_cell, cells)
        return numbers[self.bounds(numbers).visible(view)[0]]

    def bounds(self, numbers: Rows) -> Bounds:
        """Return spheres, world, about the boxes of the clusters with the `numbers` (m,)."""
        low, high = self.low[numbers], self.high[numbers]
        return Bounds((low + high) / 2, np.linalg.norm(high - low, axis=1) / 2)

    def cylinders(self, numbers: Rows) -> Cylinders:
        """Return upright cylinders, world, about the boxes of the clusters with the `numbers` (m,)."""
        return box_cylinders(self.low[numbers], self.high[numbers])

    def sizes(self, numbers: Rows) -> Rows:
        """Return how many objects (m,) the clusters with the `numbers` (m,) have."""
        return self.first[numbers + 1] - self.first[numbers]

    def members(self, numbers: Rows) -> tuple[Rows, Rows]:
        """Return the objects of the clusters `numbers`, cluster by cluster.

        Parameters
        ----------
        numbers : (m,) numbers of the clusters.

        Returns
        -------
        (n,) rows of the objects, and (m,) how many each cluster has.
        """
        return self.order[cell_members(self.first, numbers)], self.sizes(numbers)

    def first_members(self, numbers: Rows) -> Rows:
        """Return the row (m,) of the first object of each of the clusters with the `numbers` (m,)."""
        return self.order[self.first[numbers]]

    def resident(self, numbers: Rows, is_resident: Callable[[Rows], Mask]) -> Mask:
        """Return which clusters have all their objects on the GPU.

        Parameters
        ----------
        numbers : (m,) numbers of the clusters.
        is_resident : takes rows (n,) of objects and returns which of them (n,) are on the GPU, see
            `FrameResidency.resident`.

        Returns
        -------
        (m,) whether all objects of each cluster are.
        """
        rows, count = self.members(numbers)
        resident = is_resident(rows)
        return np.logical_and.reduceat(resident, np.cumsum(count) - count) if len(count) else resident

    def follow(self, cells: SpatialCells, bounds: Bounds) -> None:
        """Refit the boxes of cells whose objects moved since the last call.

        Parameters
        ----------
        cells : the cells that the clusters were made of.
        bounds : bounding spheres of all objects, world.
        """
        moved = np.flatnonzero(cells.version != self.cell_version)
        if not len(moved):
            return
        self.cell_version[moved] = cells.version[moved]
        numbers = cell_members(self.of_cell, moved)
        rows, count = self.members(numbers)
        self.low[numbers], self.high[numbers], _ = enclosing_boxes(bounds.take(rows), np.cumsum(count) - count)
        self.version[numbers] += 1


def make_far_clusters(cells: SpatialCells, bounds: Bounds, shareable: Mask) -> FarClusters:
    """Divide every cell into clusters of up to `MEMBERS` objects.

    Parameters
    ----------
    cells : the cells to divide.
    bounds : bounding spheres of all n objects, world.
    shareable : (n,) which objects may share a tile: those drawn by depth images that are seen from all around.

    Returns
    -------
    The clusters of all cells.
    """
    count = -(-np.diff(cells.first) // MEMBERS)  # of clusters per cell
    of_cell = np.concatenate([[0], np.cumsum(count)])
    first = np.append(np.repeat(cells.first[:-1], count) + MEMBERS * within_runs(count), len(cells.order))
    low, high, _ = enclosing_boxes(bounds.take(cells.order), first[:-1])
    able = np.logical_and.reduceat(shareable[cells.order], cells.first[:-1]) if len(count) else np.zeros(0, bool)
    return FarClusters(
        order=cells.order,
        first=first,
        of_cell=of_cell,
        able=able,
        low=low,
        high=high,
        version=np.zeros(len(low), np.int64),
        cell_version=cells.version.copy(),
    )
