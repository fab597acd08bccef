"""Sort an image's triangles so that each may overwrite what was drawn before it.

This is the occlusion-compatible order of McMillan 1997 and Liu et al. 2007, §2.2, which needs no depth buffer.

Along a ray that leaves the viewer C, θ − θ_C and y − C.y each keep their sign and grow in size, and so do x − C.x and
z − C.z. So of two cells of a depth image that one ray meets, the farther one is not nearer to the epipole, the texel of
C, in columns or in rows. Drawing far rows first, and within a row far columns first, is therefore exact for any depths.
It needs cells, so whole grids are drawn, without larger triangles where the surface is smooth. Triangles of one cell
share edges and all face the viewer, so they do not overlap.

This holds for one surface per cell. Triangles without a cell of their own are drawn with a depth test, as caps are in
the paper: deeper layers, the other faces, the ends of surfaces, and samples past the axis, whose θ is not that of their
texel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.grid import grid_nodes
from depthwalk.bake.images import BakedObject, DepthImage, Face
from depthwalk.cook.lod_geometry import BORDER, EASE_SHIFT, EDGE, FACE_SHIFT, LodGeometry


@dataclass(frozen=True)
class GridCells:
    """Hold the triangles of one level and given pieces of whole grids, with the grid cells that they fill.

    Attributes
    ----------
    ordered : (n, 3) rows of `LodGeometry.vertices`: the triangles that have a cell of their own.
    unordered : (m, 3) rows of `LodGeometry.vertices`: the other triangles.
    cell : (n, 2) column and row of each ordered triangle's cell, in nodes of the level's grid.
    nodes : (c,) texel columns and (r,) texel rows of the nodes of the grid, rising.
    wraps : whether the columns go round a circle, as those of the side image do.
    """

    ordered: NDArray[np.uint32]
    unordered: NDArray[np.uint32]
    cell: NDArray[np.int32]
    nodes: tuple[NDArray[np.int64], NDArray[np.int64]]
    wraps: bool


def ordered_image(baked: BakedObject) -> DepthImage:
    """Return the depth image of `baked` to draw in order: the nearest layer of the side, or of the only face."""
    return next((image for image in baked.images if image.face is Face.SIDE), baked.images[0])


def image_cells(grids: LodGeometry, baked: BakedObject, level: int, pieces: int) -> GridCells:
    """Return the triangles of one level and given pieces of whole grids, with their cells.

    Parameters
    ----------
    grids : the geometry, without merged triangles.
    baked : the depth images that the geometry was made of.
    level : the level of detail, 0 the finest.
    pieces : a bit mask of the pieces, see `cook.cases`.

    Returns
    -------
    The triangles and their cells.
    """
    triangles = grids.drawn(level, pieces).astype(np.uint32)
    image = ordered_image(baked)
    # The flag of samples past the axis stays in the number, so that these are not among the image's own.
    number = grids.vertices[triangles, 3] & (1 << EASE_SHIFT) - 1 - EDGE - BORDER
    sampled = grids.texels[triangles, 0] >= 0
    own = (sampled & (number == image.face << FACE_SHIFT)).all(1)
    height, width = image.depth.shape
    wraps = image.face is Face.SIDE
    texels = grids.texels[triangles[own]].astype(np.int32)
    if wraps:
        column = texels[..., 0]
        across_seam = np.ptp(column, axis=1) > width // 2
        column[across_seam] += np.where(column[across_seam] < width // 2, width, 0)
    columns = grid_nodes(width, 1 << level, wraps)
    nodes = np.append(columns, width) if wraps else columns, grid_nodes(height, 1 << level, wraps=False)
    corners = -(-texels // (1 << level))  # rounded up: the last node may be closer than a step
    return GridCells(triangles[own], triangles[~own], corners.min(1), nodes, wraps)


def epipole(baked: BakedObject, viewer: NDArray[np.floating], cells: GridCells) -> tuple[int, int]:
    """Find the interval of the ordered image's grid that contains the viewer.

    Column and row are −1 before the first node, and those of the last node beyond it.

    Parameters
    ----------
    baked : the depth images.
    viewer : (3,) the viewer in the object's frame, metres.
    cells : the cells of the grid.

    Returns
    -------
    Column and row of the interval, in nodes.
    """
    image = ordered_image(baked)
    grid = FaceGrid.of(baked.cylinder, image)
    u, v = (float(position[0]) for position in grid.position_of(viewer[None]))
    column = u * grid.width - 0.5
    at = column % grid.width if cells.wraps else column, v * grid.height - 0.5
    found = [int(np.searchsorted(nodes, value, side="right")) - 1 for nodes, value in zip(cells.nodes, at, strict=True)]
    return found[0], found[1]


def draw_order(cells: GridCells, at: tuple[int, int]) -> NDArray[np.intp]:
    """Return the order in which the ordered triangles are drawn.

    Parameters
    ----------
    cells : the cells of the grid.
    at : column and row of the epipole, in nodes.

    Returns
    -------
    (n,) rows of `cells.ordered`, the first to be drawn first.
    """
    turn = len(cells.nodes[0]) - 1 if cells.wraps else None
    order = np.arange(len(cells.ordered))
    for axis in (0, 1):  # stable sorts, the first key last; NumPy sorts 16 bits by radix
        distance = _distance(cells.cell[:, axis], at[axis], turn if axis == 0 else None)
        order = order[np.argsort(-distance[order], kind="stable")]
    return order


def _distance(cell: NDArray[np.int32], at: int, turn: int | None) -> NDArray[np.int16]:
    """Return how many nodes lie between the epipole, in the interval after node `at`, and the intervals `cell` (n,).

    It is 0 for the interval that contains the epipole. On a circle of `turn` nodes, the opposite one is the farthest.
    """
    if turn is None:
        return np.abs(cell - at).astype(np.int16)
    ahead = (cell - at) % turn
    return np.minimum(ahead, turn - ahead).astype(np.int16)
