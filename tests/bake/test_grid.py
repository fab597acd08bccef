"""The grids of a depth image, of steps 1, 2, 4 …"""

import numpy as np
import pytest

from depthwalk.bake.face_grid import FaceGrid, texel_centres
from depthwalk.bake.grid import (
    MAX_STEPS,
    cell_triangles,
    grid_cells,
    layer_triangles,
    triangle_corners,
    triangle_places,
    usable_steps,
    whole_cells,
)
from depthwalk.bake.images import Cylinder, Face
from shapes import bake, box


@pytest.mark.parametrize("side, steps", [(8, 1), (16, 2), (64, 4), (512, 7), (4096, MAX_STEPS)])
def test_steps_double_as_long_as_eight_cells_remain(side: int, steps: int) -> None:
    assert usable_steps((side, 2 * side)) == steps


@pytest.mark.parametrize("face", Face)
@pytest.mark.parametrize("step", [1, 2, 4])
def test_cells_cover_every_texel_once(face: Face, step: int) -> None:
    """By area, in texels: the side image wraps."""
    height, width = 16, 24
    i0, j0, i1, j1 = grid_cells((height, width), face, step)
    wide = (i1 - i0) % width
    assert (wide * (j1 - j0)).sum() == (height - 1) * (width if face is Face.SIDE else width - 1)
    assert len(set(zip(i0.tolist(), j0.tolist(), strict=True))) == len(i0)
    assert (i1 == 0).any() == (face is Face.SIDE)


@pytest.mark.parametrize("face", Face)
def test_triangles_are_counter_clockwise_from_outside(face: Face) -> None:
    cylinder = Cylinder(radius=1.0, bottom=0.0, top=2.0, half_width=1.0, half_depth=1.0)
    side = 16
    grid = FaceGrid(cylinder=cylinder, face=face, height=side, width=side)
    columns, rows = cell_triangles(face, *grid_cells((side, side), face, 1))
    depth = np.full(columns.shape, 0.25, np.float32)
    corners = grid.points_at(texel_centres(side)[columns], texel_centres(side)[rows], depth).reshape(-1, 3, 3)
    _, inward = grid.rays_at(texel_centres(side)[columns[..., 0]], texel_centres(side)[rows[..., 0]])
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ni,ni->n", across, inward.reshape(-1, 3)) < 0).all()


@pytest.mark.parametrize("level", [0, 1, 2])
def test_triangles_of_a_layer_are_those_that_its_cells_say(level: int) -> None:
    baked = bake(box(1.0, 0.6, 0.7, (0, 0.3, 0)), 32, 1)
    for image in baked.images:
        half, cell = triangle_places(image, level)
        codes = image.cells[level]
        assert len(half) == (codes & 1).sum() + (codes >> 7 & 1).sum()
        layers, texels = layer_triangles(image, level)
        some = np.arange(len(half))[::3]
        for all_of, few in zip((layers, texels), triangle_corners(image, level, half[some], cell[some]), strict=True):
            np.testing.assert_array_equal(all_of[some], few)
        whole = whole_cells(image, level)
        left, _ = layer_triangles(image, level, without=whole)
        assert len(left) == len(layers) - 2 * whole.sum()
