"""The atlas: slots never overlap, what is given back is found again."""

from collections.abc import Sequence

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from depthwalk.render.impostors.atlas_allocator import Atlas, pack_shelves
from depthwalk.types import Rows

SIDE = 64
sizes = st.tuples(st.integers(1, 40), st.integers(1, 40)).map(np.array)
steps = st.lists(st.one_of(sizes, st.integers(0, 30)), max_size=60)


def covered(slots: Sequence[Rows]) -> Rows:
    texels = np.zeros((SIDE, SIDE), int)
    for x, y, width, height in slots:
        texels[y : y + height, x : x + width] += 1
    return texels


@given(steps)
def test_slots_do_not_overlap_however_they_come_and_go(steps: list[Rows | int]) -> None:
    """A size asks for a slot, a number gives one back."""
    atlas, held = Atlas((SIDE, SIDE)), []
    for step in steps:
        if not isinstance(step, int):
            slot = atlas.allocate(step)
            if slot is not None:
                assert (slot[2:] >= step).all()
                held.append(slot)
        elif held:
            atlas.release(held.pop(step % len(held))[None])
        texels = covered(held)
        assert texels.max() <= 1
        assert atlas.free_texels == (texels == 0).sum()
    atlas.release(np.array(held).reshape(-1, 4).astype(int))
    assert atlas.free_texels == SIDE * SIDE


@given(arrays(np.int64, st.tuples(st.integers(1, 40), st.just(2)), elements=st.integers(1, 20)), sizes)
def test_packing_leaves_the_rest_free(tiles: Rows, size: Rows) -> None:
    atlas = Atlas((SIDE, SIDE))
    atlas.allocate(np.array([SIDE, 1]))  # packing starts anew
    slots = atlas.pack(tiles)
    if slots is None:
        assert pack_shelves(tiles, SIDE)[1] > SIDE
        return
    assert (slots[:, 2:] >= tiles).all()
    another = atlas.allocate(size)
    assert covered([*slots, *([] if another is None else [another])]).max() <= 1
    atlas.release(slots)
    if another is None:
        assert atlas.allocate(np.array([SIDE, SIDE])) is not None


@given(steps, arrays(np.int64, st.tuples(st.integers(1, 40), st.just(2)), elements=st.integers(1, 20)))
def test_many_at_once_lie_beside_the_others(steps: Sequence[Rows | int], tiles: Rows) -> None:
    atlas, held = Atlas((SIDE, SIDE)), []
    for step in steps:
        if not isinstance(step, int):
            if (slot := atlas.allocate(step)) is not None:
                held.append(slot)
        elif held:
            atlas.release(held.pop(step % len(held))[None])
    before = atlas.free_texels
    if not before:
        return
    slots = atlas.allocate_all(tiles)
    if slots is None:
        assert atlas.free_texels == before
        return
    assert (slots[:, 2:] >= tiles).all()
    held += list(slots)
    texels = covered(held)
    assert texels.max() <= 1
    assert atlas.free_texels == (texels == 0).sum()
    atlas.release(np.array(held))
    assert atlas.free_texels == SIDE * SIDE


def test_an_empty_atlas_holds_what_is_packed() -> None:
    tiles = np.random.default_rng(0).integers(1, 9, (60, 2))
    np.testing.assert_array_equal(Atlas((SIDE, SIDE)).allocate_all(tiles), Atlas((SIDE, SIDE)).pack(tiles))


def test_a_tile_that_is_too_large_finds_no_slot() -> None:
    atlas = Atlas((SIDE, SIDE))
    assert atlas.allocate(np.array([SIDE + 1, 1])) is None
    assert atlas.pack(np.full((5, 2), SIDE // 2)) is None


@given(arrays(np.int64, st.tuples(st.integers(1, 60), st.just(2)), elements=st.integers(1, 64)))
def test_tiles_do_not_overlap(sizes: Rows) -> None:
    corners, used = pack_shelves(sizes, 64)
    texels = np.zeros((used, 64), int)
    for (x, y), (width, height) in zip(corners, sizes, strict=True):
        texels[y : y + height, x : x + width] += 1
    assert texels.max() == 1 and texels.sum() == (sizes[:, 0] * sizes[:, 1]).sum()
