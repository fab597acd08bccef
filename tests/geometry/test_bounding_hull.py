"""What encloses an object in few corners: it holds all points, and is little larger."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from depthwalk.geometry.bounding_hull import CORNERS, bounding_hull, box_corners, padded_hull, prism_corners
from depthwalk.types import Array

clouds = arrays(
    np.float64, st.tuples(st.integers(1, 150), st.just(3)), elements=st.floats(-3, 3, width=16, allow_subnormal=False)
)
directions = arrays(np.float64, (3,), elements=st.floats(-1, 1)).filter(lambda way: np.linalg.norm(way) > 0.1)


def reach(points: Array, way: Array) -> float:
    return float((points @ (way / np.linalg.norm(way))).max())


@given(clouds, directions, st.sampled_from([0.0, 0.3]))
def test_nothing_reaches_beyond_the_hull(points: Array, way: Array, margin: float) -> None:
    """Flat, straight and single points, too."""
    assert reach(bounding_hull(points, margin), way) >= reach(points, way) + margin - 1e-12


@given(clouds, directions)
def test_the_hull_of_few_points_is_exact(points: Array, way: Array) -> None:
    points = points[:30] + 0.5 * box_corners(np.ones((1, 3)))[0, :1]
    cube = np.concatenate([points, 4 * box_corners(np.ones((1, 3)))[0]])
    assert reach(bounding_hull(cube), way) <= 1.002 * reach(cube, way)


@pytest.mark.parametrize("thickness", [1.0, 0.01])
def test_the_hull_of_a_ball_or_disc_is_little_larger(thickness: float) -> None:
    rng = np.random.default_rng(4)
    ball = rng.normal(size=(20000, 3))
    ball *= [1, thickness, 1] / np.linalg.norm(ball, axis=1, keepdims=True)
    ball += [5, -2, 1]
    hull = bounding_hull(ball)
    assert hull.shape == (CORNERS, 3)
    for way in rng.normal(size=(100, 3)):
        wide = reach(hull, way) + reach(hull, -way)
        assert wide <= 1.06 * (reach(ball, way) + reach(ball, -way))


@given(arrays(np.float64, (20, 2), elements=st.floats(-2, 2)), st.floats(-7, 7))
def test_a_prism_holds_what_its_extents_were_measured_of(points: Array, angle: float) -> None:
    step = 2 * np.pi / 32 * np.arange(32)
    extents = (points @ np.stack([np.cos(step), np.sin(step)])).max(0)
    prism = prism_corners(extents, -1.0, 2.0)
    assert prism.shape == (64, 3) and set(prism[:, 1]) == {-1.0, 2.0}
    way = np.array([np.cos(angle), np.sin(angle)])
    assert reach(points, way) - 1e-9 <= reach(prism[:, [0, 2]], way)
    assert reach(prism[:, [0, 2]], way) <= reach(points, way) + np.abs(points).max() * np.tan(np.pi / 32) * 1.5


def test_a_box_has_its_corners() -> None:
    (corners,) = box_corners(np.array([[1.0, 2.0, 3.0]]))
    assert {tuple(abs(corner)) for corner in corners} == {(1.0, 2.0, 3.0)} and len(np.unique(corners, axis=0)) == 8


@pytest.mark.parametrize("shape", [(0, 3), (CORNERS + 1, 3), (4, 2), (4,)])
def test_hulls_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="1 to 128 corners"):
        padded_hull(np.zeros(shape))
    with pytest.raises(ValueError, match="1 to 128 corners"):
        padded_hull(np.full((4, 3), np.nan))
