"""Which samples stay, inside a sphere with a hole: from everywhere in it the hole takes up the same part of the
directions, weighted by the cosine, as it does of the sphere's area."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.bake.baker import BakeParams, cast_face
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import Face, enclosing_cylinder
from depthwalk.bake.raycast import RayCaster
from shapes import sphere

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
