"""Tiles in the cache: found by their objects, evicted when unseen, invalidated on demand."""

from collections.abc import Sequence

import numpy as np

from depthwalk.render.impostors.tile_cache import CachedTiles, TileCache, shrunk
from depthwalk.render.impostors.tile_records import COMPOSITE_RECORD
from depthwalk.types import Rows


def tiles(objects: Rows | Sequence[int], slots: Rows, frame: int, density: float = 100.0) -> CachedTiles:
    """Whole tiles of these objects, shown in that frame."""
    count = len(objects)
    return CachedTiles(
        record=np.zeros(count, COMPOSITE_RECORD),
        object=np.asarray(objects),
        slot=slots,
        seen=np.full(count, frame),
        density=np.full(count, density),
        frustum=np.zeros((count, 3, 3)),
        whole=np.ones(count, bool),
        level=np.zeros(count, int),
        pieces=np.zeros(count, int),
        resolution=np.ones(count),
        provisional=np.zeros(count, bool),
    )


def filled(count: int = 4, side: int = 32) -> TileCache:
    """A cache whose atlas is full: four tiles of 32 × 32 texels in 64 × 64."""
    cache = TileCache(8, (64, 64))
    cache.frame = 1
    slots, resolution = cache.pack(np.full((count, 2), side), roomy=False)
    assert (resolution == 1).all()
    cache.store(tiles(np.arange(count), slots, 1))
    return cache


def test_tiles_are_found_by_their_objects() -> None:
    cache = filled()
    assert cache.rows(np.array([3, 0, 7])).tolist() == [3, 0, -1]
    assert cache.used == 1 and cache.shown_now == 4
    cache.clear()
    assert (cache.rows(np.arange(8)) == -1).all() and cache.used == 0


def test_tiles_take_the_area_of_their_slots() -> None:
    cache = filled()
    assert cache.areas(np.array([3, 7, 0])).tolist() == [32 * 32, 0, 32 * 32]


def test_tiles_are_stored_in_place_of_those_before() -> None:
    cache = filled()
    cache.store(tiles([2, 5], cache.tiles.slot[[2, 3]], 1, density=7.0))
    assert len(cache.tiles) == 5
    assert cache.tiles.density[cache.rows(np.array([2, 5]))].tolist() == [7, 7]
    assert (cache.tiles.object[cache.rows(np.array([0, 1, 2, 3, 5]))] == [0, 1, 2, 3, 5]).all()


def test_the_least_recently_shown_tile_gives_way() -> None:
    cache = filled()
    cache.frame = 9
    cache.tiles.seen[:] = [5, 3, 9, 7]
    allocated = cache.allocate(np.array([6]), np.array([[32, 32]]))
    assert allocated is not None
    slots, resolution = allocated
    assert cache.rows(np.arange(4)).tolist().count(-1) == 1 and cache.rows(np.array([1]))[0] == -1
    assert slots[0, 2:].tolist() == [32, 32] and resolution[0] == 1


def test_where_all_tiles_are_shown_new_ones_get_fewer_texels() -> None:
    cache = filled(count=3)
    allocated = cache.allocate(np.array([5]), np.array([[40, 40]]))
    assert allocated is not None
    _, resolution = allocated
    assert 0 < resolution[0] < 1
    assert (cache.rows(np.arange(3)) >= 0).all()


def test_invalid_tiles_stay_but_have_no_resolution_to_speak_of() -> None:
    cache = filled()
    cache.invalidate(np.array([1, 7]))
    assert cache.tiles.density[1] < 1e-20 and (cache.tiles.density[[0, 2, 3]] == 100).all()


def test_room_for_more_objects_keeps_the_tiles() -> None:
    cache = filled()
    cache.reserve(100)
    cache.reserve(10)
    assert cache.rows(np.array([3, 99])).tolist() == [3, -1]


def test_sizes_never_shrink_to_nothing() -> None:
    assert shrunk(np.array([[1, 100]]), 0.1).tolist() == [[1, 10]]
