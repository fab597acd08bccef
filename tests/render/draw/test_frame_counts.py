"""What HUD and benchmark are told of the tiles of a frame."""

from collections.abc import Sequence

import numpy as np

from depthwalk.cook.cases import ALL_PIECES, BOTTOM_PIECE, TOP_PIECE
from depthwalk.render.draw.frame_counts import Counts, DrawnTiles


def counts(
    level: Sequence[int] = (),
    pieces: Sequence[int] = (),
    step: Sequence[float] = (),
    resolution: Sequence[float] = (),
    error: Sequence[float] = (),
) -> Counts:
    return DrawnTiles(
        level=np.array(level, int),
        pieces=np.array(pieces, int),
        resolution=np.array(resolution, float),
        error=np.array(error, float),
        step=np.array(step, float),
        members=np.ones(len(level), int),
    ).counts()


def test_no_tiles_have_no_levels() -> None:
    assert counts() == {"tile_resolution": 1, "tile_error": 0}


def test_levels_steps_and_cases_have_a_number_each() -> None:
    side = ALL_PIECES & ~(1 << TOP_PIECE | 1 << BOTTOM_PIECE)
    pieces = [side, side | 1 << TOP_PIECE, side | 1 << TOP_PIECE, side | 1 << BOTTOM_PIECE]
    found = counts(
        level=[0, 2, 2, 1], pieces=pieces, step=[1, 2, 3.9, 4], resolution=[1, 0.5, 1, 1], error=[0, 0.8, 0.1, 0]
    )
    assert {name: n for name, n in found.items() if name.startswith("level_")} == {
        "level_0": 1,
        "level_1": 1,
        "level_2": 2,
    }
    assert {name: n for name, n in found.items() if name.startswith("step_")} == {"step_1": 1, "step_2": 2, "step_4": 1}
    cases = {"case_side": 1, "case_side_and_top": 2, "case_side_and_bottom": 1}
    assert {name: n for name, n in found.items() if name.startswith("case_")} == cases
    assert (found["tile_resolution"], found["tile_error"]) == (0.5, 0.8)
