"""Draw a picture cell by cell, so that each cell can use its own program, or none.

A branch in a shader would not serve: a software rasteriser computes both of its sides for every pixel.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.program import Program
from depthwalk.types import Mask

CELL_COLUMNS, CELL_ROWS = 16, 12
VERTEX_SHADER = "reprojection/cells.vert"  # of the programs that draw cells


def places(spread: int) -> NDArray[np.float64]:
    """Return evenly spaced places in each cell of a picture, edges included.

    Parameters
    ----------
    spread
        How many parts a cell's edge is divided into.

    Returns
    -------
    NDArray[np.float64]
        (CELL_ROWS · CELL_COLUMNS, (spread + 1)², 2), −1 to 1 over the picture, cell by cell, lowest row first.
    """
    row, column = np.indices((CELL_ROWS, CELL_COLUMNS)).reshape(2, -1, 1)
    up, right = np.indices((spread + 1, spread + 1)).reshape(2, 1, -1) / spread
    return np.stack([(column + right) / CELL_COLUMNS, (row + up) / CELL_ROWS], -1) * 2 - 1


def fill_cells(program: Program, cells: Mask) -> None:
    """Draw the cells (CELL_ROWS · CELL_COLUMNS,) that are set, by a program with this module's vertex shader."""
    bits = cells.reshape(CELL_ROWS, CELL_COLUMNS) << np.arange(CELL_COLUMNS)
    program.set(cells=bits.sum(1).tolist())
    program.rectangles(cells.size)
