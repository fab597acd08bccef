"""The uniform block `View`: its layout against the driver's, what it holds, and how long."""

import ctypes
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest
from moderngl import UniformBlock

from depthwalk.gpu.device import Device, Scope
from depthwalk.gpu.program import Program
from depthwalk.render.shadows.cascades import Cascade, light_axes
from depthwalk.render.shadows.spot_maps import Spot
from depthwalk.render.view.view import View, matrix_array
from depthwalk.render.view.view_block import MAP_VIEW, PICTURE_VIEW, VIEW_BLOCK, ViewBlock, map_record, picture_record
from depthwalk.scene.arrays import Camera
from depthwalk.types import Array

SHADERS: dict[str, Any] = {
    "vertex": "common/far_plane.vert",
    "fragment": "common/pixel_passes.frag",
    "defines": ("SKY", "DRAW_PASSES=draw_light(pixel);", "RESULT=pixel.lit"),
    "includes": ("light/light.glsl",),
}
UNIFORM_OFFSET, INVALID_INDEX = 0x8A3B, 0xFFFFFFFF


@pytest.fixture
def view() -> View:
    camera = Camera((1.0, 2.0, 3.0), (0.5, 0.0, -4.0), 0.8)
    return View(camera, (64, 48), near=0.25, far=80.0, shear=(0.01, -0.02))


def gl_function(name: str) -> Any:
    """A GL function that moderngl does not wrap."""
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype, egl.eglGetProcAddress.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 5)(egl.eglGetProcAddress(name.encode()))


def test_the_layout_is_the_drivers(gl_device: Device) -> None:
    scope = gl_device.scope("test")
    program = Program(scope, **SHADERS)
    names, block = VIEW_BLOCK.names, program.gl["View"]
    assert names is not None and isinstance(block, UniformBlock)
    count, texts = len(names), (ctypes.c_char_p * len(names))(*(name.encode() for name in names))
    indices, offsets = (ctypes.c_uint * count)(), (ctypes.c_int * count)()
    gl_function("glGetUniformIndices")(program.gl.glo, count, texts, indices, None)
    gl_function("glGetActiveUniformsiv")(program.gl.glo, count, indices, UNIFORM_OFFSET, offsets)
    assert INVALID_INDEX not in list(indices)
    assert VIEW_BLOCK.fields is not None
    assert list(offsets) == [VIEW_BLOCK.fields[name][1] for name in names]
    assert block.size == VIEW_BLOCK.itemsize
    scope.release()


def test_a_picture_is_described_as_its_view_says(view: View) -> None:
    record = picture_record(view)
    np.testing.assert_allclose(record["clip_from_eye"].T, matrix_array(view.clip_from_eye), rtol=1e-6)
    np.testing.assert_allclose(record["ray_from_screen"][:, :3].T, view.ray_from_screen, rtol=1e-6)
    assert record["eye"].tolist() == [0, 0, 0, 1] and record["view_position"].tolist() == [1, 2, 3]
    assert record["pixel_angle"] == np.float32(1 / view.focal_pixels)
    assert record["depth_range"].tolist() == [0.25, 80.0] and record["view_size"].tolist() == [64, 48]
    clip = matrix_array(view.clip_from_eye) @ [*(view.axes[2] * 7), 1.0]  # 7 m along the view axis
    x, y = record["depth_from_inverse"]
    assert x - y / clip[3] == pytest.approx((clip[2] / clip[3] + 1) / 2, abs=1e-6)


@pytest.mark.parametrize(
    "seen",
    [
        Cascade(centre=(1.0, 2.0, 3.0), half=4.0, axes=light_axes(np.array([0.3, 0.9, 0.1])), resolution=256),
        Spot(centre=(1.0, 2.0, 3.0), axes=light_axes(np.array([0.3, 0.9, 0.1])), angle=1.0, reach=9.0, resolution=256),
    ],
    ids=["sun", "spot"],
)
def test_a_shadow_map_has_a_view_of_its_own(seen: Cascade | Spot) -> None:
    record = map_record(seen)
    np.testing.assert_allclose(record["clip_from_eye"].T, matrix_array(seen.clip_from_centre), rtol=1e-6)
    np.testing.assert_allclose(record["eye"], seen.light, rtol=1e-6)
    assert record["view_position"].tolist() == [1, 2, 3] and record["view_size"].tolist() == [256, 256]
    assert record["pixel_angle"] == np.float32(seen.texel)


def test_a_view_must_be_fitted(gl_device: Device, view: View) -> None:
    scope = gl_device.scope("test")
    with pytest.raises(ValueError, match="not fitted"):
        ViewBlock(scope, PICTURE_VIEW).show(replace(view, near=None))
    scope.release()


def shown_rays(scope: Scope, program: Program, size: tuple[int, int]) -> Array:
    """What light.glsl makes of the rays, (H · W, 3): with a zenith of 1 over a horizon of 0, how far up they point."""
    out = scope.texture(size, 4, "f4")
    scope.framebuffer([out]).use()
    program.set(zenith=(1.0, 1.0, 1.0), horizon=(0.0, 0.0, 0.0))
    program.fill()
    return np.frombuffer(out.read(), np.float32).reshape(-1, 4)[:, 0]


def test_each_program_reads_the_view_of_its_binding_point(gl_device: Device, view: View) -> None:
    """Another view in one point leaves the other as it is; showing a view again writes nothing else."""
    scope = gl_device.scope("test")
    gl_device.context.enable_only(moderngl.NOTHING)
    picture, shadow = Program(scope, **SHADERS), Program(scope, **SHADERS, blocks={"View": MAP_VIEW})
    blocks = ViewBlock(scope, PICTURE_VIEW), ViewBlock(scope, MAP_VIEW)
    up = replace(view, camera=Camera((0, 0, 0), (0.1, 1.0, 0.0), 0.8))
    down = replace(view, camera=Camera((0, 0, 0), (0.1, -1.0, 0.0), 0.8))
    blocks[0].show(up)
    blocks[1].show(down)
    assert shown_rays(scope, picture, view.size).min() > 0.8 and shown_rays(scope, shadow, view.size).max() == 0
    blocks[1].show(up)
    assert shown_rays(scope, shadow, view.size).min() > 0.8
    blocks[0].show(down)
    blocks[0].show(down)
    assert shown_rays(scope, picture, view.size).max() == 0 and shown_rays(scope, shadow, view.size).min() > 0.8
    scope.release()
