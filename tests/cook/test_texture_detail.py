"""What is left of a virtual texture shows the same wherever no finer texels are asked for."""

from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from depthwalk.bake.images import BakedObject
from depthwalk.cook import texture_detail
from depthwalk.cook.simplified_lods import build_simplified_lods
from depthwalk.cook.texture_detail import Detail, at_detail, can_leave_out, detail_for
from depthwalk.cook.virtual_texture import VirtualTexture, build_virtual_texture
from depthwalk.gpu.device import Device
from depthwalk.gpu.shader_source import ShaderSource
from depthwalk.render.resources.depth_image_object import depth_object_record
from depthwalk.render.resources.surface_texture import upload_texture
from shapes import bake, box, joined, sphere

LOOK_UP = """
in vec2 uv;
in float lod;
uniform int image;
out vec4 normal, colour;
void main() {
    int tier;
    vec3 place = page_at(image, uv, lod, tier);
    normal = page_texel(page_normals, place);
    colour = page_colour(place);
}
"""


@pytest.fixture(scope="module")
def baked() -> BakedObject:
    """A brown ball over a plinth of a darker brown: caps, several layers and much that is empty."""
    ball = sphere(0.5, 48, 24, colour=(210, 190, 160))
    return bake(joined(ball, box(1.6, 0.2, 1.0, (0.3, -0.4, 0.1), colour=(105, 95, 80))), resolution=96, layers=2)


@pytest.fixture(scope="module", params=["plain", "pca"])
def texture(request: pytest.FixtureRequest, baked: BakedObject) -> Iterator[VirtualTexture]:
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "pca":
            patch.setattr("depthwalk.cook.colour_pca._SMALL", 0)
            patch.setattr("depthwalk.cook.colour_pca._RMS_ERROR", 255)
            patch.setattr("depthwalk.cook.colour_pca._MAX_ERROR", 255)
        made = build_virtual_texture(baked, build_simplified_lods(baked))
        assert made.colours.shape[2] == (1 if request.param == "pca" else 4)
        yield made


def test_the_farther_the_less() -> None:
    asked = [0, 1.1, 1.3, 2.4, 2.6, np.inf]
    assert [detail_for(covered, 1 << 20) for covered in asked] == sorted(detail_for(c, 1 << 20) for c in asked)
    assert detail_for(0, 1 << 24) is Detail.FULL and detail_for(np.inf, 1 << 20) is Detail.QUARTER
    assert detail_for(0.7, 1 << 20) is Detail.FULL and detail_for(0.7, 1 << 24) is Detail.HALF


def test_small_textures_stay_whole(texture: VirtualTexture, monkeypatch: pytest.MonkeyPatch) -> None:
    assert not can_leave_out(texture)
    monkeypatch.setattr(texture_detail, "WORTH", 0)
    assert can_leave_out(texture)


def test_bytes_fall(texture: VirtualTexture) -> None:
    full, half, quarter = (at_detail(texture, detail).bytes_with_mip_maps for detail in Detail)
    assert at_detail(texture, Detail.FULL) is texture
    assert half < 0.7 * full and quarter < half


@pytest.mark.parametrize(("detail", "lods"), [(Detail.HALF, (1, 1.6, 2, 3.3, 5)), (Detail.QUARTER, (2, 2.7, 4, 5))])
def test_the_shader_finds_what_it_finds_in_the_whole(
    gl_device: Device, baked: BakedObject, texture: VirtualTexture, detail: Detail, lods: tuple[float, ...]
) -> None:
    """Random points of every image at the levels that are left; mip-maps are rounded at every level."""
    rng = np.random.default_rng(0)
    height, width = baked.images[0].depth.shape
    for image in range(len(baked.images)):
        for lod in lods:
            asked = np.column_stack([rng.random((300, 2)), np.full(300, lod)]).astype(np.float32)
            shown, expected = (
                looked_up(gl_device, at_detail(texture, stored), stored, image, (width, height), asked)
                for stored in (detail, Detail.FULL)
            )
            off = np.abs(shown - expected).max(1) * 255
            assert np.quantile(off, 0.98) < 2.5, (image, lod)


def test_no_side_is_a_power_of_two_and_the_shader_finds_the_same(
    gl_device: Device, baked: BakedObject, texture: VirtualTexture
) -> None:
    """Software rasterisers compile programs anew for textures with such a side."""
    height, width, _ = texture.normals.shape
    rows, columns = ((1 << side.bit_length()) - side for side in (height, width))

    def grown(texels: np.ndarray, part: int) -> np.ndarray:
        return np.pad(texels, [(0, rows // part), (0, columns // part), (0, 0)])

    tall, wide = ((1 << side.bit_length()) - side for side in texture.table.shape[1:3])
    whole = replace(
        texture,
        normals=grown(texture.normals, 1),
        colours=grown(texture.colours, 1),
        tints=grown(texture.tints, 2) if texture.tints.size else texture.tints,
        table=np.pad(texture.table, [(0, 0), (0, tall), (0, wide), (0, 0)]),
    )
    scope = gl_device.scope("test")
    uploaded = upload_texture(scope, whole, Detail.FULL)
    shown = [uploaded.normals.size, uploaded.colours.size, uploaded.page_table.size[:2]]
    shown += [uploaded.tints.size] if texture.tints.size else []
    assert whole.normals.shape[0].bit_count() == 1
    assert all(side.bit_count() > 1 for sides in shown for side in sides)
    scope.release()
    asked = (np.random.default_rng(0).random((300, 3)) * [1, 1, 4]).astype(np.float32)
    size = baked.images[0].depth.shape[::-1]
    for image in range(len(baked.images)):
        seen, expected = (looked_up(gl_device, pages, Detail.FULL, image, size, asked) for pages in (whole, texture))
        np.testing.assert_allclose(seen, expected, atol=1 / 255)


def looked_up(
    device: Device,
    texture: VirtualTexture,
    detail: Detail,
    image: int,
    size: tuple[int, int],
    asked: np.ndarray,
) -> np.ndarray:
    """Normal and colour (n, 8) at `asked` (n, 3): u, v and level of detail."""
    scope = device.scope("test")
    uploaded = upload_texture(scope, texture, detail)
    preamble = "".join(f"#define {name} 1\n" for name in uploaded.defines)
    text = ShaderSource("common/virtual_texture.glsl", preamble).text + LOOK_UP
    program = device.context.program(vertex_shader=text, varyings=("normal", "colour"))
    units = {"page_normals": 0, "page_colours": 1, "page_tints": 2, "page_table": 3}
    for unit, picture in enumerate((uploaded.normals, uploaded.colours, uploaded.tints)):
        picture.use(unit)
    uploaded.page_table.use(3)
    record = depth_object_record(**uploaded.uniforms, image_size=size)
    scope.buffer(record).bind_to_uniform_block(0)
    for name, value in (units | {"image": image}).items():
        if name in program:
            program[name] = value
    scope.framebuffer([scope.texture((4, 4), 4)]).use()  # a headless context has no framebuffer of its own
    array = device.context.vertex_array(program, [(scope.buffer(asked), "2f 1f", "uv", "lod")])
    out = scope.buffer(reserve=32 * len(asked))
    array.transform(out, moderngl.POINTS)
    found = np.frombuffer(out.read(), np.float32).reshape(-1, 8)
    array.release()
    program.release()
    scope.release()
    return found
