"""The sphere of views."""

import numpy as np
import pytest

import shapes
from depthwalk.quality.views import CLOSE, CLOSE_BY, FEW, FILL, SPHERE, VERIFY, away, bounding_sphere, view_of


def test_there_are_42_views_spread_evenly_over_the_part_of_the_sphere() -> None:
    assert len(SPHERE) == len(set(SPHERE)) == 42 and len(VERIFY) == 6
    assert {view.elevation for view in SPHERE} == {-50, -22, 5, 33, 60, 88}
    assert set(FEW) | set(VERIFY) <= set(SPHERE)
    directions = np.stack([away(view) for view in SPHERE])
    cosines = directions @ directions.T - 2 * np.eye(len(SPHERE))
    nearest = np.degrees(np.arccos(cosines.max(1)))
    assert nearest.min() > 24 and nearest.max() < 37


@pytest.mark.parametrize("size", [(1024, 768), (300, 600)])
def test_the_bounding_sphere_fills_nine_tenths_of_the_frame(size: tuple[int, int]) -> None:
    sphere = bounding_sphere(shapes.box(2, 4, 1, centre=(5, 0, -3)))
    assert sphere.centre == pytest.approx((5, 0, -3)) and sphere.radius == pytest.approx(21**0.5 / 2)
    for viewpoint in (SPHERE[0], SPHERE[41]):
        view = view_of(sphere, viewpoint, size)
        distance = np.linalg.norm(view.position - sphere.centre)
        outline = view.focal_pixels * np.tan(np.arcsin(sphere.radius / distance))
        assert 2 * outline == pytest.approx(FILL * min(size))
        near, far = view.depth_range
        assert near < distance - sphere.radius and far > distance + sphere.radius
    close = view_of(sphere, CLOSE_BY[0], size)
    assert np.linalg.norm(close.position - sphere.centre) == pytest.approx(CLOSE * sphere.radius)


def test_azimuth_turns_from_z_to_x() -> None:
    level = [view for view in SPHERE if view.elevation == 5]
    view = view_of(bounding_sphere(shapes.sphere()), level[0], (64, 64))
    assert view.position[0] == pytest.approx(0, abs=1e-9) and view.position[2] > 0
    assert away(level[1])[0] > 0
