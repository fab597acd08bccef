"""Which face samples a piece of surface best."""

import numpy as np
import pytest

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import Cylinder, Face
from depthwalk.bake.ownership import FaceLayers, assign_owners, face_layers, footprints, inner_texels, worth_adding
from shapes import bake, sphere

CYLINDER = Cylinder(radius=1.0, bottom=0.0, top=2.0, half_width=1.0, half_depth=1.0)


def grid_of(face: Face, size: int = 32) -> FaceGrid:
    return FaceGrid(cylinder=CYLINDER, face=face, height=size, width=size)


def footprint(face: Face, point: tuple[float, float, float], normal: tuple[float, float, int]) -> float:
    grid = grid_of(face)
    return float(footprints(grid, grid.project(np.array([point])), np.array([normal]))[0])


@pytest.mark.parametrize("degrees", [0, 30, 75])
def test_footprints_grow_with_the_angle_between_surface_and_rays(degrees: int) -> None:
    tilt = np.radians(degrees)
    found = footprint(Face.TOP, (0.2, 1.0, 0.1), (np.sin(tilt), np.cos(tilt), 0))
    assert found == pytest.approx(2 / 32 / np.cos(tilt))


def test_rays_of_the_side_crowd_toward_the_axis() -> None:
    far, near = (footprint(Face.SIDE, (r, 1.0, 0), (1.0, 0, 0)) for r in (1.0, 0.5))
    assert far == pytest.approx(2 * np.pi / 32) and near == pytest.approx(far / 2)
    assert footprint(Face.SIDE, (0.01, 1.0, 0), (1.0, 0, 0)) == pytest.approx(2 / 32)  # rows stay as far apart


def test_backs_and_edges_have_no_footprint() -> None:
    assert np.isinf(footprint(Face.TOP, (0, 1, 0), (0, -1.0, 0)))
    assert np.isinf(footprint(Face.TOP, (0, 1, 0), (1.0, 0, 0)))


@pytest.fixture(scope="module")
def ball() -> dict[Face, FaceLayers]:
    baked = bake(sphere(columns=64, rows=32), 64, 1)
    by_face = {face: [image for image in baked.images if image.face is face] for face in Face}
    return {
        face: face_layers(FaceGrid.of(baked.cylinder, images[0]), images) for face, images in by_face.items() if images
    }


def test_the_pole_is_the_caps_and_the_equator_the_sides(ball: dict[Face, FaceLayers]) -> None:
    rivals = {face: ball[face] for face in (Face.TOP, Face.SIDE)}
    top, side = assign_owners(rivals)
    assert top[32, 32] == Face.TOP  # the pole
    assert (side[32] == Face.SIDE).all()  # the equator
    assert (side[60][np.isfinite(ball[Face.SIDE].images[0].depth[60])] == Face.TOP).all()


def test_inner_texels_are_surrounded_by_surface(ball: dict[Face, FaceLayers]) -> None:
    inner = inner_texels(ball[Face.TOP].images)
    depth = np.stack([image.depth for image in ball[Face.TOP].images])
    assert inner.shape == depth.shape and inner.any()
    assert np.isfinite(depth[inner]).all() and not inner[:, [0, -1]].any()


def test_a_box_face_adds_only_what_others_sample_worse(ball: dict[Face, FaceLayers]) -> None:
    rivals = {face: ball[face] for face in (Face.TOP, Face.SIDE)}
    front = FaceGrid(cylinder=ball[Face.TOP].grid.cylinder, face=Face.FRONT, height=64, width=64)
    normal = np.array([[0, 0, 1.0], [0, 0.8, 0.6]])
    point = normal + np.array([0, 1, 0])  # the ball's centre is at y = 1
    # The side's texels are π times as wide as those of the box face; the cap sees the second point more squarely.
    assert worth_adding(rivals, front, point, normal).tolist() == [True, False]
    assert worth_adding({}, front, point, normal).all()
    assert not worth_adding({}, front, point, -normal).any()  # it does not see backs
