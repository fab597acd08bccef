"""Depth peeling: hits along rays, in order."""

import numpy as np
import pytest

from depthwalk.bake.raycast import RayCaster, facing_normals, is_open, no_hits
from depthwalk.ingest.mesh import Mesh
from shapes import box, joined, mesh_of

DOWN = np.array([[0, -1.0, 0]], np.float32)
ABOVE = np.array([[0.1, 5.0, 0.2]], np.float32)


def plates(count: int) -> Mesh:
    return joined(*[box(1.0, 0.2, 1.0, (0, y, 0)) for y in range(count)])


def card() -> Mesh:
    return mesh_of([(-1, 0, -1), (1, 0, -1), (0, 0, 1)], [(0, 2, 1)], [(0, 1.0, 0)] * 3)


def test_front_faces_are_met_in_order() -> None:
    hits = RayCaster(plates(3)).peel(ABOVE, DOWN, 4, 10.0)
    assert len(hits) == 4
    np.testing.assert_allclose(hits.distance[:3, 0], [2.9, 3.9, 4.9], rtol=1e-5)
    assert np.isinf(hits.distance[3, 0]) and hits.face[3, 0] == -1
    np.testing.assert_allclose(hits.normal[:3, 0], [[0, 1, 0]] * 3, atol=1e-6)
    assert not hits.flipped.any()


def test_rays_end_at_their_reach() -> None:
    hits = RayCaster(plates(3)).peel(ABOVE, DOWN, 4, 3.5)
    assert np.isfinite(hits.distance[:, 0]).sum() == 1


def test_weights_say_where_a_triangle_was_hit() -> None:
    mesh = plates(1)
    hits = RayCaster(mesh).peel(ABOVE, DOWN, 1, 10.0)
    u, v = hits.u[0, 0], hits.v[0, 0]
    point = np.array([1 - u - v, u, v]) @ mesh.positions[mesh.faces[hits.face[0, 0]]]
    np.testing.assert_allclose(point, ABOVE[0] + hits.distance[0, 0] * DOWN[0], atol=1e-5)


@pytest.mark.parametrize("mesh, open_", [(card(), True), (plates(2), False)])
def test_shells_are_told_from_solids(mesh: Mesh, open_: bool) -> None:
    assert is_open(mesh) == RayCaster(mesh).two_sided == open_
    assert RayCaster(mesh, two_sided=not open_).two_sided != open_


def test_an_open_mesh_is_seen_from_behind() -> None:
    caster = RayCaster(card())
    first = caster.first(-ABOVE * [0, 1, 0], -DOWN)
    assert first.flipped.all() and first.distance[0] == pytest.approx(5)
    np.testing.assert_allclose(first.normal, [[0, -1, 0]])
    assert caster.escapes(ABOVE, -DOWN).all() and not caster.escapes(ABOVE * [0, 1, 0], DOWN).any()


def test_normals_are_turned_against_their_rays() -> None:
    normal = np.array([[0, 3.0, 0], [0, -3.0, 0]], np.float32)
    found, flipped = facing_normals(normal, np.repeat(DOWN, 2, axis=0))
    np.testing.assert_allclose(found, [[0, 1, 0]] * 2)
    assert flipped.tolist() == [False, True]


def test_no_hits_are_empty() -> None:
    hits = no_hits(2, 3)
    assert np.isinf(hits.distance).all() and (hits.face == -1).all() and hits.normal.shape == (2, 3, 3)
