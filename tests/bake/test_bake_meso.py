"""Relief that is laid over an object's images."""

import numpy as np
import pytest

from depthwalk.bake.meso import Meso, straight_share, tiling_slopes


@pytest.mark.parametrize("radius, tiles", [(0.5, 8), (0.001, 1)])
def test_whole_tiles_go_round(radius: float, tiles: int) -> None:
    meso = Meso(relief=np.zeros((4, 4, 3), np.float32), tile=(0.4, 0.3), height=0.01)
    assert meso.tiles_per_turn(radius) == tiles


def test_slopes_go_on_across_the_edge() -> None:
    size, tile = 256, (0.5, 0.8)
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * 2 * np.pi
    slopes = tiling_slopes(0.01 * np.sin(x) + 0.02 * np.sin(y), tile)
    expected = np.stack([0.01 * np.cos(x) * 2 * np.pi / tile[0], 0.02 * np.cos(y) * 2 * np.pi / tile[1]], -1)
    assert slopes.dtype == np.float32
    np.testing.assert_allclose(slopes, expected, atol=1e-3 * np.abs(expected).max())


def test_relief_is_straight_where_surfaces_face_outward_and_winds_elsewhere() -> None:
    up, aside, slant = (0, 1.0, 0), (1.0, 0, 0), (0.5**0.5, 0.5**0.5, 0)
    share = straight_share(np.array([up, aside, slant]), np.array(up), np.array(aside))
    assert share[0] == 1 and share[1] == 0 and 0 <= share[2] < 0.1
