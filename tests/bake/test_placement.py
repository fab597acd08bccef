"""Where a cylinder stands in its asset; directions and circles are tested in test_axis.py."""

import numpy as np
import pytest

from depthwalk.bake.placement import cylinder_around, extent, place_along
from depthwalk.types import Array
from shapes import box

AXIS = (1.0, 2.0, -0.5)


@pytest.fixture
def points() -> Array:
    return np.random.default_rng(3).normal(size=(50, 3)) * (1, 3, 0.5) + (4, 5, 6)


def test_into_the_object_and_back(points: Array) -> None:
    placement = place_along(AXIS, points)
    np.testing.assert_allclose(placement.into_asset(placement.into_object(points)), points, rtol=1e-5)


def test_the_axis_is_up_in_the_object(points: Array) -> None:
    turned = place_along(AXIS, points).turned_into_object(np.array([AXIS]))
    np.testing.assert_allclose(turned, [[0.0, float(np.linalg.norm(AXIS)), 0.0]], atol=1e-12)


def test_the_cylinder_holds_the_points_where_it_is_placed(points: Array) -> None:
    placement = place_along(AXIS, points)
    cylinder, inside = cylinder_around(placement, points), placement.into_object(points)
    assert (np.hypot(inside[:, 0], inside[:, 2]) < cylinder.radius).all()
    assert (cylinder.bottom < inside[:, 1]).all() and (inside[:, 1] < cylinder.top).all()


def test_a_placed_mesh_keeps_its_shape() -> None:
    mesh = box(1.0, 2.0, 3.0, (4, 5, 6))
    placed = place_along(AXIS, mesh.positions).placed(mesh)
    before, after = (np.linalg.norm(np.diff(each.positions[each.faces], axis=1), axis=2) for each in (mesh, placed))
    np.testing.assert_allclose(before, after, rtol=1e-5)
    assert placed.positions.dtype == placed.normals.dtype == np.float32


def test_the_extent_is_the_larger_side() -> None:
    flat, high = (box(1.0, height, 1.0).positions for height in (0.1, 9.0))
    for points, side in ((flat, 2**0.5), (high, 9.0)):
        assert extent(cylinder_around(place_along((0, 1, 0), points), points)) == pytest.approx(side, rel=1e-3)
