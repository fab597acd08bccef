"""A single planar depth image as an object; range images are tested in tests/render/test_range_picture.py."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import Face
from depthwalk.bake.planar import bake_planar, connect_texels
from depthwalk.ingest.image import PlanarImage
from depthwalk.types import Array


def picture(depth: Array, size: tuple[float, float] = (0.8, 0.6)) -> PlanarImage:
    normal = np.zeros((*depth.shape, 3), np.float32)
    normal[..., 2] = 1
    colour = np.full((*depth.shape, 3), 255, np.uint8)
    return PlanarImage(depth=depth.astype(np.float32), colour=colour, normal=normal, size=size)


def test_texels_stand_where_the_picture_has_them() -> None:
    height, width = 24, 32
    depth = 0.01 * (np.arange(height)[:, None] / height + np.arange(width) / width)
    baked = bake_planar(picture(depth), "key")
    (image,) = baked.images
    assert image.face is Face.TOP and baked.key == "key"
    inside = FaceGrid.of(baked.cylinder, image).points(image.depth).reshape(-1, 3)
    points = Rotation.from_quat(baked.rotation).apply(inside) + baked.position
    x, y = np.meshgrid(0.8 * ((np.arange(width) + 0.5) / width - 0.5), 0.6 * (np.arange(height) + 0.5) / height)
    expected = np.stack([x, y, -depth], -1)[::-1].reshape(-1, 3)  # the cap's rows run from the picture's top down
    np.testing.assert_allclose(points, expected, atol=1e-6)


def test_normals_stay_toward_the_viewer() -> None:
    baked = bake_planar(picture(np.zeros((16, 16))), "")
    turned = Rotation.from_quat(baked.rotation).apply(baked.images[0].normal.reshape(-1, 3))
    np.testing.assert_allclose(turned, np.tile([0, 0, 1.0], (256, 1)), atol=1e-6)


def test_no_triangle_spans_a_tear_or_a_hole() -> None:
    depth = np.zeros((16, 16), np.float32)
    depth[:, 8:] = 5.0
    depth[3, 3] = np.inf
    cells = connect_texels(depth, 0.05, 2)
    lower, upper = (cells[0].reshape(15, 15) >> shift & 1 for shift in (0, 7))
    assert not lower[:, 7].any() and not upper[:, 7].any()
    assert lower[:, 8:].all() and upper[:, 8:].all()
    assert (lower[:, :7] == 0).sum() == (upper[:, :7] == 0).sum() == 3  # those with a corner at the hole


def test_as_published_every_texel_is_connected_but_to_holes():
    depth = np.zeros((16, 16), np.float32)
    depth[:, 8:] = 5.0
    depth[3, 3] = np.inf
    lower, upper = (connect_texels(depth, 0.05, 2, cut=False)[0].reshape(15, 15) >> shift & 1 for shift in (0, 7))
    assert (lower == 0).sum() == (upper == 0).sum() == 3


@pytest.mark.parametrize("slope", [0.0, 0.5])
def test_a_slope_is_whole_at_every_level(slope: float) -> None:
    depth = (0.05 * slope * np.arange(32) * np.ones((32, 1))).astype(np.float32)
    for codes in connect_texels(depth, 0.05, 3):
        assert (codes == (1 | 1 << 7)).all()
