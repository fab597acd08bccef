"""Areas that a line cuts off pixels, in cases that can be computed by hand."""

import numpy as np
import pytest

from depthwalk.reference.smaa import areas_cut
from depthwalk.types import Array


def cut(before: int, after: int, *heights: float) -> Array:
    """Of one pixel: above and below."""
    return areas_cut(np.array([float(before)]), np.array([float(after)]), np.array([heights]))[0]


def test_a_lone_pixel_loses_a_triangle_at_each_end() -> None:
    """The line from ½ above to ½ below crosses the edge in the pixel's middle."""
    assert cut(0, 0, 0.5, -0.5) == pytest.approx([1 / 8, 1 / 8])
    assert cut(0, 0, 0.5, 0.5) == pytest.approx([1 / 4, 0])
    assert cut(0, 0, 0, 0) == pytest.approx([0, 0])


def test_the_pixels_of_an_edge_share_its_two_wedges() -> None:
    """Each half of an edge of length n has a triangle of height ½ and base n/2."""
    for length in (2, 5, 8):
        pixels = np.arange(length, dtype=float)
        areas = areas_cut(pixels, length - 1 - pixels, np.tile([0.5, -0.5], (length, 1)))
        assert areas.sum(0) == pytest.approx([length / 8, length / 8])
        assert areas[::-1, ::-1] == pytest.approx(areas)  # seen from the other end, above is below
        assert (np.diff(areas[:, 0]) <= 0).all()
