"""Fewer, larger triangles where a depth image is smooth.

Geometry and shading need not share a resolution: colour and normal are looked up per pixel, so a block of
8 × 8 cells may be drawn with cells of 2, 4 or 8 if no sample comes off the coarser surface by more than a tolerance.
Blocks of different steps meet without cracks: the edge between two takes the finer step, and the coarser block's
cells become fans around their middle node there.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import DepthImage, Face, cell_triangles, grid_nodes

BLOCK = 8  # cells
_STEPS = (8, 4, 2)
_UNIFORM = np.array([1 | k << 1 | k << 4 for k in range(8)])  # a triangle with all corners on layer k


@dataclass(frozen=True)
class Surface:
    """What is known of each texel of one layer, flattened: point (n, 3) and normal (n, 3), metres, object frame;
    label (n,): texels of one block must share it."""

    point: NDArray[np.float32]
    normal: NDArray[np.float32]
    label: NDArray[np.integer]


def coarse_blocks(
    image: DepthImage, surface: Surface, level: int, tolerance: float
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Triangles (t, 3) of texel numbers that replace whole blocks of the grid of step 2^level, and which of its cells
    (cells,), in the order of `grid_cells`, they replace. tolerance: metres."""
    height, width = image.depth.shape
    wraps = image.face is Face.SIDE
    columns, rows = grid_nodes(width, 1 << level, wraps), grid_nodes(height, 1 << level, wraps=False)
    across, down = len(columns) - (not wraps), len(rows) - 1
    wide, high = across // BLOCK, down // BLOCK
    replaced = np.zeros((down, across), bool)
    if not (wide and high):
        return np.zeros((0, 3), np.int64), replaced.ravel()
    uniform = _UNIFORM[image.layer]
    whole = (image.cells[level] == (uniform | uniform << 7)).reshape(down, across)
    whole = whole[: high * BLOCK, : wide * BLOCK].reshape(high, BLOCK, wide, BLOCK).all((1, 3))
    block_row, block_column = whole.nonzero()
    nodes = np.arange(BLOCK + 1)
    i = columns[(block_column[:, None] * BLOCK + nodes) % len(columns)]
    j = rows[block_row[:, None] * BLOCK + nodes]
    texels = j[:, :, None] * width + i[:, None, :]  # (blocks, 9 rows, 9 columns)
    step = np.ones((high, wide), np.int64)
    step[block_row, block_column] = _block_steps(surface, texels, tolerance)

    edges = _edge_steps(step, wraps and wide * BLOCK == across)[:, block_row, block_column]
    steps = np.concatenate([step[block_row, block_column][None], edges])
    coarse = steps[0] > 1
    cells = replaced[: high * BLOCK, : wide * BLOCK].reshape(high, BLOCK, wide, BLOCK)
    cells[block_row[coarse], :, block_column[coarse]] = True
    triangles = []
    kinds, which = np.unique(steps[:, coarse], axis=1, return_inverse=True)
    flat = texels.reshape(-1, (BLOCK + 1) ** 2)[coarse]
    for number, kind in enumerate(kinds.T.tolist()):
        pattern = _pattern(*kind, image.face is Face.BOTTOM)
        triangles.append(flat[which == number][:, pattern].reshape(-1, 3))
    return np.concatenate([np.zeros((0, 3), np.int64), *triangles]), replaced.ravel()


def _block_steps(surface: Surface, texels: NDArray[np.int64], tolerance: float) -> NDArray[np.int64]:
    """The largest step (b,) at which each block of texels (b, 9, 9) stays within `tolerance` of its samples."""
    point, normal, label = surface.point[texels], surface.normal[texels], surface.label[texels]
    same = (label == label[:, :1, :1]).all((1, 2))
    steps = np.ones(len(texels), np.int64)
    for step in reversed(_STEPS):
        off = point - _interpolated(point, step)
        deviation = np.abs(np.einsum("brci,brci->brc", off, normal)).max((1, 2), initial=0)
        steps[same & (deviation <= tolerance)] = step
    return steps


def _interpolated(point: NDArray[np.float32], step: int) -> NDArray[np.float32]:
    """The nodes (b, 9, 9, 3) of blocks where cells of `step`, each two triangles, put them."""
    node = np.arange(BLOCK + 1)
    low = np.minimum(node // step * step, BLOCK - step)
    part = ((node - low) / step).astype(np.float32)
    y, x = part[:, None, None], part[None, :, None]
    corner = [[point[:, low[:, None] + dy * step, low[None] + dx * step] for dx in (0, 1)] for dy in (0, 1)]
    lower = corner[0][0] + x * (corner[0][1] - corner[0][0]) + y * (corner[1][0] - corner[0][0])
    upper = corner[1][1] + (1 - x) * (corner[1][0] - corner[1][1]) + (1 - y) * (corner[0][1] - corner[1][1])
    return np.where(x + y <= 1, lower, upper)


def _edge_steps(step: NDArray[np.int64], wraps: bool) -> NDArray[np.int64]:
    """For each block (rows, columns) the steps of its left, right, lower and upper edge: (4, rows, columns)."""
    padded = np.ones((step.shape[0] + 2, step.shape[1] + 2), np.int64)
    padded[1:-1, 1:-1] = step
    if wraps:
        padded[1:-1, 0], padded[1:-1, -1] = step[:, -1], step[:, 0]
    beside = padded[1:-1, :-2], padded[1:-1, 2:], padded[:-2, 1:-1], padded[2:, 1:-1]
    return np.stack([np.minimum(step, other) for other in beside])


@cache
def _pattern(step: int, left: int, right: int, low: int, high: int, turned: bool) -> NDArray[np.int64]:
    """Triangles (t, 3) of a block's node numbers, row · 9 + column, for its own step and those of its edges."""
    face = Face.BOTTOM if turned else Face.TOP
    triangles = []
    for j in range(0, BLOCK, step):
        for i in range(0, BLOCK, step):
            sides = (  # the cell's border, round from the lower left corner: up, right, down, left
                [(i, y) for y in range(j, j + step, left if i == 0 else step)],
                [(x, j + step) for x in range(i, i + step, high if j + step == BLOCK else step)],
                [(i + step, y) for y in range(j + step, j, -(right if i + step == BLOCK else step))],
                [(x, j) for x in range(i + step, i, -(low if j == 0 else step))],
            )
            border = [corner for side in sides for corner in side]
            if len(border) == 4:
                columns, rows = cell_triangles(face, *(np.array([at]) for at in (i, j, i + step, j + step)))
                triangles += (rows[:, 0] * (BLOCK + 1) + columns[:, 0]).tolist()
                continue
            middle = (j + step // 2) * (BLOCK + 1) + i + step // 2
            numbers = [y * (BLOCK + 1) + x for x, y in border]
            fan = [[middle, a, b] for a, b in zip(numbers, numbers[1:] + numbers[:1], strict=True)]
            triangles += [triangle[::-1] for triangle in fan] if turned else fan
    return np.array(triangles, np.int64)
