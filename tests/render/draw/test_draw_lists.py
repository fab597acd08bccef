"""Draw lists: runs of equal instances, and the lists of several phases put together."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import PIECES, RANGES, piece_runs
from depthwalk.render.draw.draw_lists import DrawBatch, DrawList, FrameDrawLists, ImpostorDraws, draw_batches
from depthwalk.render.draw.frame_counts import DrawnTiles
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.scene.arrays import Representation


def table() -> SimpleNamespace:
    """Three assets of two levels, whose pieces have 3 indices each."""
    count = np.zeros((3, 2, RANGES), int)
    count[:, :, :PIECES] = 3
    first = np.cumsum(count, -1) - count

    def runs(asset: int, level: int, pieces: int) -> tuple[tuple[int, int], ...]:
        return piece_runs(first[asset, level], count[asset, level], pieces)

    return SimpleNamespace(runs=runs)


def test_batches_are_runs_of_what_is_equal() -> None:
    asset, level = np.array([0, 0, 1, 1, 2]), np.array([0, 1, 1, 1, 0])
    clipped = np.array([False, False, False, True, True])
    batches = draw_batches(cast(AssetTable, table()), asset, level, clipped=clipped)
    assert [(b.asset, b.level, b.first, b.count, b.clipped) for b in batches] == [
        (0, 0, 0, 1, False),
        (0, 1, 1, 1, False),
        (1, 1, 2, 1, False),
        (1, 1, 3, 1, True),
        (2, 0, 4, 1, True),
    ]
    assert draw_batches(cast(AssetTable, table()), asset[:0]) == []


def test_batches_hold_the_indices_of_their_pieces() -> None:
    """Ranges that adjoin are one run."""
    pieces = np.array([0b0011, 0b0101])
    first, second = draw_batches(cast(AssetTable, table()), np.zeros(2, int), np.zeros(2, int), pieces)
    assert first.indices == ((0, 6),) and second.indices == ((0, 3), (6, 3))


def test_runs_of_one_asset_come_together() -> None:
    batches = draw_batches(cast(AssetTable, table()), np.array([0, 0, 2]), np.array([0, 1, 0]))
    found = [
        (asset, [b.first for b in run])
        for asset, run in DrawList(records=records([0, 0, 0]), batches=batches).by_asset()
    ]
    assert found == [(0, [0, 1]), (2, [2])]


def records(numbers: Sequence[int]) -> NDArray[np.void]:
    """Records that hold nothing but a number."""
    return np.array([(number,) for number in numbers], np.dtype([("number", int)]))


def drawn(count: int, *batches: DrawBatch) -> DrawList:
    return DrawList(records=records([0] * count), batches=list(batches))


def tiles(resolution: Sequence[float]) -> DrawnTiles:
    """Tiles of level 0 that differ in their resolution alone."""
    none = np.zeros(len(resolution), int)
    return DrawnTiles(
        level=none,
        pieces=none,
        resolution=np.array(resolution, float),
        error=0.0 * none,
        step=none + 1,
        members=none + 1,
    )


def frame(
    warp: DrawList | None = None, dmesh: DrawList | None = None, mesh: DrawList | None = None, **noted: float
) -> FrameDrawLists:
    """Lists that draw no tiles."""
    none = np.zeros(0, int)
    return FrameDrawLists(
        warp=warp or drawn(0),
        composite=ImpostorDraws(records=records([]), aligned=0, rows=none),
        dmesh=dmesh or drawn(0),
        mesh=mesh or drawn(0),
        cleared=np.zeros((0, 4), int),
        noted={**noted},
        tiles=tiles([]),
        object_rows=none,
        drawn_as=none.astype(np.uint8),
    )


def test_lists_that_draw_nothing_count_nothing() -> None:
    found = frame(objects=100, atlas_used=0.25).counts
    assert found.pop("objects") == 100 and found.pop("atlas_used") == 0.25 and found.pop("tile_resolution") == 1
    assert not any(found.values())
    assert {"occluded", "clusters", "dpci", "dmesh", "mesh", "shadow_maps", "warped", "warped_triangles"} < set(found)


def test_triangles_are_counted_for_each_instance() -> None:
    """Of depth images, whether they are warped or drawn straight into the picture; meshes are counted elsewhere."""
    warp = drawn(
        3, DrawBatch(asset=0, first=0, count=2, indices=((0, 30), (90, 6))), DrawBatch(asset=1, first=2, count=1)
    )
    dmesh = drawn(5, DrawBatch(asset=1, first=0, count=5, indices=((0, 3),)))
    found = frame(warp, dmesh, drawn(4, DrawBatch(asset=2, first=0, count=4))).counts
    assert found["warped_triangles"] == 2 * 12 + 5 * 1
    assert (found["warped"], found["dmesh"], found["mesh"], found["draw_batches"]) == (3, 5, 4, 2)


def test_later_steps_add_to_the_counts() -> None:
    plan = frame(objects=9)
    assert plan.counts["shadow_maps"] == 0
    plan.note("shadow_maps", 2)
    plan.note("shadow_maps", 1)
    assert plan.counts["shadow_maps"] == 3


def phase(numbered: Sequence[int], aligned: int, occluded: int, resolution: float) -> FrameDrawLists:
    """A phase that draws so many objects by tiles, and two directly."""
    count = len(numbered)
    batches = draw_batches(cast(AssetTable, table()), np.array([1, 1]))
    direct = DrawList(records=records([0, 1]), batches=batches)
    return FrameDrawLists(
        warp=direct,
        composite=ImpostorDraws(records=records(numbered), aligned=aligned, rows=np.asarray(numbered)),
        dmesh=direct,
        mesh=direct,
        cleared=np.zeros((count, 4), int),
        noted={"objects": 9, "occluded": occluded},
        tiles=tiles([1.0] * (count - 1) + [resolution]),
        object_rows=np.asarray(numbered),
        drawn_as=np.full(count, Representation.DPCI, np.uint8),
    )


def test_phases_are_joined_by_what_their_counts_mean() -> None:
    joined = FrameDrawLists.joined([phase([5, 6, 7], 1, 2, 1.0), phase([8, 9], 2, 3, 0.5)])
    wanted = {"objects": 9, "occluded": 5, "tile_resolution": 0.5, "dpci": 5, "warped": 4, "level_0": 5}
    assert {name: joined.counts[name] for name in wanted} == wanted
    assert joined.composite.records["number"].tolist() == [5, 8, 9, 6, 7] and joined.composite.aligned == 3
    assert joined.composite.rows.tolist() == [5, 8, 9, 6, 7]
    assert joined.object_rows.tolist() == [5, 6, 7, 8, 9] and joined.next_object_id == 6
    assert [batch.first for batch in joined.dmesh.batches] == [0, 2]


def test_height_fields_are_joined_by_representation() -> None:
    """A phase may have none, or others than the next."""
    bump, relief = Representation.BUMP, Representation.RELIEF
    phases = [phase([5], 0, 0, 1.0), phase([6], 0, 0, 1.0), phase([7], 0, 0, 1.0)]
    two = phases[0].dmesh
    phases[1].height_fields = {relief: two}
    phases[2].height_fields = {bump: two, relief: two}
    joined = FrameDrawLists.joined(phases).height_fields
    assert {kind: len(drawn.records) for kind, drawn in joined.items()} == {relief: 4, bump: 2}
    assert [batch.first for batch in joined[relief].batches] == [0, 2]


def test_each_height_field_has_the_number_of_its_row() -> None:
    plan = phase([5, 6, 7, 8], 0, 0, 1.0)
    plan.first_object_id = 10
    plan.drawn_as[:] = Representation.DPCI, Representation.DMESH, Representation.RELIEF, Representation.BUMP
    assert plan.first_id_of(Representation.RELIEF) == 12 and plan.first_id_of(Representation.BUMP) == 13
    assert plan.tiled.tolist() == [True, False, False, False]


def test_one_phase_is_the_frame() -> None:
    only = phase([1], 0, 0, 1.0)
    assert FrameDrawLists.joined([only]) is only
