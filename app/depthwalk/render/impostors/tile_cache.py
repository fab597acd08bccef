"""Intermediate images kept from frame to frame: what is known of each, and where it lies."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.soa import Takes
from depthwalk.render.impostors.atlas_allocator import Atlas
from depthwalk.render.impostors.tile_records import COMPOSITE_RECORD
from depthwalk.types import Array, Rows

_SHRINK = 0.7, 6  # resolution of a tile that finds no room, and how often it is tried
_SPOILT = 1e-30  # pixels per metre: as far off as anything
_SPARSE = 0.5  # an atlas that is used less but has no room is in pieces
_MANY = 64  # tiles that are placed at once where they can be: one by one each fits more snugly, and takes 0.1 ms
_SELDOM = 120  # frames from one packing to the next for that reason: it costs a frame without reuse


@dataclass(kw_only=True)
class CachedTiles(Takes):
    """n tiles in the atlas.

    record: (n,) COMPOSITE_RECORD; object: (n,) row of Objects; slot: (n, 4) of the atlas; seen: (n,) number of the
    frame that showed it last; density: (n,) pixels per metre at the object's centre, object frame, that it was made
    for; whole: (n,), it holds all of the object; frustum: (n, 3, 3), rows a, b, c: else it holds the points p, from its
    viewer, with |a·p|, |b·p| ≤ c·p; level, pieces: (n,) that it shows, see `Shown`; resolution:
    (n,), part of the texels it should have.
    """

    record: NDArray[np.void]
    object: Rows
    slot: Rows
    seen: Rows
    density: Array
    frustum: Array
    whole: NDArray[np.bool_]
    level: Rows
    pieces: Rows
    resolution: Array

    def __len__(self) -> int:
        return len(self.object)

    @classmethod
    def none(cls) -> "CachedTiles":
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
        )


class TileCache:
    """The tiles in the atlas, by object. frame: number of the present one."""

    def __init__(self, objects: int = 0, atlas_size: tuple[int, int] = (1, 1)) -> None:
        self.atlas_size = atlas_size
        self.frame = 0
        self._row = np.full(objects, -1, np.int32)
        self._packed = 0  # number of the frame that packed it last
        self.clear()

    def clear(self) -> None:
        """Forgets all tiles."""
        self.tiles = CachedTiles.none()
        self._atlas = Atlas(self.atlas_size)
        self._row[:] = -1

    def rows(self, objects: Rows) -> Rows:
        """The row (m,) in `tiles` of each object (m,); -1 where there is none."""
        return self._row[objects]

    def spoil(self, objects: Rows) -> None:
        """The tiles of `objects` (m,) are to be warped anew, whatever they are like."""
        row = self._row[objects]
        self.tiles.density[row[row >= 0]] = _SPOILT

    @property
    def shown_lately(self) -> int:
        """How many of the tiles the present frame has shown."""
        return int((self.tiles.seen == self.frame).sum())

    @property
    def used(self) -> float:
        """Part of the atlas that has slots."""
        return 1 - self._atlas.free_texels / (self.atlas_size[0] * self.atlas_size[1])

    def pack(self, sizes: Rows, roomy: bool) -> tuple[Rows, Array]:
        """Slots (n, 4) for tiles of `sizes` (n, 2) in an atlas that holds nothing else, and the part of their width and
        height (n,) that all must do with. roomy: slots have room for tiles that grow."""
        self._packed = self.frame
        wanted = _roomy(sizes) if roomy else sizes
        resolution = 1.0
        while (slots := self._atlas.pack(shrunk(wanted, resolution))) is None:
            resolution *= 0.95
        return slots, np.full(len(sizes), resolution)

    def allocate(self, objects: Rows, sizes: Rows) -> tuple[Rows, Array] | None:
        """Slots (n, 4) for new tiles of objects (n,), the most important first, in place of those they have; and the
        part of their width and height (n,) that they must do with.

        For want of room, tiles that no frame has shown for longest go, then the new ones get fewer texels. None where
        that does not help, or now and then where the room lies in pieces: the atlas is then to be packed anew.
        """
        row = self._row[objects]
        had = np.zeros((len(row), 4), np.int64)
        had[row >= 0] = self.tiles.slot[row[row >= 0]]
        wanted = _roomy(sizes)
        stays = (had[:, 2:] >= sizes).all(1) & (had[:, 2:].prod(1) <= 2 * wanted.prod(1))
        self._atlas.release(had[~stays])
        slots, resolution = had.copy(), np.ones(len(objects))
        left = np.flatnonzero(~stays)
        if len(left) > _MANY and (found := self._atlas.allocate_all(wanted[left])) is not None:
            slots[left], left = found, left[:0]
        for k in left.tolist():
            placed = self._place(wanted[k])
            if placed is None:
                return None
            slots[k], resolution[k] = placed
        return slots, resolution

    def _place(self, size: Rows) -> tuple[Rows, float] | None:
        slot = self._atlas.allocate(size)
        while slot is None and self._evict():
            slot = self._atlas.allocate(size)
        if slot is None and self.used < _SPARSE and self.frame > self._packed + _SELDOM:
            return None
        resolution, tries = 1.0, _SHRINK[1]
        while slot is None and tries:
            resolution, tries = resolution * _SHRINK[0], tries - 1
            slot = self._atlas.allocate(shrunk(size, resolution))
        return None if slot is None else (slot, resolution)

    def _evict(self) -> bool:
        """Frees a quarter of the tiles that this frame does not show, those not shown for longest; False if there are
        none."""
        hidden = np.flatnonzero(self.tiles.seen < self.frame)
        if not len(hidden):
            return False
        oldest = hidden[np.argsort(self.tiles.seen[hidden], kind="stable")][: -(-len(hidden) // 4)]
        self._atlas.release(self.tiles.slot[oldest])
        self._row[self.tiles.object[oldest]] = -1
        self.tiles = self.tiles.take(np.delete(np.arange(len(self.tiles)), oldest))
        self._row[self.tiles.object] = np.arange(len(self.tiles))
        return True

    def store(self, new: CachedTiles) -> None:
        """Keeps tiles that were just warped, in place of what their objects had."""
        row = self._row[new.object]
        self.tiles.put(row[row >= 0], new.take(row >= 0))
        if (row < 0).any():
            self.tiles = CachedTiles.joined([self.tiles, new.take(row < 0)])
        self._row[self.tiles.object] = np.arange(len(self.tiles))


def shrunk(sizes: Rows, factor: float | Array) -> Rows:
    """Sizes (n, 2) times a factor, at least 1."""
    return np.maximum((sizes * factor).astype(np.int64), 1)


def _roomy(sizes: Rows) -> Rows:
    """Sizes up to an eighth larger, of which there are eight between powers of two: tiles that grow stay in their
    slots, and slots fit one another."""
    step = np.maximum(2.0 ** (np.floor(np.log2(sizes)) - 3), 1)
    return (np.ceil(sizes / step) * step).astype(np.int64)
