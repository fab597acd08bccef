"""Which texels of its depth images an object looks up, in blocks of 8 × 8."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, Face, image_position
from depthwalk.render.grids import FACE_SHIFT, PAST_AXIS, Grids

BLOCK = 8  # texels
_SLACK = 0.25  # texels beside a triangle: surface points of pixels may lie beside it; 3 changed no picture of an ogre


def covered_blocks(baked: BakedObject, grids: Grids, levels: list[int]) -> list[NDArray[np.bool_]]:
    """For each of `levels`, blocks (images, rows, columns) that triangles of so many of the finest grids touch: all in
    the box around each. levels: ascending."""
    rows, columns = (-(-size // BLOCK) for size in baked.images[0].depth.shape)
    counts = np.zeros((len(baked.images), rows + 1, 3 * columns + 1), np.int32)
    covered, done = [], 0
    for ends in [int((grids.first + grids.count)[:count].max()) for count in levels]:
        image, texel, wraps = _looked_up(baked, grids, grids.triangles(done, ends - done))
        low, high = (np.floor((texel + reach) / BLOCK).astype(np.int16) for reach in (-_SLACK, _SLACK))
        _count(counts, image, low, high, wraps)
        sums = counts.cumsum(1).cumsum(2)[:, :-1, :-1] > 0
        covered.append(np.any(sums.reshape(len(sums), rows, 3, columns), axis=2))
        done = ends
    return covered


def _count(
    counts: NDArray[np.int32],
    image: NDArray[np.int64],
    low: NDArray[np.int16],
    high: NDArray[np.int16],
    wraps: NDArray[np.bool_],
) -> None:
    """Adds to `counts` (images, rows + 1, 3 · columns + 1), whose sums along both axes then are how many boxes hold a
    block. Its columns begin a turn before the image. low, high: (t, 3, 2) blocks around each corner of triangles."""
    columns = counts.shape[2] // 3
    # Across the seam some corners are at one end of the image, some at the other: those go a turn further.
    turned = wraps[:, None] & (high[..., 0].max(1, keepdims=True) - low[..., 0] > columns // 2)
    further = turned[..., None] * np.array([columns, 0], np.int16)
    left, below = (low + further).min(1).T
    right, above = (high + further).max(1).T + 1
    left, right = (end.clip(-columns, 2 * columns) + columns for end in (left, right))
    below, above = (end.clip(0, counts.shape[1] - 1) for end in (below, above))
    for row, column, step in ((below, left, 1), (below, right, -1), (above, left, -1), (above, right, 1)):
        np.add.at(counts, (image, row, column), step)


def _looked_up(
    baked: BakedObject, grids: Grids, corners: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.floating], NDArray[np.bool_]]:
    """Where triangles (t, 3) find their colours: number of the image (t,), texel at each corner (t, 3, 2), and whether
    the image wraps (t,)."""
    height, width = baked.images[0].depth.shape
    flags = grids.vertices[corners[:, 2], 3].astype(np.int64)  # of the provoking corner
    face, layer = flags >> FACE_SHIFT & 7, flags & 7
    point = grids.box_low + grids.vertices[corners, :3] * (grids.box_size / 65535)
    point[flags & PAST_AXIS > 0] *= (-1, 1, -1)  # half a turn
    texel = np.empty((len(point), 3, 2))
    for one in Face:
        u, v = image_position(baked.cylinder, one, point[face == one].reshape(-1, 3))
        texel[face == one] = (np.stack([u, v], -1) * (width, height)).reshape(-1, 3, 2)
    return np.searchsorted([image.face for image in baked.images], face) + layer, texel, face == Face.SIDE
