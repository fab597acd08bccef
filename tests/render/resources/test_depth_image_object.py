"""Depth images on the GPU: geometry comes back as it was cooked, and every object has an owner."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from depthwalk.bake.meso import Meso
from depthwalk.cook.cook import CookedObject, CookOptions, cook_object
from depthwalk.cook.lod_geometry import vertex_positions
from depthwalk.cook.texture_detail import Detail
from depthwalk.gpu.device import Device, Scope
from depthwalk.gpu.shader_source import ShaderSource
from depthwalk.render.resources.depth_image_object import DEPTH_OBJECT, DEPTH_OBJECT_BLOCK, DepthObject, upload_depth
from depthwalk.render.resources.surface_texture import upload_texture
from shapes import bake, sphere


@pytest.fixture(scope="module")
def cooked() -> CookedObject:
    return cook_object(bake(sphere(columns=64, rows=32), 32, 1), CookOptions())


@pytest.fixture
def scope(gl_device: Device) -> Iterator[Scope]:
    made = gl_device.scope("test")
    yield made
    made.release()


def upload(scope: Scope, cooked: CookedObject) -> DepthObject:
    """The whole object, texture and all."""
    grids, pages = cooked.load()
    uploaded = upload_depth(scope, cooked.outline, grids)
    uploaded.show_texture(scope, upload_texture(scope, pages, Detail.FULL))
    return uploaded


def test_geometry_comes_back_as_it_was_cooked(scope: Scope, cooked: CookedObject) -> None:
    grids, _ = cooked.load()
    uploaded = upload(scope, cooked)
    positions, triangles = uploaded.shape([(0, 300), (300, 30)])
    assert triangles.shape == (110, 3)
    low, size = (np.array(bound, np.float32) for bound in (grids.box_low, grids.box_size))
    samples = np.asarray(grids.vertices).view(np.uint16).reshape(-1, 4)
    known = {tuple(point) for point in vertex_positions(samples, low, size).astype(np.float32).tolist()}
    assert {tuple(point) for point in positions.tolist()} <= known
    assert np.linalg.norm(positions - [0, 1, 0], axis=1) == pytest.approx(np.ones(len(positions)), abs=0.15)


def test_everything_is_owned_and_freed(scope: Scope, cooked: CookedObject, gl_device: Device) -> None:
    before = dict(+gl_device.live)
    uploaded = upload(scope, cooked)
    assert uploaded.bytes == cooked.bytes
    assert sum(gl_device.live.values()) == sum(before.values()) + len(uploaded.owned)
    scope.free(*uploaded.owned)
    assert dict(+gl_device.live) == before


def test_shaders_read_what_the_block_holds(scope: Scope, cooked: CookedObject, gl_device: Device) -> None:
    """The last field of each row of the block and all arrays, which std140 pads."""
    body = "\n".join(
        [
            "flat out vec4 lengths; flat out vec4 numbers;",
            "void main() {",
            "    lengths = vec4(cylinder.w, setback, image_size.y, colour_axes[2].w);",
            "    numbers = vec4(first_images[1], texels[1], first_rows[1], stored_colour_level);",
            "}",
        ]
    )
    text = ShaderSource("common/depth_object.glsl", "").text + body
    program: Any = gl_device.context.program(vertex_shader=text, varyings=("lengths", "numbers"))
    assert program["DepthObject"].size == DEPTH_OBJECT.itemsize  # GPUs may read beyond a smaller buffer
    program["DepthObject"].binding = DEPTH_OBJECT_BLOCK["DepthObject"]
    record, out = upload(scope, cooked).record, scope.buffer(reserve=32)
    record["colour_axes"], record["first_rows"][1, 0], record["colour_level"] = np.arange(12), 5, 2
    scope.buffer(record).bind_to_uniform_block(DEPTH_OBJECT_BLOCK["DepthObject"])
    scope.framebuffer([scope.texture((4, 4), 4)]).use()
    gl_device.context.vertex_array(program, []).transform(out, moderngl.POINTS, vertices=1)
    held = [record["cylinder"][3], record["setback"], record["image_size"][1], 11]
    held += [record["first_images"][1, 0], record["texels"][1, 0], 5, 2]
    program.release()
    assert np.frombuffer(out.read(), np.float32).tolist() == [float(value) for value in held]


def test_relief_is_a_define_and_a_texture(scope: Scope, cooked: CookedObject) -> None:
    plain = upload(scope, cooked)
    assert plain.defines == () and plain.record["meso_height"] == 0 and plain.meso.size == (1, 1)
    meso = Meso(relief=np.zeros((4, 8, 3), np.float32), tile=(0.5, 0.25), height=0.1)
    rough = upload(scope, replace(cooked, outline=replace(cooked.outline, meso=meso)))
    assert rough.defines == ("MESO",) and rough.meso.size == (8, 4)
    assert rough.record["meso_height"] == pytest.approx(0.1) and rough.record["meso_turn"] == 13
    assert set(rough.surface_defines) == {"MESO", *plain.surface_defines}
