"""Which parts a mesh is split into; what parts hold is tested in test_parts.py."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthwalk.bake.division import Cell, divide, part_faces
from depthwalk.bake.params import BakeParams
from depthwalk.bake.raycast import RayCaster
from shapes import box, joined, sphere

PARAMS = BakeParams(resolution=32, layers=1)


@given(st.integers(0, 2**32 - 1))
def test_a_cut_leaves_each_point_on_one_side(seed: int) -> None:
    random = np.random.default_rng(seed)
    normal = random.normal(size=3)
    plane = np.append(normal / np.linalg.norm(normal), random.normal())
    points = random.normal(size=(100, 3))
    below, above = Cell().cut(plane)
    assert (below.holds(points) ^ above.holds(points)).all()
    np.testing.assert_allclose(below.beyond(points)[:, 0], points @ plane[:3] - plane[3])
    np.testing.assert_allclose(above.beyond(points), -below.beyond(points))


def test_all_of_space_holds_everything() -> None:
    assert Cell().holds(np.random.default_rng(0).normal(size=(9, 3))).all()


def test_a_margin_takes_in_faces_beyond_the_plane() -> None:
    mesh = joined(box(1.0, 1.0, 1.0, (-2, 0, 0)), box(1.0, 1.0, 1.0, (2, 0, 0)))
    left, _ = Cell().cut(np.array([1.0, 0, 0, 0]))
    counts = [int(part_faces(mesh, left, margin).sum()) for margin in (0.0, 1.6, 2.6)]
    assert counts[0] == 12 < counts[1] < counts[2] == 24


def test_a_ball_stays_whole() -> None:
    mesh = sphere(columns=32, rows=16)
    (cell,) = divide(mesh, RayCaster(mesh), PARAMS, 2 / 32, None)
    assert len(cell.planes) == 0


@pytest.mark.slow
@pytest.mark.parametrize("most", [1, 2])
def test_there_are_as_many_parts_as_asked_for_where_they_are_of_use(most: int) -> None:
    balls = [sphere(radius=0.3, columns=24, rows=12) for _ in range(6)]
    for number, ball in enumerate(balls):
        ball.positions[:] += np.array((1.5 * np.cos(number), 0.4 * (number % 3), 1.5 * np.sin(number)), np.float32)
    mesh = joined(*balls)
    cells = divide(mesh, RayCaster(mesh), PARAMS, 3.6 / 32, most)
    assert len(cells) == most
    inside = np.sum([cell.holds(mesh.positions) for cell in cells], axis=0)
    assert (inside == 1).all()  # every point is in one part
