"""Mip-maps that the CPU makes: means of four, and what the GPU then reads."""

import moderngl
import numpy as np
import pytest

from depthwalk.colour import linear_from_srgb8, srgb8_from_linear
from depthwalk.gpu.device import Device
from depthwalk.gpu.mip_maps import Texels, mip_maps, srgb_mip_maps

KINDS = [(1, np.uint8), (2, np.uint8), (3, np.uint8), (4, np.uint8), (1, np.int8), (2, np.int8)]


def _texels(shape: tuple[int, int, int], dtype: type = np.uint8) -> Texels:
    limits = np.iinfo(dtype)
    texels: Texels = np.random.default_rng(0).integers(limits.min, limits.max, shape, endpoint=True).astype(dtype)
    return texels


@pytest.mark.parametrize(("components", "dtype"), KINDS)
def test_each_texel_is_the_mean_of_four(components: int, dtype: type) -> None:
    before = _texels((8, 12, components), dtype)
    for after in mip_maps(before, 2):
        height, width = before.shape[0] // 2, before.shape[1] // 2
        mean = before.astype(np.float64).reshape(height, 2, width, 2, components).mean(axis=(1, 3))
        assert after.dtype == dtype and after.shape == mean.shape
        np.testing.assert_array_equal(after, np.floor(mean + 0.5))
        before = after


def test_odd_pictures_have_no_mip_maps() -> None:
    assert not mip_maps(_texels((1, 1, 4)), 2)
    assert len(mip_maps(_texels((6, 4, 4)), 2)) == 1


@pytest.mark.gl
@pytest.mark.parametrize(("components", "dtype"), KINDS)
def test_the_gpu_has_them(gl_device: Device, components: int, dtype: type) -> None:
    scope, texels = gl_device.scope("test"), _texels((6, 10, components), dtype)
    texture = scope.mipmapped_texture(texels, 1)
    output = scope.texture((5, 3), 4, "f4")
    program = scope.program(
        "#version 330\nvoid main() { gl_Position = vec4(gl_VertexID % 2 * 4 - 1, gl_VertexID / 2 * 4 - 1, 0, 1); }",
        "#version 330\nuniform sampler2D image; out vec4 c;\n"
        "void main() { c = textureLod(image, gl_FragCoord.xy / vec2(5, 3), 7.0); }",
    ).gl
    texture.use(0)
    with scope.state(into=scope.framebuffer([output])):
        scope.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
    seen = np.frombuffer(output.read(), np.float32).reshape(3, 5, 4)[..., :components]
    most = np.iinfo(dtype).max
    np.testing.assert_allclose(seen * most, mip_maps(texels, 1)[0].astype(np.float32).clip(-most), atol=0.51)
    scope.release()


@pytest.mark.parametrize("shape", [(8, 8), (4, 32), (16, 1), (1, 1)])
def test_mip_maps_of_srgb_are_means_of_light_down_to_one_texel(shape: tuple[int, int]) -> None:
    texels = np.random.default_rng(0).integers(0, 256, (*shape, 4), np.uint8)
    made = srgb_mip_maps(texels)
    assert len(made) == max(shape).bit_length() - 1
    for level, seen in enumerate(made, start=1):
        height, width = (max(side >> level, 1) for side in shape)
        blocks = texels.reshape(height, shape[0] // height, width, shape[1] // width, 4)
        expected = srgb8_from_linear(linear_from_srgb8(blocks[..., :3]).mean(axis=(1, 3)))
        np.testing.assert_allclose(seen[..., :3].astype(int), expected, atol=1)
        np.testing.assert_allclose(seen[..., 3], blocks[..., 3].mean(axis=(1, 3)), atol=1)


def test_mip_maps_of_one_colour_keep_it() -> None:
    every = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 4, -1)
    for texel in every:
        assert all((level == texel).all() for level in srgb_mip_maps(np.tile(texel, (4, 4, 1))))


@pytest.mark.gl
@pytest.mark.parametrize("shape", [(4, 8), (6, 10)])
def test_the_gpu_averages_light_of_srgb(gl_device: Device, shape: tuple[int, int]) -> None:
    scope, texels = gl_device.scope("test"), np.zeros((*shape, 4), np.uint8)
    texels[::2] = 255
    texture = scope.srgb_texture(texels)
    output = scope.texture((1, 1), 4, "f4")
    program = scope.program(
        "#version 330\nvoid main() { gl_Position = vec4(gl_VertexID % 2 * 4 - 1, gl_VertexID / 2 * 4 - 1, 0, 1); }",
        "#version 330\nuniform sampler2D image; out vec4 c;\nvoid main() { c = textureLod(image, vec2(0.5), 9.0); }",
    ).gl
    texture.use(0)
    with scope.state(into=scope.framebuffer([output])):
        scope.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
    np.testing.assert_allclose(np.frombuffer(output.read(), np.float32), 0.5, atol=0.01)
    scope.release()
