"""Normals and depths in few bits, and what empty texels hold."""

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from depthwalk.bake.images import Face
from depthwalk.cook.texel_encoding import DEPTH_PERIOD, depth_code, encode_normals, image_texels
from depthwalk.gpu.device import Device
from depthwalk.gpu.shader_source import ShaderSource
from depthwalk.render.resources.depth_image_object import DEPTH_OBJECT, depth_object_record
from depthwalk.types import Array
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
    text = ShaderSource("common/depth_images.glsl", "").text + OFF
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


def code_of(depth: float) -> int:
    return int(depth_code(np.array(depth)))


def looked_up(gl_device: Device, function: str, codes: tuple[int, ...], asked: float, **uniforms: object) -> Array:
    """What a shader's `function` answers of one point, given `asked`, (4,).

    Of its image there are layers of one tile each, 12 texels a side with what is around it. All texels of a layer are
    alike: normals along x in the first and along y in the others, and one of the `codes` of depths each.
    """
    side, layers = 12, len(codes)
    stored = np.zeros((side, layers * side, 4), np.uint8)
    stored[:] = 128, 255, 128, 0
    stored[:, :side, :3] = 255, 128, 128
    stored[..., 3] = np.repeat(codes, side)
    table = np.array([[layer * side, 0] for layer in range(layers)], np.int16).reshape(layers, 1, 1, 2) + np.int16(3)
    scope = gl_device.scope("test")
    text = ShaderSource("common/depth_images.glsl", "").text + function.replace("IMAGE", str(side))
    program = gl_device.context.program(vertex_shader=text, varyings=("found",))
    scope.framebuffer([scope.texture((4, 4), 4)]).use()
    scope.texture((layers * side, side), 4, data=stored.tobytes()).use(0)
    entries = gl_device.context.texture_array((1, 1, layers), 2, table.tobytes(), dtype="i2")
    entries.use(1)
    first_images = [0, *[layers] * (len(Face) - 1)]
    values = {"first_images": first_images, "image_size": (8.0, 8.0), **uniforms}
    held = {name: values.pop(name) for name in DEPTH_OBJECT.names or () if name in values}
    scope.buffer(depth_object_record(**held)).bind_to_uniform_block(0)
    for name, value in ({"page_normals": 0, "page_table": 1} | values).items():
        program[name] = value
    content = [(scope.buffer(np.array([asked], np.float32)), "1f", "asked")]
    array = gl_device.context.vertex_array(program, content)
    out = scope.buffer(reserve=16)
    array.transform(out, moderngl.POINTS, 1)
    found = np.frombuffer(out.read(), np.float32)
    for made in array, program, entries:
        made.release()
    scope.release()
    return found


BESIDE_EDGE = """
uniform int image;  // a uniform, or unused numbers of faces vanish
in float asked;  // the depth
out vec4 found;  // normal, and the image from which the texel came
void main() {
    vec4 texel[4];
    vec2 place = vec2(6.0);
    page_normal(place, texel);
    Around around = texels_around(place);
    vec3 ahead = vec3(0.0, 0.0, -1.0);
    found.xyz = sample_border(vec3(0.0), ahead, image, vec2(0.5), depths_off(texel, asked), asked, around);
    found.w = around.at[0].x < IMAGE ? 0.0 : 1.0;
}
"""


@pytest.mark.parametrize(("behind", "taken"), [(0.0, 1), (2.5, 1), (8.0, 0), (50.0, 0)])
def test_empty_texels_take_no_other_surface_from_the_next_layer(gl_device: Device, behind: float, taken: int) -> None:
    """They hold their nearest texel: better than a surface that lies texels behind."""
    depth = 40.0  # texels
    codes = code_of(depth) ^ 128, code_of(depth + behind)  # half the period off: empty
    found = looked_up(gl_device, BESIDE_EDGE, codes, depth)
    assert found[3] == taken
    assert found[1 if taken else 0] > 0.9


def test_a_surface_is_found_layers_away(gl_device: Device) -> None:
    """As a floor is, where shelves above it end."""
    depth, before = 40.0, 20.0  # texels
    codes = code_of(before), code_of(before + 5), code_of(before + 10), code_of(depth)
    found = looked_up(gl_device, BESIDE_EDGE, codes, depth)
    assert found[3] == 1 and found[1] > 0.9


FROM_AFAR = """
uniform int image;  // a uniform, or unused numbers of faces vanish
in float asked;  // the edge of a pixel's footprint, metres
out vec4 found;
void main() { found = vec4(surface_at(vec3(0.0, 0.6, 0.0), image | EDGE, asked, vec3(0.0, 0.0, -1.0)).normal, 0.0); }
"""


@pytest.mark.parametrize("texels", [0.5, 3.0])
def test_from_afar_too_the_next_layer_shows_a_surface_beside_an_edge(gl_device: Device, texels: float) -> None:
    """Where a pixel covers several texels, means of another surface were shown."""
    cylinder = {"cylinder": (0.1, 0.0, 0.04, 0.04), "cylinder_height": 1.0, "texels": [100.0] * len(Face)}
    codes = code_of(10.0), code_of(40.0)
    found = looked_up(gl_device, FROM_AFAR, codes, texels / 100, **cylinder)  # a texel is a centimetre
    assert found[1] > 0.9 and abs(found[0]) < 0.1
