"""Point and spot lights as the shaders take them: records, and a list of those that reach each square of the picture.

A pixel then goes through its own list and reads the G-buffer once, where drawing each lamp's rectangle would read it,
and blend, once per lamp (Olsson and Assarsson 2011, "Tiled Shading").
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from depthwalk.colour import linear_from_srgb
from depthwalk.render.bounds import Bounds
from depthwalk.render.shading import extents
from depthwalk.render.view import View

if TYPE_CHECKING:
    from depthwalk.scene.environment import LampParams

Array = NDArray[np.floating]

SQUARE = 32  # pixels
FADE = 0.8  # part of a cone's angle within which it is as bright as it gets, in cosines' terms a soft edge
# Where it is, relative to the viewer, and its range; its light at 1 m, linear, and the cosine at which its cone ends;
# where it shines, and 1 over how much more the cosine is where the cone is brightest.
LAMP_RECORD = np.dtype([("place", "4f4"), ("light", "4f4"), ("cone", "4f4")])
NUMBERS_RECORD = np.dtype([("numbers", "4f4")])


@dataclass(frozen=True)
class Lamps:
    """records: (n,) LAMP_RECORD of those in sight; squares: (k,) NUMBERS_RECORD, row by row from the lower left: the
    first in the list, and how many; lists: their numbers, four to a NUMBERS_RECORD; across: squares in a row."""

    records: NDArray[np.void]
    squares: NDArray[np.void]
    lists: NDArray[np.void]
    across: int


def lamps_in_sight(view: View, lights: Sequence["LampParams"]) -> Lamps:
    position = np.array([light.position for light in lights], float).reshape(-1, 3)
    bounds = Bounds(position, np.array([light.range for light in lights], float))
    low, high = extents(view, bounds)
    beyond = (position - view.position) @ view.axes[2] + bounds.reach > 0
    seen = np.flatnonzero(beyond & (low < high).all(1))
    records = lamp_records(view, [lights[k] for k in seen.tolist()])
    numbers, counts = squares_reached(view.size, low[seen], high[seen])
    squares = np.zeros(counts.size, NUMBERS_RECORD)
    squares["numbers"][:, 0] = np.cumsum(counts) - counts.ravel()
    squares["numbers"][:, 1] = counts.ravel()
    lists = np.zeros(-(-len(numbers) // 4), NUMBERS_RECORD)
    lists["numbers"].reshape(-1)[: len(numbers)] = numbers
    return Lamps(records, squares, lists, counts.shape[1])


def lamp_records(view: View, lights: Sequence["LampParams"]) -> NDArray[np.void]:
    records = np.zeros(len(lights), LAMP_RECORD)
    if not lights:
        return records
    colour = linear_from_srgb([light.colour for light in lights])
    axis = np.array([light.direction or (0, -1, 0) for light in lights], float)
    half = np.radians([light.angle / 2 for light in lights])
    spot = np.array([light.direction is not None for light in lights])
    edge, full = np.cos(half), np.cos(FADE * half)
    records["place"][:, :3] = np.array([light.position for light in lights], float) - view.position
    records["place"][:, 3] = [light.range for light in lights]
    records["light"][:, :3] = colour * np.array([light.intensity for light in lights])[:, None]
    records["light"][:, 3] = np.where(spot, edge, -3)  # all directions are a cone's middle
    records["cone"][:, :3] = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    records["cone"][:, 3] = np.where(spot, 1 / (full - edge), 1)
    return records


def squares_reached(size: tuple[int, int], low: Array, high: Array) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Numbers (m,) of the rectangles with corners low, high (n, 2), −1 to 1, in the squares of a picture of `size`, row
    by row; and how many there are in each, (rows, columns)."""
    reached = []
    for axis, pixels in enumerate(size):
        start = np.arange(-(-pixels // SQUARE)) * SQUARE / pixels * 2 - 1
        end = start + 2 * SQUARE / pixels
        reached.append((low[:, axis] < end[:, None]) & (high[:, axis] > start[:, None]))
    both = reached[1][:, None] & reached[0][None]
    return np.nonzero(both)[2], both.sum(2)
