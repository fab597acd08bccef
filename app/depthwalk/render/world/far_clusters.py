"""Far neighbours share an intermediate image: a cluster is warped into one tile, as if it were one object.

What is a few pixels high is drawn in no time, but planned, kept and composited like anything else. From far away
neighbours hardly move against each other: their tile is kept as any other is, by the depth of the box that holds them
all (render/impostors/reprojection_error.py). So a frame costs what its clusters cost, until one is warped anew.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import ALL_PIECES
from depthwalk.cook.lod_geometry import IMAGE_BITS
from depthwalk.geometry.spatial_order import runs, within_runs
from depthwalk.geometry.support_function import box_footprint
from depthwalk.render.impostors.tile_scheduler import Shown
from depthwalk.render.impostors.warp_planes import Volumes
from depthwalk.render.view.bounds import Bounds, Cylinders, box_cylinders
from depthwalk.render.view.view import View
from depthwalk.render.world.spatial_cells import Cells, boxes
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.types import Rows

MEMBERS = 1 << 16 - IMAGE_BITS  # at most: a texel of the atlas holds the member in the bits that its image leaves
_STEEP = 0.1  # height above or below a cell by distance; from among them, one by one most are found to be hidden
_AWAY = 4.0  # half diagonals of a cell, from which on it is far off: parallax within a cluster is an eighth of its own


@dataclass(kw_only=True)
class FarClusters:
    """k runs of neighbours, within cells. order: see `Cells`; first: (k + 1,), where each begins in it; of_cell: the
    first cluster of each cell (c + 1,); able: (c,), whether all objects of a cell may share images; low, high: (k, 3),
    world, the box of each; version: (k,), how often it changed."""

    order: NDArray[np.int32]
    first: Rows
    of_cell: Rows
    able: NDArray[np.bool_]
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    version: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.version)

    def far(self, view: View, cells: Cells, numbers: Rows, pixels: float) -> NDArray[np.bool_]:
        """Which of the cells `numbers` (m,) are so far off that none of their objects is `pixels` across, and seen from
        so far above or below that few of them hide each other."""
        low, high = cells.low[numbers], cells.high[numbers]
        half, middle = (high - low) / 2, (high + low) / 2 - view.position
        apart = np.maximum(np.abs(middle) - half, 0)
        gap = np.linalg.norm(apart, axis=1)
        small = 2 * view.focal_pixels * cells.largest[numbers] < pixels * gap
        steep = apart[:, 1] > _STEEP * gap
        return np.asarray(self.able[numbers] & small & steep & (gap > _AWAY * np.linalg.norm(half, axis=1)))

    def visible(self, view: View, cells: Rows) -> Rows:
        """Numbers of the clusters of `cells` (m,) that may be seen, nearest first."""
        numbers = runs(self.of_cell, cells)
        return numbers[self.bounds(numbers).visible(view)[0]]

    def bounds(self, numbers: Rows) -> Bounds:
        """Spheres about the boxes of the clusters `numbers` (m,)."""
        low, high = self.low[numbers], self.high[numbers]
        return Bounds((low + high) / 2, np.linalg.norm(high - low, axis=1) / 2)

    def cylinders(self, numbers: Rows) -> Cylinders:
        """About the boxes of the clusters `numbers` (m,)."""
        return box_cylinders(self.low[numbers], self.high[numbers])

    def members(self, numbers: Rows) -> tuple[Rows, Rows]:
        """The objects (n,) of the clusters `numbers` (m,), one cluster after the other, and how many each has (m,)."""
        return self.order[runs(self.first, numbers)], self.first[numbers + 1] - self.first[numbers]

    def whole(self, numbers: Rows, there: Callable[[Rows], NDArray[np.bool_]]) -> NDArray[np.bool_]:
        """Whether all objects of the clusters `numbers` (m,) are `there`."""
        rows, count = self.members(numbers)
        present = there(rows)
        return np.logical_and.reduceat(present, np.cumsum(count) - count) if len(count) else present

    def shown(self, view: View, numbers: Rows, like: Objects, level: Rows, triangles: Rows) -> Shown:
        """The clusters `numbers` (m,) as objects that stand in the middle of their boxes, upright and of scale 1, whose
        rows follow those of all objects. like: one (m,) of each; level, triangles: (m,) of those."""
        bounds, half = self.bounds(numbers), (self.high[numbers] - self.low[numbers]) / 2
        count = len(numbers)
        upright = np.broadcast_to(np.array([0, 0, 0, 1], np.float32), (count, 4))
        dpci = np.full(count, Representation.DPCI, np.uint8)
        radius = np.hypot(half[:, 0], half[:, 2])
        return Shown(
            row=len(self.order) + numbers,
            objects=Objects(
                asset=like.asset,
                position=bounds.centre,
                rotation=upright,
                scale=np.ones(count, np.float32),
                representation=dpci,
            ),
            bounds=bounds,
            volumes=Volumes(
                radius=radius,
                bottom=-half[:, 1],
                top=half[:, 1],
                footprint=box_footprint(half[:, 0], half[:, 2]),
                has_side=np.ones(count, bool),
            ),
            viewer=view.position - bounds.centre,
            level=level,
            pieces=np.full(count, ALL_PIECES),
            triangles=triangles * (self.first[numbers + 1] - self.first[numbers]),
        )

    def refit(self, bounds: Bounds, cells: Rows) -> None:
        """Fits the boxes of the clusters of `cells` (m,) to objects that moved."""
        numbers = runs(self.of_cell, cells)
        rows, count = self.members(numbers)
        self.low[numbers], self.high[numbers], _ = boxes(bounds.take(rows), np.cumsum(count) - count)
        self.version[numbers] += 1


def make_far_clusters(cells: Cells, bounds: Bounds, shareable: NDArray[np.bool_]) -> FarClusters:
    """Of all objects. shareable: (n,), those drawn by depth images that are seen from all around."""
    count = -(-np.diff(cells.first) // MEMBERS)  # of clusters per cell
    of_cell = np.concatenate([[0], np.cumsum(count)])
    first = np.append(np.repeat(cells.first[:-1], count) + MEMBERS * within_runs(count), len(cells.order))
    low, high, _ = boxes(bounds.take(cells.order), first[:-1])
    able = np.logical_and.reduceat(shareable[cells.order], cells.first[:-1]) if len(count) else np.zeros(0, bool)
    return FarClusters(
        order=cells.order,
        first=first,
        of_cell=of_cell,
        able=able,
        low=low,
        high=high,
        version=np.zeros(len(low), np.int64),
    )
