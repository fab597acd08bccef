"""Normals and depths in few bits, and what empty texels hold."""

from dataclasses import replace

import moderngl
import numpy as np

from depthwalk.cook.texel_encoding import DEPTH_PERIOD, depth_code, encode_normals, image_texels
from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Source
from shapes import bake, sphere


def test_empty_texels_hold_their_neighbours_far_away() -> None:
    baked = bake(sphere(0.5, 48, 24), 32)
    image = next(image for image in baked.images if 0 < np.isfinite(image.depth).sum() < image.depth.size)
    solid = np.isfinite(image.depth)
    texels = image_texels(baked.cylinder, replace(image, albedo=np.where(solid[..., None], image.albedo + 0.5, 0)))
    assert texels[..., 4:].min() > 0.5 * 65535  # nothing black, which would be filtered in
    row, column = np.argwhere(solid & ~np.roll(solid, 1, axis=1))[0]
    if column:
        np.testing.assert_array_equal(texels[row, column - 1, :3], texels[row, column, :3])
        assert texels[row, column - 1, 3] == texels[row, column, 3] ^ 128  # half the period


def test_normals_keep_their_direction_in_eight_bits() -> None:
    """Twice as well as rounded as they are, and as long as each other within what blending forgives."""
    normal = np.random.default_rng(5).normal(size=(20_000, 3))
    normal[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    decoded, rounded = encode_normals(normal) / 127.5 - 1, np.round((normal + 1) * 127.5) / 127.5 - 1
    length = np.linalg.norm(decoded, axis=1)
    assert length.min() > 0.85 and length.max() < 1.005
    angle, plain = (
        np.linalg.norm(np.cross(vector, normal), axis=1) / np.linalg.norm(vector, axis=1)
        for vector in (decoded, rounded)
    )
    assert np.sqrt((angle**2).mean()) < 0.55 * np.sqrt((plain**2).mean())
    assert angle.max() < 0.007


OFF = """
in vec2 both;
out float off;
void main() { off = depth_off(both.x, both.y); }
"""


def test_depths_are_told_apart_by_their_remainders(gl_device: Device) -> None:
    rng = np.random.default_rng(6)
    stored, depth = rng.uniform(0, 900, 2000), rng.uniform(0, 900, 2000)
    depth[:1000] = stored[:1000] + rng.uniform(-3, 3, 1000)
    asked = np.column_stack([depth_code(stored) / 255, depth]).astype(np.float32)
    scope = gl_device.scope("test")
    text = Source("common/depth_images.glsl", "").text + OFF
    program = gl_device.context.program(vertex_shader=text, varyings=("off",))
    scope.framebuffer([scope.texture((4, 4), 4)]).use()
    array = gl_device.context.vertex_array(program, [(scope.buffer(asked), "2f", "both")])
    out = scope.buffer(reserve=4 * len(asked))
    array.transform(out, moderngl.POINTS)
    found = np.frombuffer(out.read(), np.float32)
    array.release()
    program.release()
    scope.release()
    half = DEPTH_PERIOD / 2
    expected = np.abs((stored - depth + half) % DEPTH_PERIOD - half)
    assert np.abs(found - expected).max() < 0.26
