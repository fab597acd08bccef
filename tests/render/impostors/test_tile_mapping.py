"""Layouts of tiles: where points of the plane lie in them."""

import numpy as np

from depthwalk.geometry.bounding_hull import prism_corners
from depthwalk.render.impostors.frustum_crop import crop_to_frustum
from depthwalk.render.impostors.tile_mapping import Tiles, plane_tiles, screen_tiles
from depthwalk.render.impostors.warp_planes import Planes, Volumes, choose_planes
from depthwalk.render.view.view import View
from depthwalk.types import Array
from stage import view_of

UPRIGHT = np.array([[0.0, 0.0, 0.0, 1.0]])


def planes_for(view: View) -> Planes:
    """The plane of a cylinder about the origin."""
    one = np.ones(1)
    volumes = Volumes(
        radius=0.5 * one, bottom=0 * one, top=2 * one, hull=prism_corners(np.full(4, 0.5), 0, 2)[None], has_side=one > 0
    )
    return choose_planes(view.position[None], volumes)


def texels(tiles: Tiles, points: Array) -> Array:
    """Texels of points (k, 2) of the plane, relative to the epipole."""
    x, y, w = tiles.texel[0] @ np.column_stack([points, np.ones(len(points))]).T
    return np.stack([x / w, y / w], -1)


def corners(planes: Planes) -> Array:
    return np.stack([planes.low[0], planes.high[0]])


def test_square_texels_cover_the_plane_and_one_more_on_every_side() -> None:
    view = view_of()
    planes, tiles = plane_tiles(planes_for(view), view.focal_pixels, 512)
    np.testing.assert_allclose(texels(tiles, corners(planes)), [[0, 0], tiles.size[0]], atol=1e-9)
    np.testing.assert_allclose(texels(tiles, corners(planes_for(view))), [[1, 1], tiles.size[0] - 1], atol=1e-9)
    assert np.isnan(tiles.pixel).all()


def test_texels_are_the_pixels_that_they_fill() -> None:
    view = view_of()
    planes, seen = crop_to_frustum(planes_for(view), view, UPRIGHT)
    tiles = screen_tiles(planes, seen, view, np.array([4.0]), 1.0, 512)
    low, high = corners(planes)
    points = np.random.default_rng(0).uniform(low, high, (50, 2))
    world = view.position + points[:, :1] * planes.right + points[:, 1:] * planes.up - planes.distance * planes.normal
    x, y, z = ((world - view.position) @ view.axes.T).T
    pixel = np.stack([(s / z / t + 1) * n / 2 for s, t, n in zip((x, y), view.half_extent, view.size, strict=True)], -1)
    np.testing.assert_allclose(texels(tiles, points) + tiles.pixel[0], pixel, atol=1e-6)


def test_a_tile_with_fewer_texels_shows_the_same_and_is_no_longer_aligned() -> None:
    view = view_of()
    planes, seen = crop_to_frustum(planes_for(view), view, UPRIGHT)
    tiles = screen_tiles(planes, seen, view, np.array([4.0]), 1.0, 512)
    half = tiles.resized(tiles.size // 2)
    low, high = corners(planes)
    points = np.random.default_rng(1).uniform(low, high, (20, 2))
    np.testing.assert_allclose(texels(half, points), texels(tiles, points) * (half.size / tiles.size), atol=1e-9)
    assert np.isnan(half.pixel).all() and np.isfinite(tiles.resized(tiles.size).pixel).all()
