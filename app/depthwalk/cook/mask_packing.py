"""Pack masks of any shape into one picture; the tighter, the less memory a virtual texture takes.

The picture's cells are the bits of one long integer, row after row. Shifting that integer moves the whole picture, so a
few shifts find all positions at once where a mask would cover an occupied cell.
"""

import numpy as np

from depthwalk.types import Mask


def pack_masks(masks: list[Mask]) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Place masks in one picture so that they do not overlap.

    They are placed from large to small, each at the lowest position where it fits, so that small ones fill gaps.

    Parameters
    ----------
    masks
        (h, w) bool each, True for the cells that a mask needs.

    Returns
    -------
    tuple
        Row and column at which each mask begins in the picture, and the picture's height and width, all in cells.
    """
    sizes = [int(mask.sum()) for mask in masks]
    width = max(int(np.sqrt(sum(sizes))), *(mask.shape[1] for mask in masks))
    taken = 0  # bit row · width + column is set if that cell is occupied
    first_column = 0  # the bits of column 0, of as many rows as masks may begin in
    places = [(0, 0)] * len(masks)
    height = 0
    for number in sorted(range(len(masks)), key=lambda number: sizes[number], reverse=True):
        rows, columns = masks[number].shape
        runs = _runs(masks[number], width)
        first_column |= 1 << height * width
        across_edge = first_column * ((1 << columns - 1) - 1 << width - columns + 1)
        blocked = across_edge | _covering(taken, runs)
        place = (blocked + 1 & ~blocked).bit_length() - 1  # the lowest bit that is not set
        for first, length in runs:
            taken |= (1 << length) - 1 << place + first
        places[number] = divmod(place, width)
        for row in range(height + 1, places[number][0] + rows):
            first_column |= 1 << row * width
        height = max(height, places[number][0] + rows)
    return places, (height, width)


def _runs(mask: Mask, width: int) -> list[tuple[int, int]]:
    """Return the first bit and the length of each run of cells within a row of `mask`, for a picture of `width`."""
    change = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8))
    (row, start), (_, end) = (change > 0).nonzero(), (change < 0).nonzero()
    return list(zip((row * width + start).tolist(), (end - start).tolist(), strict=True))


def _covering(taken: int, runs: list[tuple[int, int]]) -> int:
    """Return the positions, as bits, at which a mask of `runs` would cover a cell that is `taken`."""
    power, longest = 1, max((length for _, length in runs), default=0)
    within = {1: taken}  # by a power of two: the places from which a taken cell is less than so many bits away
    while 2 * power <= longest:
        within[2 * power] = within[power] | within[power] >> power
        power *= 2
    covering = 0
    for first, length in runs:
        part = 1 << length.bit_length() - 1
        covering |= within[part] >> first | within[part] >> first + length - part
    return covering
