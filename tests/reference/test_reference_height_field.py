"""Rays meet height fields where arithmetic says, from in front only, and few steps miss what is thin."""

import numpy as np
import pytest

from depthwalk.reference.height_field import box_interval, first_hits, surface_depth
from depthwalk.render.resources.relative_depth import EMPTY


def rays(count: int = 200) -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.column_stack([rng.uniform(-0.5, 0.5, (count, 2)), np.ones(count)])


def test_depth_is_linear_between_the_middles_of_texels() -> None:
    depth = np.array([[0.0, 1.0], [0.5, 0.5]])
    at = np.array([[0.25, 0.25], [0.75, 0.25], [0.5, 0.25], [0.5, 0.5], [0.0, 0.25]])
    np.testing.assert_allclose(surface_depth(depth, at), [0, 1, 0.5, 0.5, 0])


def test_a_plane_is_met_where_it_is() -> None:
    """Sloped: depth = 0.2 + 0.5 u, a ray (0.5, 0.5, −1) + t·d meets it where −1 + t = 0.2 + 0.5·(0.5 + t·d_u)."""
    size = 64
    u = (np.arange(size) + 0.5) / size
    depth = np.broadcast_to(0.2 + 0.5 * u, (size, size))
    direction = rays()
    found = first_hits(depth, np.array([0.5, 0.5, -1.0]), direction, 16, 30)
    expected = 1.45 / (1 - 0.5 * direction[:, 0])
    at = 0.5 + expected[:, None] * direction[:, :2]
    inside = (np.abs(at - 0.5) < 0.5 - 0.5 / size).all(1)
    assert inside.sum() > 50 and (~inside).sum() > 20
    np.testing.assert_allclose(found[inside], expected[inside], atol=1e-8)
    assert np.isnan(found[~inside]).all()


def test_rays_enter_by_the_front_or_a_side() -> None:
    enters, leaves = box_interval((10, 10), np.array([-0.45, 0.5, -1.0]), np.array([[0.5, 0, 1.0], [1.0, 0, 0.1]]))
    np.testing.assert_allclose([enters[0], leaves[0]], [1.0, 2.0])
    assert leaves[1] < enters[1]  # past the box


@pytest.mark.parametrize(("steps", "hits"), [(4, False), (2000, True)])
def test_few_steps_miss_what_is_thin(steps: int, hits: bool) -> None:
    depth = np.full((50, 50), 1.0)
    depth[:, 20] = 0.0
    viewer, direction = np.array([-0.5, 0.5, -1.0]), np.array([[0.81, 0.0, 1.2]])
    found = first_hits(depth, viewer, direction, steps, 20)
    back = np.isclose(viewer[2] + found * direction[:, 2], 1.0, atol=1e-3)
    assert back[0] != hits


def test_the_edge_of_a_surface_is_no_wall() -> None:
    depth = np.full((50, 50), EMPTY)
    depth[:, 25:] = 0.5
    viewer = np.array([-1.0, 0.5, -0.5])
    under, over = np.array([[1.5, 0, 1.2]]), np.array([[1.7, 0, 1.0]])
    assert np.isnan(first_hits(depth, viewer, under, 400, 20))
    assert np.isfinite(first_hits(depth, viewer, over, 400, 20))
