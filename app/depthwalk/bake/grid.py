"""Number the cells and triangles of a depth image's grids of step 1, 2, 4 …; each cell has two triangles."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import DepthImage, Face

MAX_STEPS = 7  # grids of step 1, 2, … 64: 512² shrinks to 8²
_TURNED = Face.BOTTOM, Face.FRONT, Face.LEFT  # u × v points outward


def usable_steps(shape: tuple[int, int]) -> int:
    """Return how many grids an image of `shape` (H, W) gets: steps 1, 2, … 64, as long as eight cells remain."""
    return max(1, min(MAX_STEPS, int(np.log2(min(shape))) - 2))


def grid_nodes(count: int, step: int, wraps: bool) -> NDArray[np.int64]:
    """Return the texel indices, (n,) int64, of a grid's nodes along one axis of an image.

    They are every step-th texel, and the last one unless the axis wraps, so that a coarse grid still ends at the edge.

    Parameters
    ----------
    count
        Texels along the axis.
    step
        Texels between two nodes.
    wraps
        Whether the first texel follows the last, as on the side image.

    Returns
    -------
    numpy.ndarray
        (n,) int64, ascending texel numbers.
    """
    nodes = np.arange(0, count, step)
    return nodes if wraps or nodes[-1] == count - 1 else np.append(nodes, count - 1)


def grid_cells(shape: tuple[int, int], face: Face, step: int) -> tuple[NDArray[np.int64], ...]:
    """Return the corners of the cells of one grid.

    Parameters
    ----------
    shape
        Height H and width W of the image, texels.
    face
        The face that the image lies on; the side image wraps.
    step
        Texels between two nodes.

    Returns
    -------
    tuple
        Column and row of the lower (i0, j0) and of the upper corner (i1, j1), each (cells,) int64. In the side image,
        i1 is 0 in the last column of cells.
    """
    height, width = shape
    columns = grid_nodes(width, step, wraps=face is Face.SIDE)
    rows = grid_nodes(height, step, wraps=False)
    next_columns = np.append(columns[1:], 0) if face is Face.SIDE else columns[1:]
    i0, j0 = np.meshgrid(columns[: len(next_columns)], rows[:-1])
    i1, j1 = np.meshgrid(next_columns, rows[1:])
    return i0.ravel(), j0.ravel(), i1.ravel(), j1.ravel()


def cell_triangles(
    face: Face, i0: NDArray[np.int64], j0: NDArray[np.int64], i1: NDArray[np.int64], j1: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the corners of the two triangles of each cell.

    They are counter-clockwise seen from outside the cylinder, where v may run to the left or to the right of u.

    Parameters
    ----------
    face
        The face; it determines the winding.
    i0, j0, i1, j1
        (cells,) int64: columns i and rows j of the lower (0) and upper (1) corners, from `grid_cells`.

    Returns
    -------
    tuple
        Columns and rows, each (2, cells, 3) int64, of the lower and the upper triangles.
    """
    lower = (i1, j0), (i0, j0), (i0, j1)
    upper = (i1, j0), (i0, j1), (i1, j1)
    triangles = [lower, upper] if face not in _TURNED else [lower[::-1], upper[::-1]]
    columns = np.stack([np.stack([corner[0] for corner in triangle], -1) for triangle in triangles])
    rows = np.stack([np.stack([corner[1] for corner in triangle], -1) for triangle in triangles])
    return columns, rows


def whole_cells(image: DepthImage, level: int) -> NDArray[np.bool_]:
    """Return which cells, (cells,) bool, of the grid of step 2^`level` lie entirely on one layer's surface.

    Both triangles of such a cell lie on the surface, and all four corners are samples of `image`.
    """
    triangle = 1 | image.layer << 1 | image.layer << 4
    return np.asarray(image.cells[level] == (triangle | triangle << 7))


def layer_triangles(
    image: DepthImage, level: int, without: NDArray[np.bool_] | None = None
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the corners of the grid triangles that lie on the surface and have their first corner in `image`.

    Parameters
    ----------
    image
        The depth image, one layer of a face.
    level
        The grid has step 2^level.
    without
        (cells,) bool: cells to skip; None skips none.

    Returns
    -------
    tuple
        Layers and texel numbers, each (triangles, 3) int64.
    """
    return triangle_corners(image, level, *triangle_places(image, level, without))


def triangle_corners(
    image: DepthImage, level: int, half: NDArray[np.intp], cell: NDArray[np.intp]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the corners of given triangles of a grid, as `layer_triangles` does.

    Parameters
    ----------
    image, level
        As in `layer_triangles`.
    half
        (triangles,) 0 for the lower, 1 for the upper triangle of its cell.
    cell
        (triangles,) number of the cell.
    """
    code = image.cells[level][cell] >> 7 * half
    layers = np.stack([np.full(len(cell), image.layer), code >> 1 & 7, code >> 4 & 7])
    height, width = image.depth.shape
    columns = grid_nodes(width, 1 << level, wraps=image.face is Face.SIDE)
    rows = grid_nodes(height, 1 << level, wraps=False)
    row, column = np.divmod(cell, len(columns) - (image.face is not Face.SIDE))
    right, up = (axis[:, 0].T.take(half, 1) for axis in cell_triangles(image.face, *np.array([[0], [0], [1], [1]])))
    i = np.where(right, np.roll(columns, -1)[column], columns[column])
    j = np.where(up, rows[row + 1], rows[row])
    return layers.T, (j * width + i).T


def triangle_places(
    image: DepthImage, level: int, without: NDArray[np.bool_] | None = None
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the cells in which the triangles lie that `layer_triangles` returns for the same parameters.

    Returns
    -------
    tuple
        Half (0 for the lower, 1 for the upper triangle) and number of the cell, each (triangles,) int64.
    """
    codes = image.cells[level] if without is None else np.where(without, 0, image.cells[level])
    lower, upper = np.flatnonzero(codes & 1), np.flatnonzero(codes & 128)
    return np.repeat([0, 1], [len(lower), len(upper)]), np.concatenate([lower, upper])
