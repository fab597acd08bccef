"""The pre-warp of relief texture mapping, against rays through the texels of the picture's plane."""

import numpy as np
import pytest

from depthwalk.bake.planar import bake_planar
from depthwalk.reference.height_field import first_hits
from depthwalk.render.relief_prewarp import MAX_SIDE, PlaneImages, plane_images, prewarp, segment_order, warped_lines
from depthwalk.render.resources.relative_depth import EMPTY, relative_depth
from depthwalk.types import Array
from fields import HEIGHT, RANGE, SIDE, VIEWS, WIDTH, depths, image_of

FRONT, ASIDE = (
    view.position * [1 / WIDTH, -1 / HEIGHT, -1 / (1.0001 * RANGE)] + [0.5, 1, 0] for view in VIEWS.values()
)


def rays_through_texels(depth: Array, viewer: Array, images: PlaneImages) -> Array:
    """λ of what rays through the texels (rows, columns) of an image meet, 0 for nothing."""
    columns, rows = images.count[0]
    row, column = np.mgrid[:rows, :columns]
    at = images.low[0] + images.step[0] * np.stack([column, row], -1)
    on_plane = np.concatenate([(at + 0.5) / depth.shape[::-1], np.zeros((rows, columns, 1))], -1).reshape(-1, 3)
    found = first_hits(depth, viewer, on_plane - viewer, 150, 12).reshape(rows, columns)
    return np.where(np.isnan(found), 0, 1 / np.where(np.isnan(found), 1, found))


@pytest.mark.parametrize(
    ("kind", "viewer", "most"),
    [
        ("ramp", FRONT, 0.0),
        ("ramp", ASIDE, 0.0),
        ("cap", FRONT, 0.0),
        ("cap", ASIDE, 0.01),  # where the surface hides itself, the first pass drops what the second would move apart
        ("step", FRONT, 0.02),  # the column of texels in which the edge lies
        ("wire", ASIDE, 0.02),
    ],
)
def test_texels_show_what_rays_through_them_meet(kind: str, viewer: Array, most: float) -> None:
    depth = relative_depth(bake_planar(image_of(depths(kind)), "field", cut=False))
    images = plane_images(depth.shape, viewer[None])
    warped, true = prewarp(depth, viewer[None], images)[0], rays_through_texels(depth, viewer, images)
    both, either = (warped > 0) & (true > 0), (warped > 0) | (true > 0)
    assert (np.abs(warped - true)[both] > 1e-3).mean() <= most
    assert (either & ~both).sum() / either.sum() < 0.03  # rims, where a ray just meets or just misses
    assert ((true > 0) & (warped == 0)).sum() / either.sum() < 0.002


def test_a_picture_on_the_plane_stays_as_it_is() -> None:
    depth = np.zeros((6, 9), np.float32)
    depth[2, 3] = EMPTY
    images = plane_images(depth.shape, np.array([[0.3, 0.6, -2.0]]))
    warped = prewarp(depth, np.array([[0.3, 0.6, -2.0]]), images)
    assert images.low.tolist() == [[0, 0]] and images.step.tolist() == [[1, 1]] and images.count.tolist() == [[9, 6]]
    np.testing.assert_array_equal(warped[0, :, 4:], 1)
    assert warped[0, 2, 3] == 0


def test_what_is_behind_moves_toward_the_epipole() -> None:
    """A texel D behind the plane, seen from D in front of it, goes half the way."""
    ratio = np.where(np.arange(9) == 4, 1.0, 0.5).astype(np.float32)[None]
    moved = warped_lines(ratio, 4.0, 0.0, 0.5, 17)[0]
    assert np.flatnonzero(moved).tolist() == list(range(4, 13))  # from 2 to 6, two to a texel
    assert moved[8] == 1 and moved[4] == moved[12] == 0.5


def test_the_nearer_one_stays_in_front() -> None:
    """A far texel that is moved past a near one is behind it, from either side."""
    ratio = np.ones((1, 21), np.float32)
    ratio[0, [0, 1, 2, 18, 19, 20]] = 0.4
    moved = warped_lines(ratio, 10.0, 0.0, 1.0, 21)[0]
    assert (moved[3:18] == 1).all() and not moved[[0, 1, 2, 18, 19, 20]].any()


@pytest.mark.parametrize("epipole", [-3.0, 0.0, 2.0, 2.4, 5.0, 9.5])
def test_segments_are_drawn_toward_the_epipole(epipole: float) -> None:
    order = segment_order(6, epipole)
    assert sorted(order) == list(range(5))
    away = np.abs(order + 0.5 - epipole)
    left, right = away[order + 1 <= epipole], away[order >= epipole]
    assert (np.diff(left) < 0).all() and (np.diff(right) < 0).all()
    across = np.flatnonzero((order < epipole) & (epipole < order + 1))
    assert across.tolist() in ([], [4])


def test_images_are_bounded_however_one_looks() -> None:
    """Even along the plane, from far away; they then are coarser, and end where the box's back is seen."""
    viewer = np.array([[4000.0, 0.4, -1e-12], [0.5, 0.5, -3.0], [-7.0, 90.0, -0.01]])
    images = plane_images((1500, 40), viewer)
    assert (images.count[:, 0] <= 80).all() and (images.count[:, 1] <= MAX_SIDE).all()
    assert images.step[1].tolist() == [1, 1] and images.step[0, 0] > 1000
    ends = images.low + images.step * (images.count - 1)
    at_back = viewer[:, 2] / (viewer[:, 2] - 1)
    last = np.array([39, 1499])
    epipole = viewer[:, :2] * (40, 1500) - 0.5
    assert (ends >= np.maximum(last, epipole + (last - epipole) * at_back[:, None]) - 1e-6).all()
    warped = prewarp(np.full((1500, 40), 0.5, np.float32), viewer, images)
    assert warped.shape == (3, *images.count.max(0)[::-1]) and np.isfinite(warped).all() and warped[1].any()


def test_several_viewers_have_an_image_each() -> None:
    depth = relative_depth(bake_planar(image_of(depths("cap")), "field", cut=False))
    viewers = np.stack([FRONT, ASIDE])
    both = prewarp(depth, viewers, plane_images((SIDE, SIDE), viewers))
    for image, viewer in zip(both, viewers[:, None], strict=True):
        alone = prewarp(depth, viewer, plane_images((SIDE, SIDE), viewer))[0]
        np.testing.assert_array_equal(image[: alone.shape[0], : alone.shape[1]], alone)
