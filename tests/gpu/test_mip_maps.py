"""Mip-maps that the CPU makes: means of four, and what the GPU then reads."""

import moderngl
import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.gpu.mip_maps import Texels, mip_maps

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
    )
    texture.use(0)
    with scope.state(into=scope.framebuffer([output])):
        scope.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
    seen = np.frombuffer(output.read(), np.float32).reshape(3, 5, 4)[..., :components]
    most = np.iinfo(dtype).max
    np.testing.assert_allclose(seen * most, mip_maps(texels, 1)[0].astype(np.float32).clip(-most), atol=0.51)
    scope.release()
