"""Occlusion-compatible order (McMillan 1997; Liu et al. 2007, §2.2): an image's triangles, sorted so that each may
overwrite what was drawn before it.

Along a ray that leaves the viewer C, θ − θ_C and y − C.y each keep their sign and grow in size, and so do x − C.x and
z − C.z. So of two cells of a depth image that one ray meets, the farther is not nearer to the epipole, the texel of C, in
columns nor in rows. Far rows first, within a row far columns first, is therefore exact, whatever the depths. The two
triangles of a cell share an edge: as both face the viewer, they do not overlap.

This holds for one surface per cell. What lacks a cell of its own is told apart by depth, as the paper does with caps:
deeper layers, the other faces, the ends of surfaces, samples past the axis, whose θ is not that of their texel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, DepthImage, Face
from depthwalk.render.grids import Grids

Runs = tuple[tuple[int, int], ...]  # first index and number of indices of each


@dataclass(frozen=True)
class Cells:
    """Triangles of some runs of `Grids.indices`.

    ordered: (n, 3) uint32, those with a cell of their own; first, last: (n, 2) int32, columns and rows of that cell's
    corners, the last column beyond the image's width where it wraps; unordered: (m, 3) uint32, the others.
    """

    ordered: NDArray[np.uint32]
    first: NDArray[np.int32]
    last: NDArray[np.int32]
    unordered: NDArray[np.uint32]


def ordered_image(baked: BakedObject) -> DepthImage:
    """The image that is drawn in order: the nearest layer of the side, or of the one face there is."""
    return next((image for image in baked.images if image.face is Face.SIDE), baked.images[0])


def image_cells(grids: Grids, baked: BakedObject, runs: Runs) -> Cells:
    """The triangles of `runs`, with the cells of those that can be ordered."""
    triangles = np.concatenate([grids.indices[first : first + count] for first, count in runs]).reshape(-1, 3)
    image = ordered_image(baked)
    number = next(k for k, other in enumerate(baked.images) if other is image)
    # Flags of border vertices and of samples past the axis are part of the number.
    own = (grids.vertices[triangles, 3] == number).all(1)
    texels = grids.texels[triangles[own]].astype(np.int32)
    if image.face is Face.SIDE:
        width = image.depth.shape[1]
        column = texels[..., 0]
        across_seam = np.ptp(column, axis=1) > width // 2
        column[across_seam] += np.where(column[across_seam] < width // 2, width, 0)
    return Cells(triangles[own], texels.min(1), texels.max(1), triangles[~own])


def epipole(baked: BakedObject, viewer: NDArray[np.floating]) -> tuple[float, float]:
    """Column and row, texel centres being whole numbers, of the viewer (3,), object frame, in the ordered image."""
    cylinder = baked.cylinder
    image = ordered_image(baked)
    height, width = image.depth.shape
    x, y, z = viewer.tolist()
    if image.face is Face.SIDE:
        u, v = np.arctan2(z, x) / (2 * np.pi), (y - cylinder.bottom) / cylinder.height
    else:
        u, v = x / (2 * cylinder.half_width) + 0.5, z / (2 * cylinder.half_depth) + 0.5
    return float(u * width - 0.5), float(v * height - 0.5)


def draw_order(cells: Cells, at: tuple[float, float], turn: int | None) -> NDArray[np.intp]:
    """The order (n,) in which to draw `cells.ordered`, for the epipole `at` (column, row).

    turn: columns of an image that wraps, else None.
    """
    column, row = at
    first, last = cells.first, cells.last
    rows = _distance(first[:, 1], last[:, 1], row)
    columns = _distance(first[:, 0], last[:, 0], column) if turn is None else _around(first, last, column, turn)
    order = np.argsort(-columns.astype(np.int16), kind="stable")  # 16 bits: NumPy sorts them by radix
    return order[np.argsort(-rows[order].astype(np.int16), kind="stable")]


def _distance(first: NDArray[np.int32], last: NDArray[np.int32], at: float) -> NDArray[np.int32]:
    """Of spans from the epipole; 0 where one holds it."""
    at = float(np.clip(at, -8192, 16384))  # beyond every image: the order is the same, and fits 16 bits
    return np.maximum(np.maximum(first - int(np.floor(at)), int(np.ceil(at)) - last), 0)


def _around(first: NDArray[np.int32], last: NDArray[np.int32], at: float, turn: int) -> NDArray[np.int32]:
    """The same round a circle of `turn` columns, where the span opposite the epipole is the farthest."""
    ahead, behind = (first[:, 0] - at) % turn, (at - last[:, 0]) % turn
    holds = ahead + last[:, 0] - first[:, 0] > turn
    opposite = (ahead < turn / 2) & (behind < turn / 2) & ~holds
    nearer = np.ceil(np.minimum(ahead, behind)).astype(np.int32)
    return np.where(holds, 0, np.where(opposite, turn, nearer))
