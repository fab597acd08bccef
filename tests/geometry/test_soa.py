"""Structures of arrays: rows are selected, joined and overwritten in all columns."""

from dataclasses import dataclass

import numpy as np
import pytest

from depthwalk.geometry.soa import StructOfArrays
from depthwalk.types import Mask, Rows


@dataclass(frozen=True)
class Balls(StructOfArrays):
    centre: np.ndarray
    radius: np.ndarray


@pytest.fixture
def balls() -> Balls:
    return Balls(np.arange(12.0).reshape(4, 3), np.arange(4.0))


@pytest.mark.parametrize("rows", [np.array([3, 1]), np.array([False, True, False, True]), slice(1, 3)])
def test_rows_are_taken_from_every_column(balls: Balls, rows: Mask | Rows) -> None:
    taken = balls.take(rows)
    np.testing.assert_array_equal(taken.centre, balls.centre[rows])
    np.testing.assert_array_equal(taken.radius, balls.radius[rows])


def test_a_slice_shares_its_memory(balls: Balls) -> None:
    assert np.shares_memory(balls.take(slice(1, 3)).centre, balls.centre)


def test_parts_are_joined_in_their_order(balls: Balls) -> None:
    joined = Balls.joined([balls.take(slice(2, 4)), balls.take(slice(0, 2))])
    assert joined.radius.tolist() == [2, 3, 0, 1] and joined.centre[0].tolist() == [6, 7, 8]


def test_rows_are_overwritten_in_every_column(balls: Balls) -> None:
    balls.put(np.array([0]), balls.take(np.array([3])))
    assert balls.radius.tolist() == [3, 1, 2, 3] and balls.centre[0].tolist() == [9, 10, 11]
