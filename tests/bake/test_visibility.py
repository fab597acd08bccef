"""Which samples stay, inside a sphere with a hole: from everywhere in it the hole takes up the same part of the
directions, weighted by the cosine, as it does of the sphere's area."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.bake.baker import cast_face
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import Face, enclosing_cylinder
from depthwalk.bake.params import BakeParams
from depthwalk.bake.raycast import RayCaster
from shapes import box, joined, sphere

ROWS = 128


def inside_kept(rows: int) -> float:
    """Part of the samples inside a sphere that stay, as the top cap sees them through its shell; without so many `rows`
    of triangles at the pole."""
    mesh = sphere(rows=ROWS)
    low = mesh.positions[mesh.faces][..., 1].min(1)
    mesh = replace(mesh, faces=mesh.faces[low < 1 + np.cos(np.pi * (rows + 0.5) / ROWS)])
    caster = RayCaster(mesh, two_sided=True)
    grid = FaceGrid(cylinder=enclosing_cylinder(mesh.positions), face=Face.TOP, height=128, width=128)
    depth = cast_face(mesh, caster, grid, BakeParams(resolution=128, layers=1)).samples.depth
    behind = np.isfinite(depth[1]).sum() if len(depth) > 1 else 0
    return behind / (np.isfinite(depth[0]) & (depth[0] < 1)).sum()


@pytest.mark.parametrize("rows", [6, 12])
def test_what_is_seen_through_a_hole_stays_whole(rows: int) -> None:
    """1/185 and 1/47 of the directions. Did rays speak but for what is near, what stays would be full of holes."""
    assert inside_kept(rows) == 1


def test_a_stray_ray_keeps_little() -> None:
    assert 0 < inside_kept(1) < 0.1


def test_nothing_of_the_inside_of_a_closed_shell_stays() -> None:
    assert inside_kept(0) == 0


@pytest.mark.parametrize("layers", [2, 3])
def test_deep_layers_are_those_that_see_the_sky(layers: int) -> None:
    """Under twenty plates a centimetre apart lies a floor that is seen from beside: it is the last layer from above."""
    plates = [box(1, 0.002, 1, (0, 1 + 0.01 * number, 0)) for number in range(20)]
    mesh = joined(box(1, 0.002, 1, (0, 0, 0)), *plates)
    grid = FaceGrid(cylinder=enclosing_cylinder(mesh.positions), face=Face.TOP, height=32, width=32)
    depth = cast_face(mesh, RayCaster(mesh), grid, BakeParams(resolution=32, layers=layers)).samples.depth
    met = np.isfinite(depth[0])
    height = grid.cylinder.top - depth
    np.testing.assert_allclose(height[0][met], 1.191, atol=1e-4)
    last = np.isfinite(depth).sum(0)[met] - 1
    np.testing.assert_allclose(height[last, *met.nonzero()], 0.001, atol=1e-4)
