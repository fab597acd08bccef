"""How far an object reaches in any direction, from how far it does in some."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from depthwalk.geometry.support_function import DIRECTIONS, box_support_values, support, support_values
from depthwalk.types import Array

clouds = arrays(np.float64, (20, 3), elements=st.floats(-3, 3, width=16))
angles = st.floats(-7, 7)


@given(clouds, angles)
def test_nothing_reaches_beyond_the_bound(points: Array, angle: float) -> None:
    way = np.array([np.cos(angle), np.sin(angle)])
    assert support(support_values(points)[None], way[None])[0] >= (points[:, [0, 2]] @ way).max() - 1e-12


@given(clouds, angles)
def test_the_bound_is_nearly_reached(points: Array, angle: float) -> None:
    """It passes the convex hull of the points and the axis by no more than two tangents that meet."""
    way = np.array([np.cos(angle), np.sin(angle)])
    across = np.vstack([points[:, [0, 2]], [[0.0, 0.0]]])
    farthest = np.linalg.norm(across, axis=1).max()
    assert support(support_values(points)[None], way[None])[0] <= (across @ way).max() + farthest * np.tan(
        np.pi / DIRECTIONS
    )


@given(st.floats(0.1, 4), st.floats(0.1, 4), angles)
def test_a_box_is_as_wide_as_its_corners(half_width: float, half_depth: float, angle: float) -> None:
    way = np.array([[np.cos(angle), np.sin(angle)]])
    exact = np.abs(way) @ np.array([half_width, half_depth])
    found = support(box_support_values(np.array([half_width]), np.array([half_depth])), way)
    assert exact <= found + 1e-12 and found <= exact * 1.0049
