"""Bars as the shader draws them, and as a picture needs them: without gaps."""

import numpy as np
import pytest

from depthwalk.bake.planar import bake_planar
from depthwalk.gpu.device import Device
from depthwalk.reference.bar_texture import bar_distances
from depthwalk.render.resources.bars import bar_ends, bar_triangles
from depthwalk.render.resources.relative_depth import relative_depth
from depthwalk.render.view.view import View, matrix_array
from depthwalk.scene.arrays import Representation
from depthwalk.types import Array
from fields import HEIGHT, VIEWS, WIDTH, drawn_distance, image_of
from stage import SIZE


def clip_of(view: View, u: Array, v: Array, depth: Array) -> Array:
    """Clip coordinates of points of a field that stands upright at the origin; depth in metres."""
    points = np.stack([(u - 0.5) * WIDTH, (1 - v) * HEIGHT, -depth], -1)
    eye = points - view.position
    return np.column_stack([eye, np.ones(len(eye))]) @ np.asarray(matrix_array(view.clip_from_eye), np.float64).T


@pytest.mark.parametrize("view", VIEWS)
def test_the_shader_draws_the_same_strips(gl_device: Device, view: str) -> None:
    side = 16
    y, x = (np.mgrid[:side, :side] + 0.5) / side * 2 - 1
    depth = np.where(np.hypot(x - 0.2, y) < 0.5, 0.05 + 0.1 * x**2, 0.28 - 0.1 * y).astype(np.float32)
    baked = bake_planar(image_of(depth), "field", cut=False)
    ends = bar_ends(relative_depth(baked), np.ones(depth.shape, bool)) * baked.cylinder.height
    rows, columns = np.indices(depth.shape).reshape(2, -1)
    (near, far), half = ends.reshape(-1, 2).T.astype(float), 0.5 / side
    u, v = (columns + 0.5) / side, (rows + 0.5) / side
    eye = VIEWS[view]
    found = drawn_distance(gl_device, depth, Representation.BAR_TEXTURE, eye)
    expected = bar_distances(
        clip_of(eye, u, v, near),
        clip_of(eye, u, v, far),
        clip_of(eye, u + half, v, near),
        clip_of(eye, u, v + half, near),
        SIZE,
    )
    either = np.isfinite(found) | np.isfinite(expected)
    with np.errstate(invalid="ignore"):
        off = np.abs(found - expected) > 1e-3
    assert either.mean() > 0.2 and off[either].mean() < 0.005  # pixels on the edge of a strip


def test_a_bar_ends_at_its_deepest_neighbour() -> None:
    depth = np.array([[0.1, 0.4, 0.2], [0.3, 0.9, 0.2]], np.float32)
    solid = np.ones((2, 3), bool)
    assert bar_ends(depth, solid)[..., 0].tolist() == depth.tolist()
    assert bar_ends(depth, solid)[..., 1].tolist() == np.array([[0.4, 0.9, 0.4], [0.9, 0.9, 0.9]], np.float32).tolist()
    solid[1, 1] = False  # nothing is there to be reached
    expected = np.array([[0.4, 0.4, 0.4], [0.3, 0.0, 0.2]], np.float32)
    assert bar_ends(depth, solid)[..., 1].tolist() == expected.tolist() and bar_ends(depth, solid)[1, 1, 0] == 0


def test_only_texels_with_a_surface_have_bars() -> None:
    solid = np.array([[False, True], [True, False]])
    assert bar_triangles(solid).tolist() == [4, 5, 6, 6, 5, 7, 8, 9, 10, 10, 9, 11]
    assert bar_triangles(np.zeros((2, 2), bool)).tolist() == [0, 0, 0]
