"""Where objects stand, relative to who looks at them."""

import numpy as np
import pytest

from depthwalk.render.resources.placed_records import placed_records
from shapes import scene_of


def test_records_are_relative_to_the_viewer() -> None:
    objects = scene_of((0, (1, 2, 3), 0.5, 2.0), (0, (-1, 0, 7), 0.0, 0.25)).objects
    records = placed_records(np.array([1.0, 1.0, 1.0]), objects)
    assert records["origin"] == pytest.approx(np.array([[0, 1, 2], [-2, -1, 6]]))
    np.testing.assert_array_equal(records["rotation"], objects.rotation)
    np.testing.assert_array_equal(records["scale"], [2.0, 0.25])


def test_no_objects_are_no_records() -> None:
    objects = scene_of((0, (1, 2, 3), 0.5, 2.0)).objects
    assert len(placed_records(np.zeros(3), objects.take(np.zeros(0, int)))) == 0
