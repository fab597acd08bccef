"""Surfaces that the alpha of their texture cuts out: rays pass where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.bake.cut_outs import alpha_at, cut_outs
from depthwalk.bake.raycast import RayCaster
from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.ingest.solid import is_solid
from shapes import box, mesh_of

HALF = np.full((8, 8, 4), 255, np.uint8)
HALF[:, :4, 3] = 0  # the left half is cut out


def cards(count: int) -> Mesh:
    """Upright squares, one behind the other from z = 0 on, 2 m wide and high, of which x < 0 is cut out."""
    corners = [(x, y, -0.5 * z) for z in range(count) for x, y in ((-1, 0), (1, 0), (1, 2), (-1, 2))]
    faces = [(4 * z + a, 4 * z + b, 4 * z + c) for z in range(count) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    mesh = mesh_of(corners, faces, [(0, 0, 1)] * len(corners))
    uv = np.tile([(0, 0), (1, 0), (1, 1), (0, 1)], (count, 1)).astype(np.float32)
    return replace(mesh, uv=uv, materials=(Material((1.0, 1.0, 1.0), HALF, cutoff=0.5),))


def test_alpha_is_that_of_the_picture() -> None:
    """In the middle of texels, between two, and repeated."""
    uv = np.array([[0.2, 0.5], [0.8, 0.5], [0.5, 0.5], [1.2, -7.5]])
    np.testing.assert_allclose(alpha_at(HALF, uv), [0, 1, 0.5, 0], atol=1e-6)


def test_what_cuts_nothing_out_is_not_asked() -> None:
    assert cut_outs(box(1.0, 1.0, 1.0)) is None


@pytest.mark.parametrize("count", [1, 20])
def test_rays_pass_what_is_cut_out(count: int) -> None:
    """Through twenty cards, more than layers, to the box behind them; on the other side they meet the first card."""
    wall = box(4.0, 4.0, 0.5, (0, 0, -20))
    behind = cards(count)
    mesh = replace(
        behind,
        positions=np.concatenate([behind.positions, wall.positions]),
        normals=np.concatenate([behind.normals, wall.normals]),
        colours=np.concatenate([behind.colours, wall.colours]),
        uv=np.concatenate([behind.uv, wall.uv]),
        faces=np.concatenate([behind.faces, wall.faces + len(behind.positions)]),
        parts=(*behind.parts, replace(wall.parts[0], first_face=len(behind.faces), material=1)),
        materials=(*behind.materials, Material()),
    )
    caster = RayCaster(mesh)
    origin = np.array([[-0.5, 1, 5], [0.5, 1, 5], [9, 1, 5]], np.float32)
    ahead = np.tile(np.array([[0, 0, -1]], np.float32), (3, 1))
    distance = caster.first(origin, ahead).distance
    np.testing.assert_allclose(distance[:2], [24.75, 5.0], rtol=1e-4)
    assert np.isinf(distance[2])
    assert caster.escapes(origin, 3 * ahead).tolist() == [False, False, True]
    assert RayCaster(behind).escapes(origin, 3 * ahead).tolist() == [True, False, True]
    peeled = caster.peel(origin, ahead, 2, 100.0).distance
    np.testing.assert_allclose(peeled[:, 0], [24.75, 25.25], rtol=1e-4)
    np.testing.assert_allclose(peeled[:, 1], [5.0, 5.5 if count > 1 else 24.75], rtol=1e-4)


def test_the_inside_of_a_box_with_windows_shows() -> None:
    body = box(1.0, 1.0, 1.0)
    assert is_solid(body)
    assert not is_solid(replace(body, materials=(Material(texture=HALF, cutoff=0.5),)))
