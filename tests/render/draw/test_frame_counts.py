"""What HUD and benchmark are told of a phase."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import cast

import numpy as np

from depthwalk.cook.cases import ALL_PIECES, BOTTOM_PIECE, TOP_PIECE
from depthwalk.render.draw.draw_lists import Counts, DrawBatch, DrawList, ImpostorQuads
from depthwalk.render.draw.frame_counts import phase_counts
from depthwalk.render.impostors.tile_scheduler import TileWork

RECORD = np.dtype([("corner", np.int32)])  # of what is only counted


def drawn(records: int, *batches: DrawBatch) -> DrawList:
    return DrawList(records=np.zeros(records, RECORD), batches=list(batches))


def counts(
    warp: DrawList | None = None,
    dmesh: DrawList | None = None,
    mesh: DrawList | None = None,
    level: Sequence[int] = (),
    pieces: Sequence[int] = (),
    step: Sequence[float] = (),
    resolution: Sequence[float] = (),
    error: Sequence[float] = (),
) -> Counts:
    """Of a phase of a scene of 100 objects; one tile for each level."""
    work = SimpleNamespace(
        level=np.array(level, int),
        pieces=np.array(pieces, int),
        resolution=np.array(resolution, float),
        error=np.array(error, float),
        provisional=0,
        atlas_used=0.25,
    )
    nothing = drawn(0)
    quads = ImpostorQuads(records=np.zeros(len(work.level), RECORD), aligned=0)
    tiles = cast(TileWork, work)
    return phase_counts(100, warp or nothing, quads, dmesh or nothing, mesh or nothing, tiles, np.array(step, float))


def test_a_phase_that_draws_nothing_counts_nothing() -> None:
    found = counts()
    assert found.pop("objects") == 100 and found.pop("atlas_used") == 0.25 and found.pop("tile_resolution") == 1
    assert not any(found.values())


def test_triangles_are_counted_for_each_instance() -> None:
    """Of depth images, whether they are warped or drawn straight into the picture; meshes are counted elsewhere."""
    warp = drawn(
        3, DrawBatch(asset=0, first=0, count=2, indices=((0, 30), (90, 6))), DrawBatch(asset=1, first=2, count=1)
    )
    dmesh = drawn(5, DrawBatch(asset=1, first=0, count=5, indices=((0, 3),)))
    found = counts(warp, dmesh, drawn(4, DrawBatch(asset=2, first=0, count=4)))
    assert found["warped_triangles"] == 2 * 12 + 5 * 1
    assert (found["warped"], found["dmesh"], found["mesh"], found["draw_batches"]) == (3, 5, 4, 2)


def test_levels_steps_and_cases_have_a_number_each() -> None:
    side = ALL_PIECES & ~(1 << TOP_PIECE | 1 << BOTTOM_PIECE)
    pieces = [side, side | 1 << TOP_PIECE, side | 1 << TOP_PIECE, side | 1 << BOTTOM_PIECE]
    found = counts(
        level=[0, 2, 2, 1], pieces=pieces, step=[1, 2, 3.9, 4], resolution=[1, 0.5, 1, 1], error=[0, 0.8, 0.1, 0]
    )
    assert found["dpci"] == 4
    assert {name: n for name, n in found.items() if name.startswith("level_")} == {
        "level_0": 1,
        "level_1": 1,
        "level_2": 2,
    }
    assert {name: n for name, n in found.items() if name.startswith("step_")} == {"step_1": 1, "step_2": 2, "step_4": 1}
    cases = {"case_side": 1, "case_side_and_top": 2, "case_side_and_bottom": 1}
    assert {name: n for name, n in found.items() if name.startswith("case_")} == cases
    assert (found["tile_resolution"], found["tile_error"]) == (0.5, 0.8)
