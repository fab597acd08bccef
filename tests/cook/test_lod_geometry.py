"""Positions in 16 bits, and runs of triangles across chunks."""

from collections.abc import Sequence

import numpy as np
import pytest

from depthwalk.cook.cases import ALL_PIECES, PIECES, RANGES
from depthwalk.cook.lod_geometry import POSITION_STEPS, LodGeometry, vertex_positions

LOW, SIZE = np.array([-1, 0, 2], np.float32), np.array([2, 4, 1], np.float32)


@pytest.fixture
def geometry() -> LodGeometry:
    """Two triangles in piece 0 of level 0, one of them in a second chunk; one in piece 3 of level 1."""
    first, count = np.zeros((2, RANGES), int), np.zeros((2, RANGES), int)
    first[0, 1:], first[1], first[1, 4:] = 6, 6, 9
    count[0, 0], count[1, 3] = 6, 3
    return LodGeometry(
        vertices=np.arange(24, dtype=np.uint16).reshape(6, 4),
        texels=np.full((6, 2), -1, np.int16),
        indices=np.array([0, 1, 2, 0, 1, 2, 2, 1, 0], np.uint16),
        chunks=np.array([[0, 0], [3, 3]]),
        first=first,
        count=count,
        horizon=np.zeros((2, PIECES, 4)),
        box_low=LOW,
        box_size=SIZE,
        error=np.array([0.0, 0.1]),
    )


def test_positions_span_the_box() -> None:
    ends = np.array([[0, 0, 0, 9], [POSITION_STEPS] * 3 + [9]], np.uint16)
    np.testing.assert_allclose(vertex_positions(ends, LOW, SIZE), [LOW, LOW + SIZE], rtol=1e-6)


def test_triangles_count_from_their_chunks(geometry: LodGeometry) -> None:
    assert geometry.triangles(0, 6).tolist() == [[0, 1, 2], [3, 4, 5]]


@pytest.mark.parametrize(
    ("level", "pieces", "expected"),
    [(0, ALL_PIECES, [[0, 1, 2], [3, 4, 5]]), (1, 1 << 3, [[5, 4, 3]]), (1, 1 << 2, [])],
)
def test_levels_are_drawn_by_pieces(
    geometry: LodGeometry, level: int, pieces: int, expected: Sequence[Sequence[int]]
) -> None:
    assert geometry.drawn(level, pieces).tolist() == expected
