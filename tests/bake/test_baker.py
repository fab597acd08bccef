"""Depth images of known shapes, the cut, ownership, the file and the cache."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from depthwalk.bake.baker import bake_object
from depthwalk.bake.cache import bake_key, find_baked, keep_baked, sidecar
from depthwalk.bake.face_grid import FaceGrid, texel_centres
from depthwalk.bake.file import read_baked, write_baked
from depthwalk.bake.grid import grid_cells, grid_nodes, layer_triangles, triangle_places
from depthwalk.bake.images import BakedObject, DepthImage, Face
from depthwalk.bake.params import BakeParams
from depthwalk.errors import InputError
from depthwalk.types import Array
from shapes import bake, box, joined, model_of, sphere


def images_of(baked: BakedObject, face: Face) -> list[DepthImage]:
    return [image for image in baked.images if image.face is face]


@pytest.mark.slow
def test_bars_of_one_texel_are_kept() -> None:
    """A box face drops specks on surfaces that other faces sample better, but not bars that nothing else samples."""
    places = np.arange(-1.4, 1.41, 0.2)
    baked = bake(joined(*(box(0.03, 0.6, 0.03, (x, 0.3, 0)) for x in places)), resolution=96, layers=3)
    (front,) = images_of(baked, Face.FRONT)
    points = FaceGrid.of(baked.cylinder, front).points(front.depth)[np.isfinite(front.depth)]
    assert all((np.abs(points[:, 0] - x) < 0.02).any() for x in places if abs(x) > 0.1)  # the side samples the others


@pytest.mark.slow
def test_a_sphere_has_known_depth() -> None:
    baked = bake(sphere(), resolution=128, layers=1)
    radius = baked.cylinder.radius
    side = images_of(baked, Face.SIDE)[0]
    y = baked.cylinder.bottom + texel_centres(128) * baked.cylinder.height - 1
    expected, held = radius - np.sqrt(np.maximum(1 - y**2, 0)), np.abs(y) < 1
    assert np.abs(side.depth - expected[:, None])[held].max() < 2e-3
    assert 125 < held.sum() < 128 and np.isinf(side.depth[~held]).all()  # there is a margin above and below
    top = images_of(baked, Face.TOP)[0]
    x = (2 * texel_centres(128) - 1) * radius
    squared = x[None] ** 2 + x[:, None] ** 2
    solid = squared < 0.4  # further out, side and flanks sample it better
    depth = baked.cylinder.top - (1 + np.sqrt(np.maximum(1 - squared, 0)))
    assert np.abs(top.depth - depth)[solid].max() < 5e-3
    assert np.isinf(top.depth[squared > 1.01]).all()


def test_points_lie_on_the_surface_and_normals_point_out() -> None:
    baked = bake(sphere(columns=128, rows=64), resolution=32, layers=3)
    for image in baked.images:
        solid = np.isfinite(image.depth)
        points = FaceGrid.of(baked.cylinder, image).points(image.depth)[solid] - [0, 1, 0]
        assert np.abs(np.linalg.norm(points, axis=1) - 1).max() < 2e-3
        assert np.einsum("ni,ni->n", points, image.normal[solid]).min() > 0.99


def test_layers_are_front_faces_in_order() -> None:
    shelves = joined(*[box(1.0, 0.1, 1.0, (0, y, 0)) for y in (0.05, 0.55, 1.05)])
    baked = bake(shelves, resolution=32, layers=3)
    depths = np.array([image.depth[16, 16] for image in images_of(baked, Face.TOP)])
    assert baked.cylinder.top - depths == pytest.approx([1.1, 0.6, 0.1], abs=2e-3)


def corners_of(baked: BakedObject, face: Face, level: int) -> Array:
    """3-D corners (n, 3, 3) of the triangles of one face."""
    images = images_of(baked, face)
    points = np.stack([FaceGrid.of(baked.cylinder, image).points(image.depth).reshape(-1, 3) for image in images])
    return np.concatenate([points[layer_triangles(image, level)] for image in images])


@pytest.mark.parametrize("level", [0, 1, 2, 3])
def test_a_step_is_cut_at_every_level(level: int) -> None:
    """A post before a plate: no triangle may bridge the air between them."""
    post = joined(box(0.3, 1.0, 0.1, (0, 0.5, 0.9)), box(1.8, 1.0, 0.1, (0, 0.5, -0.5)))
    baked = bake(post, resolution=64)
    corners = corners_of(baked, Face.SIDE, level)
    assert len(corners) > 10
    z = corners[..., 2]
    bridging = (z.max(1) > 0.8) & (z.min(1) < 0.0)
    assert not bridging.any()


@pytest.mark.slow
def test_a_slope_is_not_cut() -> None:
    """Every cell of a sphere's side image is surface, at every step, except at the poles."""
    baked = bake(sphere(columns=128, rows=64), resolution=128, layers=1)
    side = images_of(baked, Face.SIDE)[0]
    for level in range(3):
        _, j0, _, j1 = grid_cells((128, 128), Face.SIDE, 1 << level)
        middle = (j0 > 12) & (j1 < 116)
        assert (side.cells[level][middle] == (1 | 1 << 7)).all()


@pytest.mark.slow
def test_a_surface_goes_on_behind_an_edge() -> None:
    """Where the post hides the plate from above, plate triangles continue on the second layer."""
    step = joined(box(2.0, 0.2, 2.0, (0, 0.1, 0)), box(0.8, 0.1, 0.8, (0, 1.0, 0)))
    baked = bake(step, resolution=128, layers=2)
    top = images_of(baked, Face.TOP)
    crossing = [np.ptp(layer_triangles(image, 0)[0], axis=1) > 0 for image in top]
    assert sum(part.sum() for part in crossing) > 100
    heights = corners_of(baked, Face.TOP, 0)[..., 1]
    assert np.ptp(heights, axis=1).max() < 0.3  # no triangle from lid to plate
    plate = np.abs(heights - 0.2).max(1) < 0.01
    area = 0.5 * (2 * baked.cylinder.radius / 128) ** 2
    assert plate.sum() * area == pytest.approx(4.0, rel=0.06)  # whole, under the lid too


@pytest.mark.slow
def test_each_surface_belongs_to_the_face_that_sees_it_squarely() -> None:
    baked = bake(box(1.0, 1.0, 1.0, (0, 0.5, 0)), resolution=128, layers=1)
    side, top = images_of(baked, Face.SIDE)[0], images_of(baked, Face.TOP)[0]
    up = top.normal[..., 1] > 0.9
    assert (top.owner[up] == Face.TOP).mean() > 0.97
    walls = np.isfinite(side.depth) & (np.abs(side.normal[..., 1]) < 0.1)
    assert not np.isin(side.owner[walls], (Face.TOP, Face.BOTTOM)).any()
    # From the middle of a wall on, the rays of the side are ever more slanted; a flank's are not.
    theta = np.broadcast_to((np.arange(128) + 0.5) / 128 * 2 * np.pi, walls.shape)
    slant = np.abs((theta + np.pi / 4) % (np.pi / 2) - np.pi / 4)
    assert (side.owner[walls & (slant > np.radians(42))] != Face.SIDE).mean() > 0.8


@pytest.mark.slow
def test_a_tread_between_two_risers_is_left_to_the_cap() -> None:
    steps = joined(box(2.0, 0.3, 2.0, (0, 0.15, 0)), box(1.2, 0.3, 1.2, (0, 0.45, 0)))
    baked = bake(steps, resolution=128, layers=2)
    side = images_of(baked, Face.SIDE)
    points = np.stack([FaceGrid.of(baked.cylinder, image).points(image.depth).reshape(-1, 3) for image in side])
    left, level = 0, 0
    for image in side:
        layer, texel = layer_triangles(image, 0)
        half, cell = triangle_places(image, 0)
        corners = points[layer, texel]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        treads = np.abs(across[:, 1]) > 0.9 * np.linalg.norm(across, axis=1)
        left += (treads & (image.cells[0][cell] >> 14 + half & 1 > 0)).sum()
        level += treads.sum()
    assert level > 100 and left > 0.9 * level


@pytest.mark.parametrize(
    ("count", "step", "wraps", "last"), [(16, 4, True, 12), (16, 4, False, 15), (17, 4, False, 16)]
)
def test_grids_reach_the_border(count: int, step: int, wraps: bool, last: int) -> None:
    assert grid_nodes(count, step, wraps)[-1] == last


def test_a_file_gives_back_what_was_written(tmp_path: Path) -> None:
    baked = bake(joined(box(1, 1, 1, (0, 0.5, 0)), box(0.2, 0.2, 0.2, (0.9, 0.5, 0))), resolution=16)
    path = tmp_path / "x.dpci.exr"
    write_baked(path, model_of(baked))
    (again,) = read_baked(path).parts
    assert again.key == baked.key and again.steps == baked.steps
    assert [image.name for image in again.images] == [image.name for image in baked.images]
    for old, new in zip(baked.images, again.images, strict=True):
        assert np.array_equal(old.depth, new.depth) and np.array_equal(old.owner, new.owner)
        assert all(np.array_equal(a, b) for a, b in zip(old.cells, new.cells, strict=True))
        assert np.abs(old.normal - new.normal).max() < 1e-3 and np.abs(old.albedo - new.albedo).max() < 1e-3
    with OpenEXR.File(str(path)) as file:  # upright in any viewer: row 0 of the file is the top
        assert file.parts[0].header["name"] == "top.0"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not an OpenEXR file"),
        (b"\x76\x2f\x31\x01" + b"\0" * 60, "not an OpenEXR file"),
        (b"hello", "not an OpenEXR file"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "x.dpci.exr"
    path.write_bytes(content)
    with pytest.raises(InputError, match=f"x.dpci.exr: {message}"):
        read_baked(path)


def test_truncated_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.dpci.exr"
    write_baked(path, model_of(bake(sphere(columns=32, rows=16), resolution=32, layers=1)))
    data = path.read_bytes()
    for part in (0.3, 0.6, 0.9):
        path.write_bytes(data[: int(len(data) * part)])
        with pytest.raises(InputError, match=r"x\.dpci\.exr"):
            read_baked(path)


def test_a_foreign_exr_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.exr"
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"R": np.zeros((4, 4), np.float32)}).write(str(path))
    with pytest.raises(InputError, match="not one of baked depth images"):
        read_baked(path)


def test_the_cache_finds_by_key_and_passes_over_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.cache.cache_folder", lambda: tmp_path / "cache")
    mesh = sphere(columns=32, rows=16)
    key = bake_key("source", resolution=32)
    assert key != bake_key("source", resolution=33) != bake_key("other", resolution=33)
    source = tmp_path / "ball.ply"
    assert find_baked(source, key) is None
    baked = model_of(replace(bake(mesh, 32, 1), key=key))
    path = keep_baked(baked)
    found = find_baked(source, key)
    assert found is not None and found.key == key
    path.write_bytes(b"damaged")
    assert find_baked(source, key) is None
    write_baked(sidecar(source), baked)
    found = find_baked(source, key)
    assert found is not None and found.key == key


def border_area(baked: BakedObject, face: Face, level: int) -> float:
    """Surface covered by one face's triangles, border included."""
    images = images_of(baked, face)
    points = np.concatenate([FaceGrid.of(baked.cylinder, image).points(image.depth).reshape(-1, 3) for image in images])
    border = next(border for border in baked.boundary_strips if (border.face, border.level) == (face, level))
    points = np.concatenate([points, FaceGrid.of(baked.cylinder, images[0]).border_points(images, border)[0]])[
        border.triangles
    ]
    corners = np.concatenate([points, corners_of(baked, face, level)])
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2


@pytest.mark.parametrize("level", [0, 1, 2])
def test_borders_complete_a_surface_to_its_edge(level: int) -> None:
    """The lid of a box, 1.0 × 0.7 m, covers a whole number of cells only by chance."""
    baked = bake(box(1.0, 0.3, 0.7, (0, 0.15, 0)), resolution=64, layers=1)
    cell = 2 * baked.cylinder.radius / 64 * 2**level
    assert border_area(baked, Face.TOP, level) == pytest.approx(0.7, abs=0.2 * cell)  # corners are cut, edges are not


def test_thin_things_do_not_fall_through_the_grid() -> None:
    """A rod thinner than a texel of the cap, hit by one row of rays."""
    rod = joined(box(1.0, 0.02, 0.015, (0, 0.5, 0.011)), box(1.0, 0.1, 1.0, (0, 0.05, 0)))
    baked = bake(rod, resolution=64, layers=2)
    images = images_of(baked, Face.TOP)
    border = next(border for border in baked.boundary_strips if (border.face, border.level) == (Face.TOP, 0))
    _, depth = FaceGrid.of(baked.cylinder, images[0]).border_points(images, border)
    on_rod = depth < 0.1
    assert on_rod.sum() > 2 * 64 / 2**0.5


@pytest.mark.parametrize(("max_stepped", "steps"), [(15, 1), (16, None), (None, None)])
def test_coarse_steps_are_left_out_of_larger_images(max_stepped: int | None, steps: int | None) -> None:
    params = BakeParams(resolution=16, layers=1)
    every, some = bake(box(1, 1, 1), 16, 1), bake_object(box(1, 1, 1), params, "ab", max_stepped=max_stepped)
    assert every.steps > 1
    assert some.steps == (steps or every.steps)
    assert all(len(image.cells) == some.steps for image in some.images)
    assert {strip.level for strip in some.boundary_strips} <= set(range(some.steps))
