"""The texels of a face in space."""

import numpy as np
import pytest

from depthwalk.bake.face_grid import FaceGrid, square_texel, texel_centres
from depthwalk.bake.images import BoundaryStrip, Cylinder, DepthImage, Face, face_outward
from depthwalk.bake.raycast import RayCaster
from depthwalk.types import Array
from shapes import bake, box

CYLINDER = Cylinder(radius=0.8, bottom=-0.5, top=1.5, half_width=0.8, half_depth=0.8)
H, W = 24, 32


def grid_of(face: Face, cylinder: Cylinder = CYLINDER) -> FaceGrid:
    return FaceGrid(cylinder=cylinder, face=face, height=H, width=W)


def image_of(face: Face, depth: Array) -> DepthImage:
    return DepthImage(
        face=face,
        layer=0,
        depth=depth,
        normal=np.zeros((*depth.shape, 3), np.float32),
        albedo=np.zeros((*depth.shape, 4), np.float32),
        cells=(),
        owner=np.full(depth.shape, face, np.uint8),
    )


@pytest.mark.parametrize("face", Face)
def test_rays_begin_on_the_face_and_lead_inward_to_its_far_side(face: Face) -> None:
    grid = grid_of(face)
    origin, direction = grid.rays
    assert origin.shape == direction.shape == (H, W, 3)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=-1), 1, rtol=1e-6)
    end = origin + grid.max_depth * direction
    if face is Face.SIDE:
        for points in (origin, end):
            np.testing.assert_allclose(np.hypot(points[..., 0], points[..., 2]), CYLINDER.radius, rtol=1e-5)
        assert (np.einsum("hwi,hwi->hw", origin, direction) < 0).all()
    else:
        outward = face_outward(face)
        np.testing.assert_allclose(direction @ outward, -1)
        low, size = CYLINDER.box
        axis = int(np.abs(outward).argmax())
        near, far = (low + size, low) if outward.sum() > 0 else (low, low + size)
        np.testing.assert_allclose(origin[..., axis], near[axis], rtol=1e-6)
        np.testing.assert_allclose(end[..., axis], far[axis], rtol=1e-6)


@pytest.mark.parametrize("face", Face)
def test_points_fall_on_the_texels_that_they_were_seen_through(face: Face) -> None:
    grid = grid_of(face)
    depth = np.random.default_rng(1).uniform(0.05, 0.7, (H, W)).astype(np.float32)  # on this side of the axis
    points = grid.points(depth).reshape(-1, 3)
    seen = grid.project(points)
    row, column = grid.texel_at(seen.u, seen.v)
    np.testing.assert_array_equal(row.reshape(H, W), np.arange(H)[:, None] * np.ones(W, int))
    np.testing.assert_array_equal(column.reshape(H, W), np.arange(W) * np.ones((H, 1), int))
    np.testing.assert_allclose(seen.depth.reshape(H, W), depth, atol=2e-6)
    u, v = texel_centres(W), texel_centres(H)[:, None]
    np.testing.assert_array_equal(grid.points_at(u, v, depth).reshape(-1, 3), points)


def test_the_side_is_the_papers_cylinder() -> None:
    """B = ((R − d) cos θ, y, (R − d) sin θ), θ = 2πu."""
    theta, y, depth = np.radians(70), 0.4, 0.25
    u, v = np.array([theta / (2 * np.pi)]), np.array([(y - CYLINDER.bottom) / CYLINDER.height])
    (point,) = grid_of(Face.SIDE).points_at(u, v, np.array([depth]))
    left = CYLINDER.radius - depth
    np.testing.assert_allclose(point, [left * np.cos(theta), y, left * np.sin(theta)], rtol=1e-5)


def test_what_lies_outside_is_clipped_to_the_last_texel() -> None:
    row, column = grid_of(Face.TOP).texel_at(np.array([-0.2, 1.0, 7.0]), np.array([0.0, 1.0, -3.0]))
    assert row.tolist() == [0, H - 1, 0] and column.tolist() == [0, W - 1, W - 1]


def test_empty_texels_have_no_point() -> None:
    points = grid_of(Face.SIDE).points(np.full((H, W), np.inf, np.float32))
    assert not np.isfinite(points).all(-1).any()


def test_texels_are_as_large_as_the_face_says() -> None:
    turn = 2 * np.pi * CYLINDER.radius
    assert grid_of(Face.SIDE).texel_size == pytest.approx((turn / W, CYLINDER.height / H))
    assert grid_of(Face.TOP).texel_size == pytest.approx((1.6 / W, 1.6 / H))
    assert grid_of(Face.LEFT).texel_size == pytest.approx((1.6 / W, CYLINDER.height / H))
    assert grid_of(Face.TOP).longest_texel == pytest.approx(1.6 / H)


def test_rays_are_made_once_and_equal_grids_are_equal() -> None:
    grid = grid_of(Face.FRONT)
    assert grid.rays is grid.rays
    assert grid == grid_of(Face.FRONT) != grid_of(Face.BACK)
    assert FaceGrid.of(CYLINDER, image_of(Face.FRONT, np.ones((H, W), np.float32))) == grid
    with pytest.raises(TypeError, match="positional"):
        FaceGrid(CYLINDER, Face.FRONT, H, W)  # type: ignore[call-arg]


def test_vertices_of_boundary_strips_are_counted_from_their_samples() -> None:
    grid, layers = grid_of(Face.TOP), [np.full((H, W), depth, np.float32) for depth in (0.25, 0.5)]
    images = [image_of(Face.TOP, depth) for depth in layers]
    border = BoundaryStrip(
        face=Face.TOP,
        level=0,
        start=np.array([3 * W + 5, H * W + 3 * W + 5], np.int32),  # the same texel on either layer
        offset=np.array([[0.5, -0.25], [0, 0]], np.float16),
        rise=np.array([0.125, 0], np.float16),
        triangles=np.zeros((0, 3), np.int32),
    )
    points, depth = grid.border_points(images, border)
    assert depth.tolist() == [0.375, 0.5]
    x, z = 1.6 * (6.0 / W) - 0.8, 1.6 * (3.25 / H) - 0.8
    np.testing.assert_allclose(points[0], [x, CYLINDER.top - 0.375, z], rtol=1e-5)
    np.testing.assert_allclose(points[1], grid.points(layers[1])[3, 5], rtol=1e-6)


def test_projections_are_taken_by_rows() -> None:
    seen = grid_of(Face.SIDE).project(np.random.default_rng(2).uniform(-0.5, 0.5, (9, 3)))
    some = seen.take(np.array([7, 2]))
    np.testing.assert_array_equal(some.depth, seen.depth[[7, 2]])
    np.testing.assert_array_equal(some.direction, seen.direction[[7, 2]])


def test_depths_of_a_bake_are_those_of_rays_at_the_mesh() -> None:
    mesh = box(1.0, 0.6, 0.7, (0, 0.3, 0))
    baked, caster = bake(mesh, 32, 1), RayCaster(mesh)
    for image in baked.images:
        origin, direction = (part.reshape(-1, 3) for part in FaceGrid.of(baked.cylinder, image).rays)
        solid = np.isfinite(image.depth.ravel())
        np.testing.assert_allclose(image.depth.ravel()[solid], caster.first(origin, direction).distance[solid])


def test_a_square_texel_has_a_side_texels_area() -> None:
    baked = bake(box(1.0, 0.6, 0.7, (0, 0.3, 0)), 32, 1)
    area = 2 * np.pi * baked.cylinder.radius * baked.cylinder.height / 32**2
    assert square_texel(baked) == pytest.approx(area**0.5)
