"""Instance records of tiles against the mappings that they are made of."""

import numpy as np
import pytest

from depthwalk.geometry.bounding_hull import prism_corners
from depthwalk.render.impostors.tile_mapping import Tiles, plane_tiles
from depthwalk.render.impostors.tile_records import place_tiles, tile_records, warp_records
from depthwalk.render.impostors.warp_planes import Planes, Volumes, choose_planes, depths_behind
from depthwalk.scene.arrays import Objects

ATLAS = 512, 256
VIEWER = np.array([[3.0, 1.0, 0.5], [-1.0, 2.5, 4.0]])
CORNERS = np.array([[10, 20], [200, 3]])
ROTATION = np.array([[0.0, 0.6, 0.0, 0.8], [0.0, 0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def seen() -> tuple[Volumes, Planes, Tiles]:
    """Two cylinders, each from a viewer of its own: volumes, planes and tiles."""
    one = np.ones(2)
    hull = np.tile(prism_corners(np.full(4, 0.5), 0, 2), (2, 1, 1))
    volumes = Volumes(radius=0.5 * one, bottom=0 * one, top=2 * one, hull=hull, has_side=one > 0)
    return volumes, *plane_tiles(choose_planes(VIEWER, volumes), 100.0, 128)


def test_the_corners_of_a_plane_are_those_of_its_tile(seen: tuple[Volumes, Planes, Tiles]) -> None:
    """In clip space of the atlas, where the tile lies."""
    _, planes, tiles = seen
    records = warp_records(planes, tiles, CORNERS, ATLAS, ROTATION)
    for record, low, high, size, at in zip(records, planes.low, planes.high, tiles.size, CORNERS, strict=True):
        ends = []
        for point in (low, high):
            x, y, w = (record[name] @ np.append(point, 1) for name in ("to_x", "to_y", "to_w"))
            ends.append([x / w, y / w])
        np.testing.assert_allclose(ends, [2 * at / ATLAS - 1, 2 * (at + size) / ATLAS - 1], atol=1e-5)
        np.testing.assert_allclose(record["bounds"], np.ravel(ends), atol=1e-5)


def test_a_warped_object_is_described_by_its_plane(seen: tuple[Volumes, Planes, Tiles]) -> None:
    _, planes, tiles = seen
    records = warp_records(planes, tiles, CORNERS, ATLAS, ROTATION)
    np.testing.assert_allclose(records["rotation"], ROTATION, atol=1e-6)
    for name in ("right", "up", "normal"):
        np.testing.assert_allclose(records[name][:, :3], getattr(planes, name), atol=1e-6)
    np.testing.assert_allclose(
        np.column_stack([records["right"][:, 3], records["up"][:, 3]]), planes.epipole, atol=1e-6
    )
    np.testing.assert_allclose(records["normal"][:, 3], planes.offset, atol=1e-6)
    np.testing.assert_allclose(records["depths"], np.column_stack([planes.distance, tiles.nearest, [0, 0]]), atol=1e-6)


def test_a_tile_knows_whom_it_was_warped_for(seen: tuple[Volumes, Planes, Tiles]) -> None:
    volumes, planes, tiles = seen
    depths = depths_behind(planes, volumes)
    records = tile_records(VIEWER, planes, depths, tiles, CORNERS)
    np.testing.assert_allclose(records["origin"], np.column_stack([VIEWER, tiles.nearest]), rtol=1e-6)
    np.testing.assert_array_equal(records["tile"], np.column_stack([CORNERS, tiles.size]))
    np.testing.assert_allclose(records["normal"][:, 3], planes.distance, rtol=1e-6)
    nearest, farthest = records["high"][:, 2:].T
    assert (farthest > 0).all() and (farthest < nearest).all()  # λ falls with the distance
    np.testing.assert_allclose(farthest, planes.distance / (planes.distance + depths[:, 1]), rtol=1e-6)
    np.testing.assert_allclose(records["diagonals"], planes.diagonals, rtol=1e-6)
    for record, mapping in zip(records, tiles.texel, strict=True):
        np.testing.assert_allclose([record[name] for name in ("to_x", "to_y", "to_w")], mapping, rtol=1e-5, atol=1e-6)


def test_objects_are_placed_in_the_order_of_their_numbers(seen: tuple[Volumes, Planes, Tiles]) -> None:
    volumes, planes, tiles = seen
    before = tile_records(VIEWER, planes, depths_behind(planes, volumes), tiles, CORNERS)
    turned = np.array([[0, 0, 0, 1], [0, 1, 0, 0], [1, 0, 0, 0]], np.float32)
    objects = Objects(
        asset=np.zeros(3, np.int32),
        position=np.zeros((3, 3), np.float32),
        rotation=turned,
        scale=np.array([2, 3, 4], np.float32),
        representation=np.zeros(3, np.uint8),
    )
    viewers = np.concatenate([VIEWER + 0.5, VIEWER[:1] - 1])
    records = place_tiles(before, np.array([1, 0]), viewers[[2, 1]], objects, np.array([2, 1]))
    np.testing.assert_array_equal(records["viewer"], np.column_stack([viewers[[2, 1]], [4, 3]]).astype(np.float32))
    np.testing.assert_array_equal(records["rotation"], turned[[2, 1]])
    np.testing.assert_array_equal(records["objects"], [[0, 1], [1, 1]])
    for name in ("right", "high", "origin", "tile"):
        np.testing.assert_array_equal(records[name], before[name][[1, 0]])
