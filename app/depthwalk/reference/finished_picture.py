"""Measure a finished picture, to show it to another camera: the twin of shaders/reprojection.

What is found by pixels and cells of the picture is used by `reference.reprojection`.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.reprojection.moving_surfaces import BASE, GROWN
from depthwalk.render.reprojection.nearest_cells import CELL, MOVING_STRIDE, STRIDE
from depthwalk.render.reprojection.reprojection import BEYOND, HIDDEN
from depthwalk.render.reprojection.smooth_tiles import MOVES, ROUGHNESS_CELL
from depthwalk.render.view.view import View
from depthwalk.render.world.moving_objects import MovingObjects
from depthwalk.types import Array, Mask


def nearest_in_cells(distances: Array) -> NDArray[np.float64]:
    """Return the least distance in each cell of a picture, as shaders/reprojection/nearest.frag finds it.

    Parameters
    ----------
    distances
        (h, w) metres, lower row first.

    Returns
    -------
    NDArray[np.float64]
        (⌈h / CELL⌉, ⌈w / CELL⌉) metres.
    """
    steps = np.append(np.arange(STRIDE // 2, CELL, STRIDE), 0)
    return np.asarray(_cells(distances, CELL, steps).min((2, 3)))


def _cells(distances: Array, edge: int, steps: NDArray[np.integer]) -> NDArray[np.float64]:
    """Return those pixels of each cell of a picture that are `steps` (k,) from its first: (rows, columns, k, k).

    edge: of a cell, pixels. Beyond the picture, its last pixels are repeated.
    """
    rows, columns = (
        (np.arange(-(-side // edge))[:, None] * edge + steps).clip(0, side - 1) for side in distances.shape
    )
    return np.asarray(distances[rows[:, None, :, None], columns[None, :, None, :]], np.float64)


def velocities_in(picture: View, distances: Array, moving: MovingObjects) -> NDArray[np.float64]:
    """Return how fast each pixel's surface moves by itself, as shaders/reprojection/velocity.frag finds it.

    Parameters
    ----------
    picture
        The view of the picture.
    distances
        (h, w) metres along the picture's view axis, lower row first.
    moving
        The objects that move.

    Returns
    -------
    NDArray[np.float64]
        (h, w, 4) metres per second to the right, up and ahead of the camera; last 1 where something moves, else 0.
    """
    row, column = np.indices(distances.shape)
    screen = (np.dstack([column, row]) + 0.5) / distances.shape[::-1] * 2 - 1
    ray = np.dstack([screen * np.array(picture.half_extent), np.ones(distances.shape)]) @ picture.axes
    point = picture.position + ray * distances[..., None]
    found, shape = np.zeros((*distances.shape, 4)), moving.cylinders
    for k in range(len(moving.velocity)):
        offset = point - shape.centre[k]
        along = offset @ shape.axis[k]
        off = np.linalg.norm(offset - along[..., None] * shape.axis[k], axis=-1)
        height = shape.half_height[k]
        within = (off <= GROWN * shape.radius[k]) & (along <= GROWN * height) & (along >= (2 * BASE - 1) * height)
        arm = point[within] - moving.pivot[k]
        moves = moving.velocity[k] + np.cross(moving.turn[k], arm) + moving.growth[k] * arm
        found[within] = np.column_stack([moves @ picture.axes.T, np.ones(len(arm))])
    return found


def nearest_moving(distances: Array, velocities: Array) -> NDArray[np.float64]:
    """Return the nearest surface that moves by itself in each cell of a picture (moving_nearest.frag).

    Parameters
    ----------
    distances
        (h, w) metres, lower row first.
    velocities
        (h, w, 4), see `velocities_in`.

    Returns
    -------
    NDArray[np.float64]
        (⌈h / CELL⌉, ⌈w / CELL⌉, 4) velocity, m/s, and distance, metres; `BEYOND` where nothing moves.
    """
    steps = np.arange(MOVING_STRIDE // 2, CELL, MOVING_STRIDE)
    ahead = _cells(np.where(velocities[..., 3] > 0, distances, BEYOND), CELL, steps)
    first = ahead.reshape(*ahead.shape[:2], -1).argmin(-1)[..., None]
    columns = [_cells(velocities[..., k], CELL, steps) for k in range(3)]
    found = [np.take_along_axis(c.reshape(*c.shape[:2], -1), first, -1)[..., 0] for c in (*columns, ahead)]
    found[:3] = [np.where(found[3] < BEYOND, column, 0) for column in found[:3]]
    return np.stack(found, -1)


def roughness(distances: Array, velocities: Array | None = None) -> NDArray[np.float64]:
    """Return how far from planar the cells of a picture are, as shaders/reprojection/roughness.frag measures it.

    Parameters
    ----------
    distances
        (h, w) metres, lower row first.
    velocities
        (h, w, 4), see `velocities_in`; None: nothing moves by itself.

    Returns
    -------
    NDArray[np.float64]
        (⌈h / ROUGHNESS_CELL⌉, ⌈w / ROUGHNESS_CELL⌉), 1/m: largest difference of an inverse distance from the plane
        through those at the corners; `MOVES` where anything moves by itself in the cell of `CELL` pixels around it.
    """
    inverse = 1 / _cells(distances, ROUGHNESS_CELL, np.arange(ROUGHNESS_CELL + 1))
    first, right, up, both = (inverse[..., y, x, None, None] for y in (0, -1) for x in (0, -1))
    slope_x, slope_y = ((right + both - first - up) / 2, (up + both - first - right) / 2)
    part = np.arange(ROUGHNESS_CELL + 1) / ROUGHNESS_CELL - 0.5
    plane = (first + right + up + both) / 4 + slope_x * part + slope_y * part[:, None]
    found = np.asarray(np.abs(inverse - plane).max((2, 3)))
    if velocities is not None:
        row, column = (np.arange(count) * ROUGHNESS_CELL // CELL for count in found.shape)
        found[nearest_moving(distances, velocities)[row[:, None], column, 3] < BEYOND] = MOVES
    return found


def beside_nearer(distances: Array) -> Mask:
    """Return the pixels of a picture that are beside a nearer surface, as shaders/reprojection/distance.frag does.

    Parameters
    ----------
    distances
        (h, w) metres.

    Returns
    -------
    Mask
        (h, w).
    """
    padded = np.pad(distances, 1, mode="edge")
    beside = np.min([padded[1:-1, 2:], padded[1:-1, :-2], padded[2:, 1:-1], padded[:-2, 1:-1]], axis=0)
    return np.asarray(beside < HIDDEN * distances)
