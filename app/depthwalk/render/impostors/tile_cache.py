"""Cache impostor tiles from frame to frame: what each shows, and where in the atlas it lies."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.soa import StructOfArrays
from depthwalk.render import kernels
from depthwalk.render.impostors.atlas_allocator import Atlas
from depthwalk.render.impostors.tile_records import COMPOSITE_RECORD
from depthwalk.types import Array, Mask, Rows

_SHRINK = 0.7  # factor by which the resolution of a tile is lowered if it finds no room
_TRIES = 6  # how often it is lowered at most
_INVALID = 1e-30  # pixels per metre: a resolution so wrong that the tile is warped again
_SPARSE = 0.5  # part of the atlas: if less is used, and yet there is no room, it is fragmented
_MANY = 64  # more tiles than this are placed at once if they fit; one by one they pack tighter, but take 0.1 ms each
_SELDOM = 120  # frames between two packings of a fragmented atlas, as each costs a frame without reuse


@dataclass(kw_only=True)
class CachedTiles(StructOfArrays):
    """Hold n tiles of the atlas.

    Attributes
    ----------
    record : (n,) COMPOSITE_RECORD that draws each.
    object : (n,) row of the object that each shows.
    slot : (n, 4) where each lies in the atlas: x, y, width, height, texels.
    seen : (n,) number of the frame that showed each tile last.
    density : (n,) pixels per metre at the object's centre, object frame, that each tile was made for.
    frustum : (n, 3, 3) rows a, b, c, object frame: a tile that is not whole holds the points p, relative to the viewer
        that it was warped for, with |a·p|, |b·p| ≤ c·p.
    whole : (n,) whether each tile holds all of its object.
    level : (n,) level of detail of the geometry that each tile shows.
    pieces : (n,) pieces of that geometry, bit masks, see `ImpostorObjects`.
    resolution : (n,) texels along each side of each tile over those that it should have there, 0 to 1.
    provisional : (n,) whether each tile shows a coarser level than it should, for lack of time.
    """

    record: NDArray[np.void]
    object: Rows
    slot: Rows
    seen: Rows
    density: Array
    frustum: Array
    whole: Mask
    level: Rows
    pieces: Rows
    resolution: Array
    provisional: Mask

    def __len__(self) -> int:
        return len(self.object)

    @classmethod
    def empty(cls) -> "CachedTiles":
        """Return a table of no tiles."""
        number, real = np.zeros(0, np.int64), np.zeros(0)
        return cls(
            record=np.zeros(0, COMPOSITE_RECORD),
            object=number,
            slot=np.zeros((0, 4), np.int64),
            seen=number,
            density=real,
            frustum=np.zeros((0, 3, 3)),
            whole=np.zeros(0, bool),
            level=number,
            pieces=number,
            resolution=real,
            provisional=np.zeros(0, bool),
        )


class TileCache:
    """Keep the table of the impostor tiles in an atlas, and find them by the objects that they show.

    Parameters
    ----------
    objects : how many objects may have a tile.
    atlas_size : width and height of the atlas, texels.

    Attributes
    ----------
    tiles : the table of the tiles.
    frame : the number of the present frame.
    """

    def __init__(self, objects: int = 0, atlas_size: tuple[int, int] = (1, 1)) -> None:
        self.atlas_size = atlas_size
        self.frame = 0
        self._row = np.full(objects, -1, np.int32)
        self._packed = 0  # number of the frame that packed the atlas last
        self.clear()

    def clear(self) -> None:
        """Drop all tiles."""
        self.tiles = self._table = CachedTiles.empty()
        self._atlas = Atlas(self.atlas_size)
        self._row[:] = -1

    def reserve(self, objects: int) -> None:
        """Make room for the tiles of `objects` objects in all; the tiles that are cached stay."""
        more = max(objects - len(self._row), 0)
        if more:
            self._row = np.append(self._row, np.full(more, -1, np.int32))

    def rows(self, objects: Rows) -> Rows:
        """Return the rows of `tiles` that hold the tiles of `objects`.

        Parameters
        ----------
        objects : (m,) rows of the objects.

        Returns
        -------
        (m,) rows of `tiles`; −1 for an object without a tile.
        """
        return self._row[objects]

    def areas(self, objects: Rows) -> Array:
        """Return how much of the atlas the tiles of `objects` take.

        Parameters
        ----------
        objects : (m,) rows of the objects.

        Returns
        -------
        (m,) texels, about as many as pixels that a tile covers; 0 for an object without a tile.
        """
        row = self._row[objects]
        if (loops := kernels.loaded()) is not None:
            return np.asarray(loops.areas(row, self.tiles.slot))
        area = np.zeros(len(row))
        area[row >= 0] = self.tiles.slot[row[row >= 0], 2:].prod(1)
        return area

    def invalidate(self, objects: Rows) -> None:
        """Mark the tiles of the objects with the rows `objects` (m,) as invalid, so that they are warped again."""
        row = self._row[objects]
        self.tiles.density[row[row >= 0]] = _INVALID

    @property
    def shown_now(self) -> int:
        """Return how many of the tiles the present frame has shown."""
        return int((self.tiles.seen == self.frame).sum())

    @property
    def used(self) -> float:
        """Return which part of the atlas is taken by slots, 0 to 1."""
        return 1 - self._atlas.free_texels / (self.atlas_size[0] * self.atlas_size[1])

    def pack(self, sizes: Rows, roomy: bool) -> tuple[Rows, Array]:
        """Free all slots of the atlas, and return slots for new tiles.

        Parameters
        ----------
        sizes : (n, 2) width and height of the tiles, texels.
        roomy : whether slots are a little larger than their tiles, so that tiles may grow.

        Returns
        -------
        (n, 4) slots x, y, width, height, texels, and (n,) the factor, the same for all, by which the tiles must shrink
        in width and height to fit.
        """
        self._packed = self.frame
        padded = _roomy(sizes) if roomy else sizes
        resolution = 1.0
        while (slots := self._atlas.pack(shrunk(padded, resolution))) is None:
            resolution *= 0.95
        return slots, np.full(len(sizes), resolution)

    def allocate(self, objects: Rows, sizes: Rows) -> tuple[Rows, Array] | None:
        """Return slots for new tiles, in place of those that their objects have.

        Where the atlas is full, the tiles that were shown least recently are evicted; if that is not enough, new tiles
        get fewer texels.

        Parameters
        ----------
        objects : (n,) rows of the objects, the most important first.
        sizes : (n, 2) width and height of the tiles, texels.

        Returns
        -------
        (n, 4) slots x, y, width, height, texels, and (n,) the factor by which each tile must shrink in width and height
        to fit. None if even that does not help or, from time to time, if the atlas is fragmented: then the caller has
        to pack the atlas again.
        """
        decide = kept_slots if (loops := kernels.loaded()) is None else loops.kept_slots
        had, padded, stays = decide(self._row[objects], self.tiles.slot, sizes)
        self._atlas.release(had[~stays])
        slots, resolution = had.copy(), np.ones(len(objects))
        left = np.flatnonzero(~stays)
        if len(left) > _MANY and (found := self._atlas.allocate_all(padded[left])) is not None:
            slots[left], left = found, left[:0]
        found = self._atlas.allocate_each(padded[left])
        slots[left[: len(found)]] = found
        for k in left[len(found) :].tolist():
            placed = self._place(padded[k])
            if placed is None:
                return None
            slots[k], resolution[k] = placed
        return slots, resolution

    def _place(self, size: Rows) -> tuple[Rows, float] | None:
        """Return a slot (4,) for a tile of `size` (2,), and the factor by which it must shrink; see `allocate`."""
        slot = self._atlas.allocate(size)
        while slot is None and self._evict():
            slot = self._atlas.allocate(size)
        if slot is None and self.used < _SPARSE and self.frame > self._packed + _SELDOM:
            return None
        resolution, tries = 1.0, _TRIES
        while slot is None and tries:
            resolution, tries = resolution * _SHRINK, tries - 1
            slot = self._atlas.allocate(shrunk(size, resolution))
        return None if slot is None else (slot, resolution)

    def _evict(self) -> bool:
        """Evict the least recently shown quarter of the tiles that this frame does not show.

        Returns
        -------
        Whether there were any to evict.
        """
        unused = np.flatnonzero(self.tiles.seen < self.frame)
        if not len(unused):
            return False
        oldest = unused[np.argsort(self.tiles.seen[unused], kind="stable")][: -(-len(unused) // 4)]
        self._atlas.release(self.tiles.slot[oldest])
        self._row[self.tiles.object[oldest]] = -1
        self.tiles = self._table = self.tiles.take(np.delete(np.arange(len(self.tiles)), oldest))
        self._row[self.tiles.object] = np.arange(len(self.tiles))
        return True

    def store(self, new: CachedTiles) -> None:
        """Store the `new` tiles of objects in place of their old ones."""
        row, known = self._row[new.object], len(self.tiles)
        (had,) = (row >= 0).nonzero()
        added = new
        if len(had):
            self.tiles.put(row[had], new if len(had) == len(row) else new.take(had))
            added = new.take(row < 0) if len(had) < len(row) else new.take(slice(0))
        if not len(added):
            return
        end = known + len(added)
        if end > len(self._table):  # double the capacity, so that this is rare
            room = CachedTiles.joined([added.take(np.zeros(end, np.intp))])
            self._table = CachedTiles.joined([self.tiles, added, room])
        else:
            self._table.put(slice(known, end), added)
        self.tiles = self._table.take(slice(0, end))
        self._row[added.object] = np.arange(known, end)


def shrunk(sizes: Rows, factor: float | Array) -> Rows:
    """Return the sizes of tiles times a factor; every side keeps at least one texel.

    Parameters
    ----------
    sizes : (n, 2) width and height of the tiles, texels.
    factor : one number for all tiles, or (n, 1) a number for each.

    Returns
    -------
    (n, 2) int64 texels, rounded down.
    """
    return np.maximum((sizes * factor).astype(np.int64), 1)


def kept_slots(row: Rows, slot: Rows, sizes: Rows) -> tuple[Rows, Rows, Mask]:
    """Decide which tiles may stay in the slots that their objects have: not in those that are much too large.

    Parameters
    ----------
    row : (n,) row in `slot` of the slot that the object of each tile has, −1 for none.
    slot : (t, 4) slots, x, y, width, height, texels.
    sizes : (n, 2) width and height of the tiles, texels.

    Returns
    -------
    (n, 4) slots that the objects have, 0 for none, (n, 2) sizes of new slots, and (n,) whether each tile stays.
    """
    had, padded = np.zeros((len(row), 4), np.int64), _roomy(sizes)
    had[row >= 0] = slot[row[row >= 0]]
    return had, padded, (had[:, 2:] >= sizes).all(1) & (had[:, 2:].prod(1) <= 2 * padded.prod(1))


def _roomy(sizes: Rows) -> Rows:
    """Round sizes (n, 2) up, by at most an eighth, to one of eight steps between powers of two.

    Tiles that grow a little then stay in their slots, and slots are reused by other tiles.
    """
    step = np.maximum(2.0 ** (np.floor(np.log2(sizes)) - 3), 1)
    return (np.ceil(sizes / step) * step).astype(np.int64)
