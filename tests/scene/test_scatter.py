"""Where the objects of grids and scatters stand."""

import math

import numpy as np
import pytest

from depthwalk.scene.scatter import grid_instances, room_for, scatter_instances


def test_a_grid_is_centred_and_x_runs_fastest() -> None:
    grid = grid_instances((3, 2), (1.0, 4.0), 0.5)
    assert grid.position.tolist() == [[-1, 0, -2], [0, 0, -2], [1, 0, -2], [-1, 0, 2], [0, 0, 2], [1, 0, 2]]
    assert (grid.scale == 0.5).all() and (grid.rotation == [0, 0, 0, 1]).all()


@pytest.mark.parametrize("spacing", [0.0, 0.4])
def test_a_scatter_keeps_to_its_area_spacing_and_seed(spacing: float) -> None:
    placed, again, other = (scatter_instances(200, (10.0, 6.0), spacing, (0.5, 2.0), seed) for seed in (1, 1, 2))
    assert len(placed) == 200
    assert (np.abs(placed.position) <= (5, 0, 3)).all()
    assert (
        (placed.scale >= 0.5).all()
        and (placed.scale <= 2).all()
        and not placed.rotation[:, [0, 2]].any()
        and np.ptp(placed.rotation[:, 1]) > 0.9
    )
    apart = np.linalg.norm(placed.position[:, None] - placed.position, axis=2)[~np.eye(200, dtype=bool)]
    assert apart.min() >= spacing - 1e-5
    assert (placed.position == again.position).all() and (placed.position != other.position).any()


def test_a_full_area_gives_what_found_room() -> None:
    placed = scatter_instances(50, (2.0, 2.0), 1.0, (1.0, 1.0), 0)
    assert 2 <= len(placed) < 50 and len(placed) <= room_for((2.0, 2.0), 1.0)


def test_room_is_endless_without_spacing() -> None:
    assert room_for((1.0, 1.0), 0) == math.inf
    assert room_for((1e-3, 1e-3), 1.0) >= 1
