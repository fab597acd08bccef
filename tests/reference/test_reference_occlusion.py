"""The farthest depth of cells."""

import numpy as np

from depthwalk.reference.occlusion import farthest_cells


def test_each_cell_has_the_farthest_of_its_pixels() -> None:
    depth = np.arange(24, dtype=np.float32).reshape(4, 6)
    np.testing.assert_array_equal(farthest_cells(depth, 2), [[7, 9, 11], [19, 21, 23]])


def test_cells_that_are_cut_off_have_what_is_left() -> None:
    depth = np.array([[0.1, 0.2, 0.9], [0.4, 0.3, 0.5], [0.7, 0.6, 0.8]], np.float32)
    np.testing.assert_array_equal(farthest_cells(depth, 2), np.array([[0.4, 0.9], [0.7, 0.8]], np.float32))
    np.testing.assert_array_equal(farthest_cells(depth, 1), depth)
