"""Far neighbours share an intermediate image: a cluster is warped into one tile, as if it were one object.

What is a few pixels high is drawn in no time, but planned, kept and composited like anything else. From far away
neighbours hardly move against each other: their tile is kept as any other is, by the depth of the box that holds them
all (render/ageing.py). So a frame costs what its clusters cost, until one is warped anew.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.bounds import Bounds
from depthwalk.render.cases import ALL_PIECES
from depthwalk.render.cells import Cells, boxes, runs, within_runs
from depthwalk.render.footprint import box_footprint
from depthwalk.render.grids import IMAGE_BITS
from depthwalk.render.occlusion import Cylinders, box_cylinders
from depthwalk.render.planes import Planes, Volumes
from depthwalk.render.records import warp_records
from depthwalk.render.reuse import Shown
from depthwalk.render.rotation import conjugate, rotate
from depthwalk.render.tiles import Tiles
from depthwalk.render.view import View
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.types import Array, Rows

MEMBERS = 1 << 16 - IMAGE_BITS  # at most: a texel of the atlas holds the member in the bits that its image leaves
_STEEP = 0.1  # height above or below a cell by distance; from among them, one by one most are found to be hidden
_AWAY = 4.0  # half diagonals of a cell, from which on it is far off: parallax within a cluster is an eighth of its own


@dataclass(kw_only=True)
class Clusters:
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
            objects=Objects(like.asset, bounds.centre, upright, np.ones(count, np.float32), dpci),
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


def make_clusters(cells: Cells, bounds: Bounds, shareable: NDArray[np.bool_]) -> Clusters:
    """Of all objects. shareable: (n,), those drawn by depth images that are seen from all around."""
    count = -(-np.diff(cells.first) // MEMBERS)  # of clusters per cell
    of_cell = np.concatenate([[0], np.cumsum(count)])
    first = np.append(np.repeat(cells.first[:-1], count) + MEMBERS * within_runs(count), len(cells.order))
    low, high, _ = boxes(bounds.take(cells.order), first[:-1])
    able = np.logical_and.reduceat(shareable[cells.order], cells.first[:-1]) if len(count) else np.zeros(0, bool)
    return Clusters(
        order=cells.order,
        first=first,
        of_cell=of_cell,
        able=able,
        low=low,
        high=high,
        version=np.zeros(len(low), np.int64),
    )


def member_records(
    planes: Planes,
    tiles: Tiles,
    corners: Rows,
    atlas_size: tuple[int, int],
    members: Objects,
    viewer: Array,
    number: Rows,
) -> NDArray[np.void]:
    """Warp records of n members, of whose clusters the planes, tiles and their `corners` (n, 2) are given. viewer:
    (n, 3) in their frames; number: (n,) within the cluster.

    A plane is the same in whatever frame: directions turn, lengths shrink by the object's scale, λ stays.
    """
    turned, scale = conjugate(members.rotation), members.scale[:, None]
    right, up, normal = (rotate(turned, axis) for axis in (planes.right, planes.up, planes.normal))
    epipole = np.stack([np.einsum("ni,ni->n", viewer, axis) for axis in (right, up)], -1)
    distance = planes.distance / members.scale
    offset = np.einsum("ni,ni->n", viewer, normal) - distance
    own = Planes(
        face=planes.face,
        right=right,
        up=up,
        normal=normal,
        distance=distance,
        epipole=epipole,
        offset=offset,
        low=planes.low / scale,
        high=planes.high / scale,
    )
    texel = tiles.texel * np.concatenate([scale, scale, np.ones_like(scale)], 1)[:, None]
    records = warp_records(
        own, Tiles(texel=texel, nearest=tiles.nearest, size=tiles.size, pixel=tiles.pixel), corners, atlas_size
    )
    records["depths"][:, 2] = number << IMAGE_BITS
    return records
