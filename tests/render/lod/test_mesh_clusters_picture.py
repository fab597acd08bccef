"""Meshes drawn by clusters: what they look like beside the mesh, and what is drawn."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.scene.arrays import Camera, Representation
from shapes import ShapeLibrary, joined, leaves, scene_of, sphere
from studio import Studio

CAMERA = Camera((0, 1.5, 12), (0, 1, 0), 0.5)
PLACED = (0, (0, 0, 0), 0.3, 1.0), (0, (2.5, 0, -60), 0.0, 1.0), (0, (-2, 0, 3), 1.0, 0.5)


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    ball = sphere(1.0, columns=64, rows=32)
    ball = replace(ball, positions=np.round(ball.positions, 5))  # closed: the ends of the seam at the same places
    return ShapeLibrary([ball, joined(sphere(0.5, 32, 16), leaves(300, 0.2))], [None, None])


def test_without_error_the_picture_is_that_of_the_mesh(studio: Studio, library: ShapeLibrary) -> None:
    pictures, triangles = [], []
    for kind, error in ((Representation.MESH, 1), (Representation.MESH_CLUSTERS, 0), (Representation.MESH_CLUSTERS, 1)):
        scene = scene_of(*PLACED, (1, (-1, 0, 8), 0.2, 1.0), representation=kind)
        scene.render.mesh.error = error
        pixels, _, plan = studio.measured(scene, library, CAMERA)
        pictures.append(pixels)
        triangles.append(plan.counts["mesh_triangles"])
        assert plan.counts["mesh"] == 4
    assert np.abs(pictures[1] - pictures[0]).mean() < 1e-4  # triangles at equal depth come in another order
    assert triangles[2] < 0.2 * triangles[0] and triangles[1] < triangles[0]
    assert 0 < np.abs(pictures[2] - pictures[0]).mean() < 4e-3


def test_what_is_out_of_sight_or_faces_away_is_not_drawn(studio: Studio, library: ShapeLibrary) -> None:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH_CLUSTERS)
    scene.render.mesh.error = 0
    whole = 64 * 64
    drawn = [
        studio.measured(scene, library, Camera((0, 1, 4), (0, 1, 0), angle))[2].counts["mesh_triangles"]
        for angle in (0.6, 0.05)
    ]
    assert drawn[1] < drawn[0] < 0.8 * whole


@pytest.mark.parametrize("aa", ["gpaa", "gpaa-edge", "msaa"])
def test_edges_are_smoothed(studio: Studio, library: ShapeLibrary, aa: str) -> None:
    pictures = []
    for mode in ("none", aa):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH_CLUSTERS)
        scene.render.aa = mode  # type: ignore[assignment]
        pictures.append(studio.picture(scene, library, CAMERA))
    changed = np.abs(pictures[1] - pictures[0]).max(-1) > 0.03
    assert 20 < changed.sum() < 0.1 * changed.size
