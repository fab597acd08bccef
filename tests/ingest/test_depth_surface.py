"""What a depth image alone tells of its surface."""

import numpy as np
import pytest

from depthwalk.ingest.depth_surface import STEEP, continues, fit_planes, noise, tolerance

J, I = np.mgrid[0:24, 0:32].astype(float)  # noqa: E741  # rows and columns


def test_noise_of_a_slope_is_nothing() -> None:
    assert noise(0.3 * I + 0.2 * J) == pytest.approx(0, abs=1e-12)


def test_noise_is_measured_across_an_edge() -> None:
    rng = np.random.default_rng(1)
    values = np.where(I < 16, 0.0, 50.0) + rng.normal(0, 0.1, I.shape)
    assert noise(values) == pytest.approx(0.1, rel=0.15)


def test_noise_of_nothing() -> None:
    assert noise(np.full((4, 4), np.inf)) == 0


def test_tolerance_is_a_steep_slope_where_there_is_no_noise() -> None:
    assert (tolerance(0.01 * I, 0.5) == STEEP * 0.5).all()


def test_tolerance_of_a_file_that_counts_coarsely() -> None:
    steps = np.repeat(np.arange(40.0), 3)[None].repeat(4, axis=0)  # many depths, one unit apart
    assert (tolerance(steps, 0.01) == 2).all()
    assert tolerance(np.where(I < 16, 0.0, 1.0), 0.01).max() < 0.1  # two depths are two surfaces


@pytest.mark.parametrize("axis", [0, 1])
def test_an_edge_is_a_tear_and_a_slope_is_none(axis: int) -> None:
    across = J if axis == 0 else I
    allowed = np.ones(I.shape)
    edge = continues(np.where(across < 10, 0.0, 9.0), allowed, axis)
    assert edge.shape == ((23, 32) if axis == 0 else (24, 31))
    assert (edge.all(1 - axis) == (np.arange(len(edge) if axis == 0 else edge.shape[1]) != 9)).all()
    assert continues(5 * across, allowed, axis).all()  # steep, but three alike in a row


def test_planes_are_exact_and_stop_at_an_edge() -> None:
    plane = 2 + 0.3 * I - 0.2 * J
    a, b, c = fit_planes(np.where(I < 16, plane, plane + 100), 0.3)
    for fitted, exact in ((b, 0.3), (c, -0.2)):
        np.testing.assert_allclose(fitted, exact, atol=1e-3)
    np.testing.assert_allclose(a[:, :16], plane[:, :16], atol=1e-2)


def test_no_plane_where_there_is_no_surface() -> None:
    values = 0.1 * I
    values[5, 7] = np.inf
    a, b, c = fit_planes(values, 0.1)
    assert np.isnan([a[5, 7], b[5, 7], c[5, 7]]).all() and np.isfinite(np.delete(a.ravel(), 5 * 32 + 7)).all()
