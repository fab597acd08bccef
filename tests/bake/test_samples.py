"""What a face sees of a mesh; how it is looked up is tested in test_surface.py."""

import numpy as np

from depthwalk.bake.raycast import RayCaster, no_hits
from depthwalk.bake.samples import face_samples
from shapes import box


def test_empty_faces_have_empty_samples() -> None:
    seen = face_samples(box(1.0, 1.0, 1.0), no_hits(2, 12), (3, 4))
    assert np.isinf(seen.samples.depth).all() and seen.samples.depth.shape == (2, 3, 4)
    assert not seen.normal.any() and not seen.albedo.any()


def test_texels_are_in_the_order_of_their_rays() -> None:
    mesh = box(1.0, 1.0, 1.0)
    origin = np.array([[0.1 * ray, 2.0 + ray, 0] for ray in range(4)], np.float32)
    down = np.tile(np.array([0, -1, 0], np.float32), (4, 1))
    seen = face_samples(mesh, RayCaster(mesh).peel(origin, down, 1, 9.0), (2, 2))
    np.testing.assert_allclose(seen.samples.depth, [[[1.5, 2.5], [3.5, 4.5]]], rtol=1e-6)
    np.testing.assert_allclose(seen.samples.facing[0], np.broadcast_to([0, 1, 0], (2, 2, 3)), atol=1e-6)
