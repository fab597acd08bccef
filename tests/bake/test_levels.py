"""Coarser versions of a mesh; their looks and errors are tested in tests/render/test_mesh_lod.py."""

import numpy as np
import pytest

from depthwalk.bake.levels import mesh_levels
from depthwalk.bake.params import FEWEST, RATIOS
from depthwalk.ingest.mesh import MeshLevel
from shapes import box, simplified, sphere


@pytest.fixture(scope="module")
def levels() -> tuple[MeshLevel, ...]:
    return simplified(sphere(columns=48, rows=24))


def test_levels_thin_out_by_fours_and_say_how_far_off_they_are(
    levels: tuple[MeshLevel, ...],
) -> None:
    count = [len(level.mesh.faces) for level in levels]
    for ratio, found in zip(RATIOS, count[1:], strict=False):
        assert found == pytest.approx(max(count[0] / ratio, FEWEST), rel=0.2)
    errors = [level.error for level in levels]
    assert errors[0] == 0 and errors == sorted(errors) and errors[1] > 0


def test_corners_are_about_where_the_mesh_is(levels: tuple[MeshLevel, ...]) -> None:
    for level in levels:
        away = np.abs(np.linalg.norm(level.mesh.positions - np.array([0, 1, 0], np.float32), axis=1) - 1)
        assert away.max() <= max(level.error, 1e-5)


def test_what_is_simple_already_has_no_levels() -> None:
    assert len(mesh_levels(box(1.0, 1.0, 1.0))) == 1
