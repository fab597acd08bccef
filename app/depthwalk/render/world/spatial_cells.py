"""Objects sorted into cells of neighbours, so that a frame asks only those that may be seen: a bounding volume
hierarchy of one level."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.spatial_order import neighbours, runs
from depthwalk.render.view.bounds import Bounds, Cylinders, box_cylinders
from depthwalk.render.view.view import View
from depthwalk.types import Array, Rows

_OBJECTS = 256  # of a cell; 64 and 1024 took as long
_LEAF = 64  # objects, of runs within cells that are neighbours even more


@dataclass(kw_only=True)
class Cells:
    """c cells. order: (n,) int32, rows of the objects cell by cell; first: (c + 1,), where each cell begins in it;
    low, high: (c, 3) float32, world, the box around all spheres of a cell; largest: (c,) float32, the greatest reach
    of them, metres."""

    order: NDArray[np.int32]
    first: NDArray[np.int64]
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    largest: NDArray[np.float32]

    @cached_property
    def _cell_of_row(self) -> NDArray[np.int32]:
        """The cell (n,) of each object: only who moves objects asks."""
        cell = np.empty(len(self.order), np.int32)
        cell[self.order] = np.repeat(np.arange(len(self.low), dtype=np.int32), np.diff(self.first))
        return cell

    def portions(self, view: View, min_pixels: float, size: int) -> list[Rows]:
        """Numbers of the cells whose objects may be seen, the nearest first, in portions of some `size` objects, four
        times as many, and so on; at least one."""
        cells = np.flatnonzero(self._may_show(view, min_pixels))
        forward, bounding_radius = self.along(view, cells)
        cells = cells[np.argsort(forward - bounding_radius, kind="stable")]
        before = np.cumsum(np.diff(self.first)[cells]) - np.diff(self.first)[cells]
        portion = np.log2(3 * before / size + 1) // 2  # size · (1 + 4 + … + 4^(k − 1)) objects come before portion k
        return np.split(cells, np.flatnonzero(np.diff(portion)) + 1)

    def objects(self, cells: Rows) -> int:
        """How many objects `cells` (k,) have."""
        return int(np.diff(self.first)[cells].sum())

    def some_objects(self, cells: Rows, count: int) -> Rows:
        """Rows of some `count` of the objects of `cells` (k,), one here, one there; of all, where there are no more."""
        rows = runs(self.first, cells)
        return self.order[rows[:: max(1, len(rows) // count)]]

    def along(self, view: View, cells: Rows) -> tuple[Array, Array]:
        """Distances (k,) of the middles of `cells` (k,) along the view axis, and how far they reach along it."""
        middle, half = (self.high + self.low)[cells] / 2, (self.high - self.low)[cells] / 2
        return (middle - view.position) @ view.axes[2], half @ np.abs(view.axes[2])

    def cylinders(self, cells: Rows) -> Cylinders:
        """About the boxes of `cells` (k,)."""
        return box_cylinders(self.low[cells], self.high[cells])

    def visible(self, view: View, bounds: Bounds, min_pixels: float, cells: Rows) -> tuple[Rows, Array]:
        """Rows (m,) of the objects of `cells` (k,) that `Bounds.visible` finds and that are not smaller than
        `min_pixels`, nearest first; and the distances (m,) of their centres along the view axis."""
        rows = self.order[runs(self.first, cells)]
        near = bounds.take(rows)
        seen, forward = near.visible(view)
        if min_pixels:
            apart = near.centre.take(seen, 0) - view.position
            squared = np.einsum("ni,ni->n", apart, apart)  # a norm takes five times as long
            large = 2 * view.focal_pixels * near.bounding_radius[seen] >= min_pixels * np.sqrt(squared)
            seen, forward = seen[large], forward[large]
        return rows[seen], forward

    def _may_show(self, view: View, min_pixels: float) -> NDArray[np.bool_]:
        """Whether any object of each cell (c,) may be seen."""
        tan_x, tan_y = view.half_extent
        outward = [[1, 0, -tan_x], [-1, 0, -tan_x], [0, 1, -tan_y], [0, -1, -tan_y], [0, 0, -1]]
        planes = np.array(outward) @ view.axes  # normals (5, 3) of the frustum's sides, and of the viewer's back
        half, middle = (self.high - self.low) / 2, (self.high + self.low) / 2 - view.position
        inside = (middle @ planes.T < half @ np.abs(planes).T).all(1)
        gap = np.linalg.norm(np.maximum(np.abs(middle) - half, 0), axis=1)
        return np.asarray(inside & (2 * view.focal_pixels * self.largest >= min_pixels * gap))

    def refit(self, bounds: Bounds, rows: slice) -> Rows:
        """Fits the boxes to objects that moved; the cells that have any. They keep their cells: far from the
        others, they make them large."""
        cells = np.unique(self._cell_of_row[rows])
        of_cells = runs(self.first, cells)
        starts = np.cumsum(np.diff(self.first)[cells]) - np.diff(self.first)[cells]
        self.low[cells], self.high[cells], self.largest[cells] = boxes(bounds.take(self.order[of_cells]), starts)
        return cells


def sort_into_cells(bounds: Bounds) -> Cells:
    """Cells of `_OBJECTS` objects each, which are neighbours, and within them runs of `_LEAF`."""
    count = len(bounds.bounding_radius)
    order = neighbours(bounds.centre, _LEAF).astype(np.int32)
    first = np.append(np.arange(0, count, _OBJECTS), count)
    low, high, largest = boxes(bounds.take(order), first[:-1])
    return Cells(order=order, first=first, low=low, high=high, largest=largest)


def boxes(bounds: Bounds, starts: Rows) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """`Cells.low`, `high` and `largest` of runs of spheres that begin at `starts` (c,)."""
    if not len(starts):
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32), np.zeros(0, np.float32)
    bounding_radius = bounds.bounding_radius[:, None]
    low = np.minimum.reduceat(bounds.centre - bounding_radius, starts)
    high = np.maximum.reduceat(bounds.centre + bounding_radius, starts)
    # Rounding to float32 must not let a sphere out.
    return (
        np.nextafter(low.astype(np.float32), np.float32(-np.inf)),
        np.nextafter(high.astype(np.float32), np.float32(np.inf)),
        np.maximum.reduceat(bounds.bounding_radius, starts).astype(np.float32),
    )
