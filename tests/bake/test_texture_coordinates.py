"""Which texels get texture coordinates, where four of them are of one chart, and when all that is worth its memory."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.bake.baker import bake_object
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import COORDINATE_STEPS, HAS_COORDINATES, ONE_CHART, BakedObject, Face
from depthwalk.bake.params import BakeParams
from depthwalk.bake.texture_coordinates import (
    kept_coordinates,
    textured_faces,
)
from depthwalk.ingest.mesh import Material, Mesh, Part
from depthwalk.types import Array, Mask
from shapes import bake, checkers, globe, mesh_of, sphere

FINE = checkers(256, 16)


@pytest.fixture(scope="module")
def baked() -> BakedObject:
    return bake(globe(FINE), resolution=64, layers=1)


def places(baked: BakedObject, face: Face) -> tuple[Array, Array, Mask, Mask]:
    """Of a face's first layer: points (H, W, 3), coordinates (H, W, 2), texels that have them, whole cells."""
    image = next(image for image in baked.images if image.face is face)
    assert image.coordinates is not None
    marks = image.coordinates & 1
    coordinates = (image.coordinates & ~np.uint16(1)) / COORDINATE_STEPS
    points = FaceGrid.of(baked.cylinder, image).points(image.depth)
    return points, coordinates, marks[..., 0] == HAS_COORDINATES, marks[..., 1] == ONE_CHART


def apart(one: Array, other: Array) -> Array:
    """How far apart coordinates are, modulo 1."""
    return np.abs((one - other + 0.5) % 1.0 - 0.5)


@pytest.mark.parametrize("face", [Face.SIDE, Face.TOP])
def test_coordinates_are_those_of_the_surface(baked: BakedObject, face: Face) -> None:
    points, coordinates, has, _ = places(baked, face)
    image = next(image for image in baked.images if image.face is face)
    assert (has == np.isfinite(image.depth)).all() and has.sum() > 300
    x, y, z = (points[has] - (0, (baked.cylinder.bottom + baked.cylinder.top) / 2, 0)).T
    expected = np.stack([np.arctan2(x, z) / (2 * np.pi), np.arcsin(np.clip(y, -1, 1)) / np.pi + 0.5], -1)
    off = apart(coordinates[has], expected)
    away = np.hypot(x, z) > 0.2  # from the poles, where a facet spans many meridians
    assert off[away].max() < 2e-3 and off[:, 1].max() < 5e-3
    assert not coordinates[~has].any()


def test_where_a_texture_repeats_there_is_no_seam(baked: BakedObject) -> None:
    points, _, has, whole = places(baked, Face.SIDE)
    middle = has & (np.abs(points[..., 1] - points[has][:, 1].mean()) < 0.5)
    assert whole[middle].mean() > 0.99  # θ and u go round once each, their ends are elsewhere


def two_charts(u: tuple[float, ...] = (0.0, 0.4, 0.9, 0.5)) -> Mesh:
    """A square of 2 m, upright on the origin, that faces +z, in two halves; u: at their sides, from left to right."""
    sides = np.repeat([-1.0, 0.0, 0.0, 1.0], 2)
    positions = np.stack([sides, np.tile([0.0, 2.0], 4), np.zeros(8)], -1)
    faces = [(0, 2, 3), (0, 3, 1), (4, 6, 7), (4, 7, 5)]
    mesh = mesh_of(positions, faces, [(0, 0, 1.0)] * 8, colour=(255, 255, 255))
    uv = np.stack([np.repeat(u, 2), np.tile([0.0, 1.0], 4)], -1).astype(np.float32)
    return replace(mesh, uv=uv, materials=(Material((1.0, 1.0, 1.0), texture=FINE),))


def bake_front(mesh: Mesh) -> BakedObject:
    return bake(mesh, resolution=64, layers=1)


def test_no_cell_spans_a_seam() -> None:
    for mesh, split in ((two_charts(), True), (two_charts((0.0, 0.4, 0.4, 0.5)), False)):
        points, coordinates, has, whole = places(bake_front(mesh), Face.FRONT)
        row = np.flatnonzero(has.any(1))[5]
        column = int(np.flatnonzero(points[row, :, 0] < 0)[-1])  # the last one left of the seam
        step = apart(coordinates[row, column], coordinates[row, column + 1])[0]
        assert has[row].all() and (step > 0.4) == split
        assert whole[row, column] == (not split) and whole[row, column - 9 : column].all()
        assert whole[row, column + 1 : column + 9].all()


def test_charts_that_meet_by_chance_are_two() -> None:
    """A gap so narrow that no step from texel to texel would give it away."""
    mesh = two_charts((0.0, 0.4, 0.401, 0.8))
    points, _, has, whole = places(bake_front(mesh), Face.FRONT)
    row = np.flatnonzero(has.any(1))[5]
    assert not whole[row, int(np.flatnonzero(points[row, :, 0] < 0)[-1])]


def test_other_materials_and_painted_vertices_have_none() -> None:
    mesh = two_charts()
    other = replace(
        mesh, parts=(Part(0, 2, 0), Part(2, 2, 1)), materials=(mesh.materials[0], Material((0.3, 0.5, 0.1)))
    )
    painted = replace(mesh, colours=mesh.colours.copy())
    painted.colours[4:] = 100
    for partly in (other, painted):
        points, _, has, _ = places(bake_front(partly), Face.FRONT)
        solid = np.isfinite(points[..., 2])
        assert (has[solid] == (points[solid][:, 0] < 0)).all() and has.any()


def textured(baked: BakedObject) -> bool:
    images = {image.coordinates is not None for image in baked.images}
    assert len(images) == 1 and (baked.texture is not None) in images
    return baked.texture is not None


def test_only_what_is_finer_than_the_images_is_kept(baked: BakedObject) -> None:
    assert textured(baked)
    assert not textured(bake(globe(checkers(16, 2)), resolution=64, layers=1))
    assert not textured(bake(sphere(1.0, 64, 32), resolution=64, layers=1))
    never = bake_object(globe(FINE, 64, 32), BakeParams(resolution=64, layers=1, coordinates="never"), "")
    views = bake_object(globe(FINE, 64, 32), BakeParams(resolution=64, layers=1, method="six-view"), "")
    assert not textured(never) and not textured(views)


def test_a_texture_has_at_most_four_times_the_texels_of_an_image() -> None:
    for resolution, side in ((64, 128), (128, 256), (512, 256)):
        found = textured_faces(globe(FINE, 16, 8), resolution)
        assert found is not None and found.texture.shape == (side, side, 3)
    whole = textured_faces(globe(FINE, 16, 8), 512)
    assert whole is not None
    np.testing.assert_array_equal(whole.texture, FINE[::-1, :, :3])  # upright, as coordinates are
    wide = np.tile(FINE, (1, 4, 1))[:100]
    found = textured_faces(globe(wide, 16, 8), 64)
    assert found is not None
    height, width = found.texture.shape[:2]
    assert height * width <= 128**2 and width / height == pytest.approx(1024 / 100, rel=0.03)


def test_what_is_averaged_is_light() -> None:
    half = np.zeros((256, 256, 4), np.uint8)
    half[::2] = 255
    found = textured_faces(globe(half, 16, 8), 64)
    assert found is not None and (found.texture == 188).all()  # sRGB of half the light


def test_the_base_colour_is_multiplied_in() -> None:
    mesh = globe(FINE, 16, 8)
    tinted = replace(mesh, materials=(replace(mesh.materials[0], base_colour=(0.5, 1.0, 0.0)),))
    found = textured_faces(tinted, 512)
    assert found is not None
    plain = found.texture[FINE[::-1, :, 1] == 235][0]
    np.testing.assert_array_equal(plain, [173, 235, 0])  # sRGB: half of 235, and of 200 nothing


def test_cells_break_where_a_corner_is_left_out() -> None:
    codes = np.full((4, 4, 2), 2 * 100 + 1, np.uint16)
    codes[-1, :, 1] &= 0xFFFE
    codes[:, -1, 1] &= 0xFFFE
    used = np.ones((4, 4), bool)
    used[2, 2] = False
    kept = kept_coordinates(codes, used, Face.FRONT)
    assert not kept[2, 2].any() and (kept[used][:, 0] == 201).all()
    whole = kept[..., 1] & ONE_CHART > 0
    assert whole.tolist() == [[True] * 3 + [False], [True, False, False, False], [True] + [False] * 3, [False] * 4]
