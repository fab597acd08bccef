"""Allocate slots of the atlas for impostor tiles.

Slots are cut from free rectangles (a guillotine allocator); slots that are released merge with free neighbours.
"""

import numpy as np

from depthwalk.render import kernels
from depthwalk.types import Rows


class Atlas:
    """Hold the free rectangles of an atlas. Free rectangles and slots are rows (x, y, width, height), texels.

    Parameters
    ----------
    size : width and height of the atlas, texels.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        self._free: Rows = np.array([[0, 0, *size]], np.int64)

    def pack(self, sizes: Rows) -> Rows | None:
        """Free all slots, and allocate slots for new tiles, shelf by shelf.

        Parameters
        ----------
        sizes : (n, 2) width and height of the tiles, texels.

        Returns
        -------
        (n, 4) slots; None where the tiles do not fit, and nothing was freed.
        """
        corners, used = pack_shelves(sizes, self.size[0])
        if used > self.size[1]:
            return None
        width, height = self.size
        starts, shelf = np.unique(corners[:, 1], return_inverse=True)
        heights = np.diff(np.append(starts, used))
        ends = np.zeros_like(starts)
        np.maximum.at(ends, shelf, corners[:, 0] + sizes[:, 0])
        rest = np.stack([ends, starts, width - ends, heights], -1)
        self._free = np.concatenate([rest, [[0, used, width, height - used]]])
        return np.column_stack([corners, sizes[:, 0], heights[shelf]])

    def allocate(self, size: Rows) -> Rows | None:
        """Allocate the slot that fits a tile most tightly.

        Parameters
        ----------
        size : (2,) width and height of the tile, texels.

        Returns
        -------
        (4,) the slot; None where no free rectangle is large enough.
        """
        free = self._free
        left = free[:, 2:] - size
        fits = np.flatnonzero((left >= 0).all(1))
        if not len(fits):
            return None
        best = int(fits[np.argmin(left[fits].min(1))])
        x, y, wide, high = free[best].tolist()
        width, height = size.tolist()
        # What is left is an L; cut it so that its larger part stays whole.
        if wide - width > high - height:
            rest = [x + width, y, wide - width, high], [x, y + height, width, high - height]
        else:
            rest = [x, y + height, wide, high - height], [x + width, y, wide - width, height]
        self._free[best] = rest[0]
        if rest[1][2] * rest[1][3]:
            self._free = np.concatenate([self._free, rest[1:]])
        return np.array([x, y, width, height])

    def allocate_each(self, sizes: Rows) -> Rows:
        """Allocate slots for tiles one after the other, until one does not fit.

        Parameters
        ----------
        sizes : (n, 2) width and height of the tiles, texels.

        Returns
        -------
        (k, 4) the slots of the first k tiles, each as by `allocate`.
        """
        loops = kernels.loaded()
        if loops is not None:
            slots, self._free, count = loops.allocate(self._free, sizes)
            return np.asarray(slots[:count])
        slots = np.zeros((len(sizes), 4), np.int64)
        for k, size in enumerate(sizes):
            slot = self.allocate(size)
            if slot is None:
                return slots[:k]
            slots[k] = slot
        return slots

    def allocate_all(self, sizes: Rows) -> Rows | None:
        """Allocate slots for many tiles at once, in the largest free rectangle.

        Parameters
        ----------
        sizes : (n, 2) width and height of the tiles, texels.

        Returns
        -------
        (n, 4) slots; None where that rectangle is too small for all of them.
        """
        largest = int(np.argmax(self._free[:, 2:].prod(1)))
        x, y, width, height = self._free[largest].tolist()
        within = Atlas((width, height))
        slots = within.pack(sizes) if sizes[:, 0].max() <= width else None
        if slots is None:
            return None
        corner = np.array([x, y, 0, 0])
        self._free = np.concatenate([np.delete(self._free, largest, 0), within._free + corner])
        return np.asarray(slots + corner)

    def release(self, slots: Rows) -> None:
        """Free the `slots` (n, 4), and merge free neighbours that together make a rectangle."""
        if not len(slots):
            return
        loops = kernels.loaded()
        if loops is not None:
            self._free = loops.released(self._free, slots)
            return
        free = np.concatenate([self._free, slots])
        free = free[(free[:, 2:] > 0).all(1)]
        for axis in (0, 1):
            free = _merged(free, axis)
        self._free = free

    @property
    def free_texels(self) -> int:
        """Return how many texels belong to no slot."""
        return int(self._free[:, 2:].prod(1).sum())


def _merged(free: Rows, axis: int) -> Rows:
    """Merge rectangles (n, 4) that touch end to end along `axis`, 0 or 1, and are equal along the other."""
    start, length, other, across = (free[:, k] for k in (axis, 2 + axis, 1 - axis, 3 - axis))
    order = np.lexsort((start, across, other))
    free, start, length, other, across = free[order], start[order], length[order], other[order], across[order]
    touch = (start[1:] == (start + length)[:-1]) & (other[1:] == other[:-1]) & (across[1:] == across[:-1])
    first = np.flatnonzero(np.append(True, ~touch)[: len(free)])
    merged = free[first]
    if len(first):
        merged[:, 2 + axis] = np.add.reduceat(length, first)
    return merged


def pack_shelves(sizes: Rows, width: int) -> tuple[Rows, int]:
    """Pack tiles into a strip, shelf by shelf (next-fit decreasing height, Coffman et al. 1980).

    Tiles are sorted by height, and fill one shelf after the other. The loop runs over shelves, not over tiles.

    Parameters
    ----------
    sizes : (n, 2) width and height of the tiles, texels, none wider than the strip.
    width : width of the strip, texels.

    Returns
    -------
    (n, 2) lower left corners of the tiles, and the height used, texels.
    """
    corners = np.zeros_like(sizes)
    order = np.argsort(-sizes[:, 1], kind="stable")
    ends = np.cumsum(sizes[order, 0])
    start, y = 0, 0
    while start < len(order):
        before = ends[start - 1] if start else 0
        stop = int(np.searchsorted(ends, before + width, side="right"))
        shelf = order[start:stop]
        corners[shelf, 0] = ends[start:stop] - sizes[shelf, 0] - before
        corners[shelf, 1] = y
        y += int(sizes[order[start], 1])
        start = stop
    return corners, y
