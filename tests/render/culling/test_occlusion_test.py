"""Objects hidden behind others: the bounds that are tested, and the test itself."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthwalk.render.culling.occlusion_test import DepthRangeMaximum, ScreenExtents, screen_extents
from depthwalk.render.view.bounds import Cylinders
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera

SIZE = (160, 120)


@pytest.mark.parametrize("shear", [(0.0, 0.0), (0.6, -0.4)])
def test_outlines_hold_all_points(shear: tuple[float, float]) -> None:
    """Of random cylinders, some of them partly behind the viewer; and they are not much larger than they must be."""
    rng = np.random.default_rng(3)
    count, points = 3000, 100
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    view = View(Camera((1.0, 2.0, 3.0), (0.0, 1.0, -4.0), 1.1), SIZE, 0.05, 100.0, shear)
    centre = view.position + rng.uniform(-1, 1, (count, 3)) * 6 + 6 * view.axes[2]
    held = Cylinders(centre, axis, rng.uniform(0.01, 1.5, count), rng.uniform(0.01, 1.5, count))
    found = screen_extents(view, held, 0.0)

    one = np.cross(axis, np.eye(3)[np.abs(axis).argmin(1)])
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    two = np.cross(axis, one)
    angle, end = rng.uniform(0, 2 * np.pi, (points, count)), rng.choice([-1, 1], (points, count))
    across = np.cos(angle)[..., None] * one + np.sin(angle)[..., None] * two
    surface = centre + held.radius[:, None] * across + (held.half_height * end)[..., None] * axis
    x, y, z = np.moveaxis((surface - view.position) @ view.axes.T, -1, 0)
    pixel = np.stack([(s / z / t + 1) * n / 2 for s, t, n in zip((x, y), view.half_extent, SIZE, strict=True)], -1)
    depth = 100.0 / (100.0 - 0.05) * (1 - 0.05 / z)
    whole = found.depth > 0
    assert 500 < whole.sum() < count
    assert (z.min(0)[~whole] < 0.06).mean() > 0.9
    pixel, depth = pixel[:, whole], depth[:, whole]
    low, high = found.low[whole], found.high[whole]
    assert (pixel.min(0) >= low - 1e-3 * (high - low) - 1e-2).all()
    assert (pixel.max(0) <= high + 1e-3 * (high - low) + 1e-2).all()
    assert (depth.min(0) >= found.depth[whole] - 1e-6).all()
    far = z.min(0)[whole] > 6
    tight = (np.ptp(pixel, axis=0) / (high - low))[far]
    assert far.sum() > 300 and np.median(tight) > 0.7


@pytest.mark.slow
@given(st.integers(0, 2**32), st.sampled_from([(37, 53), (8, 300), (90, 5), (1, 1)]), st.integers(1, 3))
def test_hidden_means_nearer_everywhere(seed: int, shape: tuple[int, int], side: int) -> None:
    rng = np.random.default_rng(seed)
    farthest = np.where(rng.random(shape) < 0.02, 1.0, 0.5).astype(np.float32)
    height, width = (side * length for length in shape)
    low = rng.uniform(-10, 1.1, (400, 2)) * 0.1 + rng.random((400, 2)) * (width, height)
    high = low + rng.random((400, 1)) ** 3 * (width, height) * rng.uniform(0.5, 1, (400, 2))
    depth = rng.choice([0.4, 0.5, 0.6], 400)
    windows, small = DepthRangeMaximum(farthest, side), np.flatnonzero((high - low).max(1) < 4 * side)
    found = windows.hides(ScreenExtents(low[small], high[small], depth[small]))
    np.testing.assert_array_equal(
        found, windows.hides(ScreenExtents(low, high, depth))[small]
    )  # knows larger ones by now
    found = windows.hides(ScreenExtents(low, high, depth))
    for k in range(400):
        cells = farthest[
            int(np.clip(low[k, 1] // side, 0, shape[0] - 1)) : int(np.clip(high[k, 1] // side, 0, shape[0] - 1)) + 1,
            int(np.clip(low[k, 0] // side, 0, shape[1] - 1)) : int(np.clip(high[k, 0] // side, 0, shape[1] - 1)) + 1,
        ]
        behind = depth[k] > cells.max()
        assert behind or not found[k]
        if max(cells.shape) <= 2 * min(cells.shape):  # windows fit
            assert found[k] == behind
