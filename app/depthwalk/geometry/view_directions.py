"""Spread viewing directions over a sphere, as for octahedral impostors, or around an object, as for billboards.

The octahedral map (Engelhardt and Dachsbacher 2008, "Octahedron environment maps") unfolds a sphere to a square: unit
vectors are divided by the sum of their absolute components, and the lower half is folded outward. For the upper half
alone, the diamond that it fills is rotated to fill the square (Brucks 2018, "Octahedral impostors").
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array

POLE = 1e-6
"""Squared horizontal length below which a direction counts as vertical."""


def square_from_direction(direction: Array, hemisphere: bool) -> NDArray[np.float64]:
    """Return the positions of directions in the square of the octahedral map.

    Parameters
    ----------
    direction
        (n, 3) vectors of any length above 0, y upward.
    hemisphere
        Whether the square shows only the upper half; directions below it are raised to the horizon.

    Returns
    -------
    numpy.ndarray
        (n, 2), −1 to 1.
    """
    upward = np.maximum(direction[:, 1], 0) if hemisphere else direction[:, 1]
    across = direction[:, ::2]
    total = np.maximum(np.abs(across).sum(1) + np.abs(upward), 1e-20)
    p = across / total[:, None]
    if hemisphere:
        return np.stack([p[:, 0] + p[:, 1], p[:, 0] - p[:, 1]], -1)
    folded = (1 - np.abs(p[:, ::-1])) * np.where(p < 0, -1.0, 1.0)
    return np.asarray(np.where(upward[:, None] < 0, folded, p))


def direction_from_square(square: Array, hemisphere: bool) -> NDArray[np.float64]:
    """Return the unit vectors (n, 3), y upward, of points (n, 2) of the square, −1 to 1: the inverse map."""
    if hemisphere:
        p = np.stack([square[:, 0] + square[:, 1], square[:, 0] - square[:, 1]], -1) / 2
        upward = 1 - np.abs(p).sum(1)
    else:
        upward = 1 - np.abs(square).sum(1)
        folded = (1 - np.abs(square[:, ::-1])) * np.where(square < 0, -1.0, 1.0)
        p = np.where(upward[:, None] < 0, folded, square)
    direction = np.stack([p[:, 0], upward, p[:, 1]], -1)
    return np.asarray(direction / np.linalg.norm(direction, axis=1, keepdims=True))


def octahedral_directions(side: int, hemisphere: bool) -> NDArray[np.float64]:
    """Return `side`² unit vectors (side², 3): those of a grid over the square, from edge to edge, row by row."""
    at = np.linspace(-1, 1, side)
    grid = np.stack(np.broadcast_arrays(at[None], at[:, None]), -1).reshape(-1, 2)
    return direction_from_square(grid, hemisphere)


def azimuth_directions(count: int) -> NDArray[np.float64]:
    """Return `count` horizontal unit vectors (count, 3), evenly around y; the first is +z, the next turned toward x."""
    angle = 2 * np.pi * np.arange(count) / count
    return np.stack([np.sin(angle), np.zeros(count), np.cos(angle)], -1)


def view_axes(direction: Array) -> NDArray[np.float64]:
    """Return the vectors to the right, up and toward the viewer in pictures from given directions.

    Parameters
    ----------
    direction
        (n, 3) unit vectors from the object to the viewer, y upward.

    Returns
    -------
    numpy.ndarray
        (n, 3, 3) orthonormal rows. Right is horizontal; for a viewer straight above or below it is +x.
    """
    x, _, z = direction.T
    squared = x * x + z * z
    level = squared < POLE
    inverse = 1 / np.sqrt(np.where(level, 1, squared))
    right = np.stack([np.where(level, 1, z * inverse), np.zeros_like(x), np.where(level, 0, -x * inverse)], -1)
    return np.stack([right, np.cross(direction, right), direction], 1)
