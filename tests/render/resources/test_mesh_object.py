"""Meshes on the GPU come back as they went in; which of them are solid."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from depthwalk.gpu.device import Device, Scope
from depthwalk.ingest.solid import is_solid
from depthwalk.render.resources.mesh_object import upload_look, upload_mesh
from depthwalk.render.resources.meshlets import build_meshlets
from depthwalk.types import Array, Rows
from shapes import box, joined, leaves, sphere


def test_closed_surfaces_seen_from_outside_are_solid() -> None:
    ball = sphere(columns=16, rows=8)
    ball = replace(ball, positions=ball.positions.round(5) + np.float32(0))  # its seam closes but for rounding
    assert is_solid(box(1, 2, 3)) and is_solid(ball) and is_solid(joined(ball, box(1, 1, 1, (4, 0, 0))))
    assert not is_solid(leaves(5, 0.1))
    assert not is_solid(replace(ball, faces=ball.faces[1:]))  # with a hole
    assert not is_solid(replace(ball, faces=ball.faces[:, ::-1]))  # inside out
    assert not is_solid(replace(ball, faces=np.concatenate([ball.faces[:4, ::-1], ball.faces[4:]])))


@pytest.fixture
def scope(gl_device: Device) -> Iterator[Scope]:
    made = gl_device.scope("test")
    yield made
    made.release()


def corners(positions: Array, triangles: Rows) -> Array:
    """Corners of triangles in an order that depends on nothing else."""
    found = np.asarray(positions)[triangles]
    return found.reshape(len(found), 9)[np.lexsort(found.reshape(len(found), 9).T)]


@pytest.mark.parametrize("rows", [8, 100])
def test_what_is_uploaded_is_the_mesh(scope: Scope, rows: int) -> None:
    mesh = sphere(columns=2 * rows, rows=rows)
    meshlets = build_meshlets(mesh)
    assert (meshlets is None) == (rows == 8)
    uploaded = upload_mesh(scope, mesh, upload_look(scope, mesh, solid=True), meshlets)
    found = corners(*uploaded.shape())
    rolled = [corners(mesh.positions, np.roll(mesh.faces, turn, 1)) for turn in range(3)]
    assert len(found) == len(mesh.faces) and any(np.array_equal(found, each) for each in rolled)
    assert uploaded.parts == mesh.parts and uploaded.look.solid


def test_materials_without_colours_are_not_painted(scope: Scope) -> None:
    white, red = sphere(columns=8, rows=4, colour=(255, 255, 255)), sphere(columns=8, rows=4, colour=(255, 0, 0))
    (plain,), (painted,) = (upload_look(scope, mesh, True).materials for mesh in (white, red))
    assert not plain.painted and painted.painted and plain.texture.size == (1, 1)
    assert plain.uniforms["shininess"] == white.materials[0].shininess
