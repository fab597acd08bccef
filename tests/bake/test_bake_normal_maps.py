"""Normal maps in depth images."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from baked_files import identical
from depthwalk.bake.baker import bake_object
from depthwalk.bake.capture import capture_views
from depthwalk.bake.captured_views import CaptureParams
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.file import read_baked, read_header, write_baked
from depthwalk.bake.images import BakedObject, Cylinder, Face
from depthwalk.bake.normal_maps import NormalMaps, footprint_area, mip_levels
from depthwalk.bake.params import BakeParams
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.surface import surface_at
from depthwalk.cook.texel_encoding import encode_normals, image_texels
from depthwalk.ingest.mesh import Mesh
from depthwalk.types import Array
from normal_mapped import TILT, dome_normals, domed_square, mirrored_globe, tilted, tilted_globe_normals
from shapes import bake, model_of


def looked_up(mesh: Mesh, origin: Array, direction: Array, area: float = 0.0) -> Array:
    """The normals (n, 3) that a mesh is lit by where rays hit it first."""
    hits = RayCaster(mesh, two_sided=True).peel(
        origin.astype(np.float32), np.broadcast_to(direction, origin.shape).astype(np.float32), 1, 10.0
    )
    assert (hits.face >= 0).all()
    maps = NormalMaps.of(mesh)
    assert maps is not None
    return maps.turned(hits, surface_at(mesh, hits)[0], np.full(hits.face.shape, area))[0]


def square_points(count: int) -> tuple[Array, Array, Array]:
    """Points (count², 3) before `domed_square`, and their texture coordinates."""
    at = (np.arange(count) + 0.37) / count
    u, v = (axis.ravel() for axis in np.meshgrid(at, at))
    return np.stack([2 * u - 1, 2 * v, np.ones_like(u)], -1), u, v


def test_domes_have_their_analytic_normals_and_from_behind_the_opposite() -> None:
    mesh = domed_square(256, 3)
    points, u, v = square_points(25)
    expected, smooth = dome_normals(u, v, 3)
    assert smooth.mean() > 0.7
    front = looked_up(mesh, points, np.array([0.0, 0, -1]))
    assert front[smooth] == pytest.approx(expected[smooth], abs=0.03)
    behind = looked_up(mesh, points * [1, 1, -1], np.array([0.0, 0, 1]))
    assert behind == pytest.approx(-front, abs=1e-5)


def test_a_mirrored_texture_keeps_its_handedness() -> None:
    mesh = tilted(mirrored_globe())
    toward = np.random.default_rng(1).normal(size=(300, 3))
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    toward = toward[(np.abs(toward[:, 0]) > 0.1) & (np.abs(toward[:, 1]) < 0.9)]
    found = looked_up(mesh, np.array([0, 1.0, 0]) + 2 * toward, -toward)
    assert found == pytest.approx(tilted_globe_normals(toward), abs=0.04)  # triangles near the poles are coarse


def test_the_scale_of_a_map_flattens_it() -> None:
    points, _, _ = square_points(2)
    mesh = tilted(domed_square(4, 1), normal_scale=0.5)
    expected = TILT * [0.5, 0.5, 1]
    found = looked_up(mesh, points, np.array([0.0, 0, -1]))
    assert found == pytest.approx(np.tile(expected / np.linalg.norm(expected), (4, 1)), abs=0.01)


def test_without_texture_coordinates_normals_stay_as_they_are() -> None:
    mesh = tilted(domed_square(4, 1))
    points, _, _ = square_points(3)
    assert looked_up(replace(mesh, uv=mesh.uv * 0), points, np.array([0.0, 0, -1])).tolist() == [[0, 0, 1]] * 9


def test_a_map_is_averaged_over_what_a_texel_covers() -> None:
    """Over whole cells the domes' normals cancel; over a point they do not."""
    points, _, _ = square_points(20)
    found = {area: looked_up(domed_square(64, 16), points, np.array([0.0, 0, -1]), area) for area in (0.0, 0.25)}
    assert found[0.25][:, 2].min() > 0.999
    assert found[0.0][:, 2].min() < 0.6


@pytest.mark.parametrize("shape", [(8, 8), (7, 5), (1, 6), (1, 1)])
def test_mip_maps_are_means(shape: tuple[int, int]) -> None:
    texels = np.random.default_rng(0).integers(0, 256, (*shape, 4), np.uint8)
    levels = mip_levels(texels)
    assert [level.shape[0] for level in levels][-1] == levels[-1].shape[1] == 1
    for level in levels:
        assert level.mean((0, 1)) == pytest.approx(texels[..., :3].mean((0, 1)), abs=1e-3)


def test_texels_cover_more_of_slanted_surfaces() -> None:
    normal = np.array([[[0, 0, 1.0], [0, 0.8, 0.6], [0, 1.0, 0]]])
    assert footprint_area(2.0, normal, np.array([0, 0, -1.0])) == pytest.approx(np.array([[2, 2 / 0.6, 20]]))


def test_texels_of_the_side_narrow_towards_the_axis() -> None:
    cylinder = Cylinder(radius=2.0, bottom=0.0, top=1.0, half_width=2.0, half_depth=2.0)
    side, top = (FaceGrid(cylinder=cylinder, face=face, height=8, width=8) for face in (Face.SIDE, Face.TOP))
    depth = np.array([0.0, 1.0, 2.0, 3.0])
    assert side.texel_area(depth) == pytest.approx(np.pi / 2 / 8 * np.array([1, 0.5, 0, 0.5]))
    assert top.texel_area(depth) == pytest.approx(0.25)


@pytest.fixture(scope="module")
def baked() -> BakedObject:
    return bake(tilted(mirrored_globe()), resolution=64, layers=1)


def test_normals_are_kept_as_they_are_unless_leaves_are_cut_out() -> None:
    """Which have two sides, in one surface when they are simplified."""
    mesh = tilted(domed_square(4, 1))
    holes = np.full((4, 4, 4), 255, np.uint8)
    holes[:2, :, 3] = 0
    leaf = replace(mesh, materials=(replace(mesh.materials[0], texture=holes, cutoff=0.5),))
    bare = replace(mesh, materials=(replace(mesh.materials[0], normal_map=None),))
    assert [bake(each, resolution=16, layers=1).keeps_normals for each in (mesh, leaf, bare)] == [True, False, False]


@pytest.mark.slow
def test_depth_images_are_lit_by_mapped_normals_and_connected_by_the_mesh(baked: BakedObject) -> None:
    plain = bake(mirrored_globe(), resolution=64, layers=1)
    for image, without in zip(baked.images, plain.images, strict=True):
        for name in ("depth", "normal", "albedo", "owner"):
            assert identical(getattr(image, name), getattr(without, name))
        assert without.mapped_normal is None and without.shading_normal is without.normal
        assert image.mapped_normal is not None
        solid = np.isfinite(image.depth) & (np.abs(image.normal[..., 0]) > 0.1) & (np.abs(image.normal[..., 1]) < 0.9)
        expected = tilted_globe_normals(image.normal[solid].astype(float))
        assert image.mapped_normal[solid] == pytest.approx(expected, abs=0.03)
        assert not image.mapped_normal[~np.isfinite(image.depth)].any()


def test_what_is_drawn_is_the_mapped_normal(baked: BakedObject) -> None:
    for image in baked.images:
        solid = np.isfinite(image.depth)
        assert identical(
            image_texels(baked.cylinder, image)[solid, :3].astype(np.uint8), encode_normals(image.shading_normal[solid])
        )


def test_files_hold_both_normals(tmp_path: Path, baked: BakedObject) -> None:
    path = tmp_path / "globe.dpci.exr"
    write_baked(path, model_of(baked))
    (read,) = read_baked(path).parts
    for before, after in zip(baked.images, read.images, strict=True):
        assert before.mapped_normal is not None and after.mapped_normal is not None
        assert identical(before.mapped_normal.astype(np.float16).astype(np.float32), after.mapped_normal)
        assert identical(before.normal.astype(np.float16).astype(np.float32), after.normal)
    assert read.keeps_normals
    assert read_header(path)["depthwalk.version"] == 12  # which earlier programs ask to bake again


def test_captured_views_hold_mapped_normals() -> None:
    params = CaptureParams(directions="azimuths", count=4, resolution=32)
    mesh = domed_square(4, 1)
    plain, turned = (capture_views(each, params).surface for each in (tilted(mesh, normal_scale=0.0), tilted(mesh)))
    assert (plain[..., 3] == turned[..., 3]).all()
    assert np.abs(plain[..., :3].astype(int) - turned[..., :3]).max() > 20


@pytest.mark.gl
def test_six_views_hold_mapped_normals() -> None:
    params = BakeParams(resolution=64, layers=1, method="six-view")
    plain, turned = (bake_object(each, params, "test") for each in (mirrored_globe(), tilted(mirrored_globe())))
    for image, without in zip(turned.images, plain.images, strict=True):
        assert identical(image.depth, without.depth)
        assert image.mapped_normal is not None
        solid = np.isfinite(image.depth) & (np.abs(image.normal[..., 0]) > 0.2) & (np.abs(image.normal[..., 1]) < 0.8)
        error = np.abs(image.mapped_normal[solid] - tilted_globe_normals(image.normal[solid].astype(float))).max(1)
        assert np.quantile(error, 0.98) < 0.03
