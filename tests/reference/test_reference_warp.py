"""The warp equation in a plane before which all is simple: z = 0, seen from z = D."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

from depthwalk.reference.warp import table, unwarp, warp
from depthwalk.render.impostors.warp_planes import NO_DIAGONALS, Planes


def plane_before(viewer: ArrayLike) -> Planes:
    """The plane z = 0 as a viewer (3,) before it has it."""
    x, y, distance = np.atleast_2d(np.asarray(viewer, float)).T
    one = np.ones((1, 1))
    return Planes(
        face=np.zeros(1, int),
        right=one * [1.0, 0, 0],
        up=one * [0.0, 1, 0],
        normal=one * [0.0, 0, 1],
        distance=distance,
        epipole=np.stack([x, y], -1),
        offset=np.zeros(1),
        low=one * [-1.0, -1],
        high=one * [1.0, 1],
        diagonals=one * NO_DIAGONALS,
    )


def test_table_is_the_part_of_the_way_to_the_epipole() -> None:
    assert table(np.array([0.0, 1.0, 3.0, 1e12]), 3.0) == pytest.approx([0, 0.25, 0.5, 1])


def test_a_point_on_the_plane_stays_and_one_behind_moves_to_the_epipole() -> None:
    planes = plane_before([0.5, 1.0, 4.0])
    on_plane, lam = warp(np.array([[2.0, 3.0, 0.0]]), planes)
    assert on_plane + planes.epipole == pytest.approx(np.array([[2.0, 3.0]])) and lam == pytest.approx([1.0])
    behind, lam = warp(np.array([[2.0, 3.0, -4.0]]), planes)
    assert behind == pytest.approx(on_plane / 2) and lam == pytest.approx([0.5])


def test_a_warped_point_is_where_the_ray_to_it_meets_the_plane() -> None:
    viewer, point = np.array([0.5, -1.0, 2.0]), np.array([3.0, 0.7, -1.3])
    planes = plane_before(viewer)
    position, _ = warp(point[None], planes)
    t = viewer[2] / (viewer[2] - point[2])
    assert position[0] + viewer[:2] == pytest.approx((viewer + t * (point - viewer))[:2])


def test_unwarp_undoes_warp() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        viewer = rng.uniform(-2, 2, 3) + np.array([0, 0, 3])
        point = rng.uniform(-1, 1, (1, 3)) - [0, 0, 1]
        planes = plane_before(viewer)
        assert unwarp(*warp(point, planes), viewer, planes) == pytest.approx(point)
