"""Divide a finished picture into cells, of each of which the nearest surface is known, and tell what a step uncovers.

A viewer who steps aside sees near surfaces move more than far ones. Where two neighbouring cells move apart, something
comes into sight between them that the picture lacks.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.view.view import View
from depthwalk.types import Array

CELL = 16  # pixels along the side of a cell
STRIDE = 2  # pixels between those of a cell that are sampled for the nearest surface; narrower things may be missed
MOVING_STRIDE = 4  # the same for surfaces that move by themselves


def openings(nearest: Array, picture: View, edge: float) -> NDArray[np.float64]:
    """Return how much a step of the viewer uncovers beside each pair of neighbouring cells at an edge in depth.

    Parameters
    ----------
    nearest : (rows, columns) metres to the nearest surface ahead in each cell, lowest row first.
    picture : the view of the picture.
    edge : how many times farther than its neighbour a cell is at an edge.

    Returns
    -------
    NDArray[np.float64]
        (n, 3) parts of the picture per metre to the right, up and ahead of the picture's camera; negative where the
        nearer surface covers more. To the first order, that is for steps that are short beside the distances.
    """
    inverse = 1 / np.asarray(nearest, np.float64)
    size, half_extent = np.array(picture.size) / CELL, picture.half_extent
    found = []
    for axis in (0, 1):  # to the right and up
        here, there = (np.delete(inverse, end, 1 - axis) for end in (-1, 0))
        border = np.indices(here.shape)[1 - axis] + 1  # between both, in cells
        is_edge = np.maximum(here, there) > edge * np.minimum(here, there)
        step = (there - here)[is_edge] / (2 * half_extent[axis] * size[1 - axis])
        opening = np.zeros((len(step), 3))
        opening[:, axis] = -step
        opening[:, 2] = step * (2 * border[is_edge] / size[axis] - 1) * half_extent[axis]
        found.append(opening)
    return np.concatenate(found)
