"""Drop what no pixel shows from a virtual texture: its finest texels, if an object is far away.

A texture's finest mip tier has most of its texels. If the pixels of an object cover several texels, only mip-maps and
coarser tiers are sampled, so the rest need not be on the GPU. The cooked file stays complete; dropped texels can be
loaded again at any time.
"""

from dataclasses import dataclass, replace
from enum import IntEnum
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.mask_packing import pack_masks
from depthwalk.cook.used_texels import SUB_TILE, TILE
from depthwalk.cook.virtual_texture import VirtualTexture
from depthwalk.types import Ints, Mask

_Texels = NDArray[Any]  # a picture of 8-bit numbers, with or without sign

_FLAGS = 3  # of an entry of the table: which sub-tiles of a row are stored
# Texels of a texture from which dropping some is worth the time to bring them back. A bust of 512² has 830,000; the
# garden's statue of 320², 570,000, and if it is included, frames of a walk take 20 ms longer on average.
WORTH = 3 << 18
# Texels that a pixel covers, where an object is nearest and its texels are largest, from which `HALF` and `QUARTER` are
# enough: for a bust they cost nothing, for a head of many colours 0.1 dB.
_ENOUGH = np.array([1.2, 2.5])
# Textures of more texels than _LARGE, as of 2048², are halved sooner. That costs 0.5 dB, which leaves such a bust 2 dB
# closer to its mesh than images of 512² are, and saves 34 MB.
_LARGE = 1 << 23
_SOON = np.array([0.6, 2.5])


class Detail(IntEnum):
    """Name which texels of a virtual texture are stored.

    FULL: all. HALF: every second one of the finest mip tier, as in its first mip-map, and all coarser tiers. QUARTER:
    only the coarser tiers, the first of which has every fourth.
    """

    FULL = 0
    HALF = 1
    QUARTER = 2


def detail_for(covered: float, texels: int) -> Detail:
    """Return the detail that is sufficient.

    Parameters
    ----------
    covered
        Least number of texels of the object's depth images that a pixel covers along one axis.
    texels
        Number of texels of the whole texture.

    Returns
    -------
    Detail
        The lowest detail with which pictures are as good.
    """
    return Detail(int(np.searchsorted(_ENOUGH if texels < _LARGE else _SOON, covered, "right")))


def can_leave_out(texture: VirtualTexture) -> bool:
    """Return whether a texture has enough texels that dropping some pays off, and tiers to show instead."""
    return texture.last_mip_tier > 0 and texture.normals[..., 0].size >= WORTH


def at_detail(texture: VirtualTexture, detail: Detail) -> VirtualTexture:
    """Return a texture reduced to the texels of a level of detail.

    Parameters
    ----------
    texture
        The whole texture, for which `can_leave_out` is true.
    detail
        The texels to keep.

    Returns
    -------
    VirtualTexture
        The texture, whose table leads to the remaining texels. With `HALF`, texels of the finest tier are at half the
        position in the table. With `QUARTER` the table has no rows for that tier, and `first_rows[0]` is meaningless.
    """
    if detail is Detail.FULL:
        return texture
    begin = texture.first_rows[1]
    charts = _coarse_charts(texture)
    height, width, _ = texture.normals.shape
    # The finest tier is the largest of all masks, so it is placed in the corner.
    finest = [np.ones((-(-height // (2 * SUB_TILE)), -(-width // (2 * SUB_TILE))), bool)][detail is Detail.QUARTER :]
    places, size = pack_masks(finest + [chart.stored for chart in charts])
    places = places[len(finest) :]
    table = texture.table.copy()
    for chart, (row, column) in zip(charts, places, strict=True):
        table[chart.tiles] += SUB_TILE * np.array([column - chart.source[1], row - chart.source[0]], np.int16)

    def picture(texels: _Texels, cell: int) -> _Texels:
        cells = np.zeros((*size, cell, cell, texels.shape[2]), texels.dtype)
        of_all = _cells(texels, cell)
        for chart, (row, column) in zip(charts, places, strict=True):
            rows, columns = chart.stored.shape
            (first, left), stored = chart.source, chart.stored
            cells[row : row + rows, column : column + columns][stored] = of_all[
                first : first + rows, left : left + columns
            ][stored]
        packed = cells.swapaxes(1, 2).reshape(size[0] * cell, size[1] * cell, -1)
        if finest:
            half = _halved(texels)
            packed[: half.shape[0], : half.shape[1]] = half
        return np.asarray(packed)

    quarter = detail is Detail.QUARTER
    width_left = (TILE * table.shape[2] + SUB_TILE // 2 - 1) // SUB_TILE + 1  # as in `_quarter` of virtual_texture
    return replace(
        texture,
        normals=picture(texture.normals, SUB_TILE),
        colours=picture(texture.colours, SUB_TILE) if texture.colours.size else texture.colours,
        tints=picture(texture.tints, SUB_TILE // 2) if texture.tints.size else texture.tints,
        table=table[:, begin:, : -(-width_left // TILE)].copy() if quarter else table,
        first_rows=[max(row - begin, 0) for row in texture.first_rows] if quarter else texture.first_rows,
        coordinates=texture.coordinates[:0, :0],  # a pixel covers several texels, whose colours are fine enough
        texture=texture.texture[:0, :0],
        colour_level=0,
    )


@dataclass(frozen=True, kw_only=True)
class _CoarseChart:
    """Hold sub-tiles of one coarser mip tier that are contiguous in the pictures.

    tiles: indices of `VirtualTexture.table` of its tiles; source: row and column in the pictures where its cells begin,
    cells; stored: (h, w), which cells it has from there on, each as large as a sub-tile.
    """

    tiles: tuple[Ints, Ints, Ints]
    source: tuple[int, int]
    stored: Mask


def _coarse_charts(texture: VirtualTexture) -> list[_CoarseChart]:
    """Return the positions of the texels of all mip tiers except the finest."""
    first_rows = np.array(texture.first_rows[: texture.last_mip_tier + 1])
    entries = texture.table.astype(np.int64)
    stored: Mask = np.any(entries & _FLAGS, axis=-1)
    stored[:, : first_rows[1]] = False
    image, row, column = stored.nonzero()
    tier = np.searchsorted(first_rows, row, "right") - 1
    shift = entries[image, row, column] // SUB_TILE
    chart = np.unique(np.column_stack([image, tier, shift]), axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(chart, kind="stable")
    found = []
    for tiles in np.split(order, np.flatnonzero(np.diff(chart[order])) + 1):
        rows, columns = row[tiles] - first_rows[tier[tiles]], column[tiles]
        low, left = int(rows.min()), int(columns.min())
        sub_tiles = np.zeros((2 * (int(rows.max()) - low) + 2, 2 * (int(columns.max()) - left) + 2), bool)
        for above, beside in product((0, 1), repeat=2):
            has = entries[image[tiles], row[tiles], column[tiles], above] >> beside & 1
            sub_tiles[2 * (rows - low) + above, 2 * (columns - left) + beside] = has
        across, up = shift[tiles[0]].tolist()
        cells = _surrounded(sub_tiles)
        rows_used, columns_used = np.flatnonzero(cells.any(1)), np.flatnonzero(cells.any(0))
        first, begin = int(rows_used[0]), int(columns_used[0])
        found.append(
            _CoarseChart(
                tiles=(image[tiles], row[tiles], column[tiles]),
                source=(2 * low + up + first, 2 * left + across + begin),
                stored=cells[first : rows_used[-1] + 1, begin : columns_used[-1] + 1],
            )
        )
    return found


def _surrounded(sub_tiles: Mask) -> Mask:
    """Return the cells (h + 1, w + 1), half a sub-tile earlier, that hold sub-tiles (h, w) and their borders."""
    padded = np.pad(sub_tiles, 1)
    return np.asarray(padded[1:, 1:] | padded[:-1, 1:] | padded[1:, :-1] | padded[:-1, :-1])


def _cells(texels: _Texels, size: int) -> _Texels:
    """Return the picture `texels`, (H, W, k), by cells of `size` texels: (H / size, W / size, size, size, k)."""
    height, width, components = texels.shape
    return texels.reshape(height // size, size, width // size, size, components).swapaxes(1, 2)


def _halved(texels: _Texels) -> _Texels:
    """Return the means of 2 × 2 texels each of a picture (H, W, k); H and W are even."""
    height, width, components = texels.shape
    # Adding integers is much faster than taking means along two short axes.
    pairs = texels[::2].astype(np.int16) + texels[1::2]
    sums = pairs[:, ::2] + pairs[:, 1::2]
    return np.asarray((sums + 2 >> 2).astype(texels.dtype).reshape(height // 2, width // 2, components))
