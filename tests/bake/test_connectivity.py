"""Connecting samples takes bounded memory, and batches do not show in the result."""

import tracemalloc
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from depthwalk.bake import connectivity
from depthwalk.bake.baker import cast_face
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.grid import layer_triangles
from depthwalk.bake.images import DepthImage, Face, enclosing_cylinder
from depthwalk.bake.params import BakeParams
from depthwalk.bake.raycast import RayCaster
from depthwalk.types import Array
from shapes import box, joined


def samples(size: int, layers: int, face: Face) -> tuple[RayCaster, FaceGrid, Array]:
    """Caster, grid of the face and depths (L, size, size) of a post before a plate."""
    mesh = joined(box(0.3, 1.0, 0.3, (0, 0.5, 0.8)), box(1.8, 1.0, 0.4, (0, 0.5, -0.5)))
    caster, cylinder = RayCaster(mesh), enclosing_cylinder(mesh.positions)
    grid = FaceGrid(cylinder=cylinder, face=face, height=size, width=size)
    return caster, grid, cast_face(mesh, caster, grid, BakeParams(resolution=size, layers=layers)).samples.depth


@pytest.mark.parametrize("face", Face)
def test_batches_do_not_show(face: Face, monkeypatch: pytest.MonkeyPatch) -> None:
    given = samples(32, 3, face)
    whole = connectivity.connect(*given, 3)
    monkeypatch.setattr(connectivity, "_BATCH", 37)  # divides no grid
    parts = connectivity.connect(*given, 3)
    assert sum(np.count_nonzero(codes) for layer in whole for codes in layer) > 100
    for one, other in zip(whole, parts, strict=True):
        for whole_codes, part_codes in zip(one, other, strict=True):
            assert whole_codes.dtype == part_codes.dtype == np.uint16
            np.testing.assert_array_equal(whole_codes, part_codes)


@pytest.mark.parametrize(("width", "height", "spacing", "bar"), [(256, 11, 0.08, 0.024), (320, 14, 0.06, 0.02)])
def test_the_gaps_of_a_fence_stay_open(width: int, height: int, spacing: float, bar: float) -> None:
    """On the side, neighbouring texels near the axis show bars far apart; all points of a triangle are near to bars."""
    mesh = joined(*(box(bar, 0.4, bar, (x, 0.2, 0)) for x in np.arange(-1.5, 1.51, spacing)))
    caster, cylinder = RayCaster(mesh), enclosing_cylinder(mesh.positions)
    grid = FaceGrid(cylinder=cylinder, face=Face.SIDE, height=height, width=width)
    depths = cast_face(mesh, caster, grid, BakeParams(resolution=width, layers=3)).samples.depth
    points = np.concatenate([grid.points(depth).reshape(-1, 3) for depth in depths])
    across = []
    for layer, cells in enumerate(connectivity.connect(caster, grid, depths, 1)):
        image = SimpleNamespace(face=Face.SIDE, layer=layer, depth=depths[layer], cells=cells)
        layers, texels = layer_triangles(cast(DepthImage, image), 0)
        across.append(np.ptp(points[layers * depths[layer].size + texels, 0], axis=1))
    assert sum(map(len, across)) > 3000
    assert np.concatenate(across).max() < spacing - bar


@pytest.mark.slow
def test_memory_hardly_grows_with_the_image() -> None:
    """512² × 3: all at once took 170 MB; the grid's own corners, 32 bytes a cell, and the result stay."""
    given = samples(512, 3, Face.SIDE)
    tracemalloc.start()
    try:
        connectivity.connect(*given, 1)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 60e6
