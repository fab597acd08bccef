"""Triangles as a file has them."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.soup import check_triangle_count, unit_normals
from depthwalk.limits import MAX_MESH_TRIANGLES


def test_normals_have_unit_length_or_are_missing() -> None:
    normals = unit_normals(np.array([[0, 3, 4], [0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 0], [1e-9, 0, 0]], float))
    np.testing.assert_allclose(normals[0], (0, 0.6, 0.8))
    assert np.isnan(normals[1:]).all()


@pytest.mark.parametrize(
    ("count", "defect"), [(0, "no faces; lines alone are not"), (MAX_MESH_TRIANGLES + 1, "too large")]
)
def test_too_few_and_too_many_triangles(count: int, defect: str) -> None:
    with pytest.raises(InputError, match=f"^a.obj: {defect}"):
        check_triangle_count(count, Path("a.obj"))
    check_triangle_count(1, Path("a.obj"))
