"""Lookups in virtual textures against lookups in whole images."""

from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.images import BakedObject, DepthImage, Face
from depthwalk.bake.planar import bake_planar
from depthwalk.cook import colour_pca
from depthwalk.cook.cook import CookOptions
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.lod_geometry import FACE_SHIFT, LodGeometry
from depthwalk.cook.simplified_lods import build_simplified_lods
from depthwalk.cook.texel_encoding import image_texels
from depthwalk.cook.used_texels import SUB_TILE, tile_counts, used_sub_tiles
from depthwalk.cook.virtual_texture import LEVELS, VirtualTexture, build_virtual_texture
from depthwalk.gpu.device import Device
from depthwalk.gpu.shader_source import ShaderSource
from depthwalk.ingest.image import PlanarImage
from depthwalk.parallel import Map
from depthwalk.reference.virtual_texture import bilinear, page_normals, page_texels
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.types import Array, Mask
from shapes import ShapeLibrary, bake, box, joined, sphere

ROUNDING = 2.5  # of 255: mip-maps are rounded at every level


def statue(resolution: int = 64) -> BakedObject:
    """A ball beside the axis, across the seam, over a plinth: caps, several layers and much that is empty."""
    rod = box(0.05, 0.05, 0.6, (0.7, 0.3, 0))
    return bake(joined(sphere(0.5, 48, 24), box(1.6, 0.2, 1.0, (0.3, -0.4, 0.1)), rod), resolution)


def painted() -> BakedObject:
    """The same in lighter and darker brown, for which one component and tints do."""
    return bake(
        joined(
            sphere(0.5, 48, 24, colour=(210, 190, 160)),
            box(1.6, 0.2, 1.0, (0.3, -0.4, 0.1), colour=(105, 95, 80)),
            box(0.05, 0.05, 0.6, (0.7, 0.3, 0), colour=(53, 47, 40)),
        ),
        64,
    )


def relief() -> BakedObject:
    """A planar image of odd size, torn along its middle."""
    rng = np.random.default_rng(3)
    depth = rng.uniform(0, 0.01, (83, 53)).astype(np.float32)
    depth[:, 20:30] = np.inf
    normal = np.zeros((83, 53, 3), np.float32)
    normal[..., 2] = 1
    colour = rng.integers(0, 256, (83, 53, 3)).astype(np.uint8)
    return bake_planar(PlanarImage(depth=depth, colour=colour, normal=normal, size=(0.53, 0.83)), "relief")


@pytest.fixture(scope="module", params=[statue, painted, relief], ids=["statue", "painted", "relief"])
def baked(request: pytest.FixtureRequest) -> BakedObject:
    return request.param()


@pytest.fixture(scope="module")
def grids(baked: BakedObject) -> LodGeometry:
    return build_grid_lods(baked)


@pytest.fixture(scope="module")
def pages(baked: BakedObject, grids: LodGeometry) -> VirtualTexture:
    return build_virtual_texture(baked, grids)


@pytest.fixture(scope="module")
def texels(baked: BakedObject) -> list[Array]:
    """What the images hold, (H, W, 8) each, of 255."""
    return [image_texels(baked.cylinder, image) / (1, 1, 1, 1, 257, 257, 257, 257) for image in baked.images]


@pytest.fixture(scope="module", autouse=True)
def none_is_small() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(colour_pca, "_SMALL", 0)
        yield


def boxed(texels: Array, size: int, period: int) -> tuple[Array, float]:
    """Averages (H, W, 8) over boxes of `size` texels, the first of which begins GRAIN texels and half a grain before
    the image, and the number of boxes before its own."""
    start = SUB_TILE + SUB_TILE // 2
    count = [(extent + 2 * start) // size + 1 for extent in texels.shape[:2]]
    rows, columns = (np.arange(size * n) - start for n in count)
    columns = columns % period if period else columns.clip(0, texels.shape[1] - 1)
    wide = texels[rows.clip(0, texels.shape[0] - 1)[:, None], columns].astype(float)
    return wide.reshape(count[0], size, count[1], size, -1).mean((1, 3)), start / size


def in_image(texels: Array, at: Array, segment: int, lod: float, period: int) -> Array:
    """Texels (n, 8) of a whole image at points (n, 2), in texels, from its quarters if `segment` says so."""
    for _ in range(segment):
        rows, columns = ((extent + SUB_TILE // 2 - 1) // SUB_TILE + 1 for extent in texels.shape[:2])
        texels = np.round(boxed(texels, SUB_TILE, period)[0][1 : rows + 1, 1 : columns + 1])
        at, period = (at + SUB_TILE / 2) / SUB_TILE, period // SUB_TILE
    level = min(max(lod - LEVELS * segment, 0), LEVELS)
    pair = [boxed(texels, 1 << whole, period) for whole in (int(level), int(level) + 1)]
    lower, upper = (bilinear(box, at / (1 << (int(level) + k)) + before) for k, (box, before) in enumerate(pair))
    return lower + (level - int(level)) * (upper - lower)


def points(image: DepthImage) -> Array:
    """Points (n, 2), in texels, all over an image, at the edges of its grains and at its own."""
    height, width = image.depth.shape
    rng = np.random.default_rng(7)
    anywhere = rng.uniform(0, (width, height), (400, 2))
    on_edges = np.round(anywhere / SUB_TILE) * SUB_TILE + rng.choice([-0.01, 0, 0.01], anywhere.shape)
    at_ends = np.where(rng.random(anywhere.shape) < 0.5, rng.choice([0, 0.3, 0.9], anywhere.shape), anywhere)
    at_ends = np.where(rng.random(anywhere.shape) < 0.5, (width, height) - at_ends, at_ends)
    return np.concatenate([anywhere, on_edges, at_ends]).clip(0, np.array([width, height]) - 0.01)


@pytest.mark.parametrize("lod", [0, 1, 2, 3, 4, 5, 0.5, 2.25])
def test_pages_hold_what_the_images_hold(
    baked: BakedObject, texels: list[Array], pages: VirtualTexture, lod: float
) -> None:
    """Wherever one looks, or else in a coarser segment, which stands in for what is never drawn."""
    for number, image in enumerate(baked.images):
        at, period = points(image), image.depth.shape[1] if image.face is Face.SIDE else 0
        found, segment = page_texels(pages, number, at, lod, image.depth.shape[::-1])
        for coarsest in np.unique(segment):
            here = segment == coarsest
            expected = in_image(texels[number], at[here], int(coarsest), lod, period)
            assert np.abs(found[here] - expected).max() <= ROUNDING, (image.name, coarsest)


@pytest.mark.parametrize(("lod", "level"), [(0, 0), (0, 2), (1.5, 2), (2.5, 2), (4, 2)])
def test_what_is_drawn_is_found_in_its_own_segment(
    baked: BakedObject, grids: LodGeometry, pages: VirtualTexture, lod: int, level: int
) -> None:
    """Points anywhere within the triangles of a grid, but for borders."""
    triangles = grids.drawn(level)
    triangles = triangles[(grids.texels[triangles] >= 0).all((1, 2))]
    height, width = baked.images[0].depth.shape
    corners = grids.texels[triangles].astype(float)
    flags = grids.vertices[triangles[:, 2], 3]
    side = (flags >> FACE_SHIFT & 7) == Face.SIDE
    turned = corners[..., 0] - corners[:, :1, 0]
    corners[..., 0] -= side[:, None] * width * np.round(turned / width)
    weights = np.random.default_rng(2).dirichlet((1, 1, 1), len(corners))
    at = np.einsum("tk,tki->ti", weights, corners) + 0.5
    at[:, 0] = np.where(side, at[:, 0] % width, at[:, 0])
    numbers = np.searchsorted([image.face for image in baked.images], flags >> FACE_SHIFT & 7) + (flags & 7)
    for number in range(len(baked.images)):
        _, segment = page_texels(pages, number, at[numbers == number], lod, (width, height))
        assert (segment == min(int(lod / LEVELS), pages.last_mip_tier)).all()


def test_levels_that_look_up_the_finest_segment_find_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many there are: errors may grow slowly from level to level."""
    monkeypatch.setattr("depthwalk.cook.interior_visibility.hardly_seen", _none_hidden)
    baked = statue(160)
    grids = build_simplified_lods(baked)
    levels = len(grids.error)
    assert levels > 6
    grids = replace(grids, error=square_texel(baked) * np.linspace(0.1, 1.9, levels))  # of a pixel of 4 texels
    table = build_virtual_texture(baked, grids).table
    (used,) = used_sub_tiles(baked, grids, [levels])
    rows, columns = tile_counts(baked.images[0].depth.shape)
    stored = table[:, :rows, :columns, :, None] >> np.arange(2) & 1  # ending in row, column of the sub-tile
    assert (stored.swapaxes(2, 3).reshape(used.shape)[used] == 1).all()


def _none_hidden(baked: BakedObject, grids: LodGeometry, parallel: Map = map) -> Mask:
    return np.zeros((len(baked.images), *tile_counts(baked.images[0].depth.shape)), bool)


@pytest.mark.slow
def test_pages_are_smaller_than_images() -> None:
    """What only the paper's cases draw is stored for those only."""
    baked = statue(128)
    all_cases, paper = (
        build_virtual_texture(baked, build_grid_lods(baked, paper_cases=wanted)) for wanted in (False, True)
    )
    whole = len(baked.images) * baked.images[0].depth.size
    assert all_cases.normals[..., 0].size < paper.normals[..., 0].size < 0.8 * whole


LOOK_UP = """
in vec2 uv;
in float lod;
uniform int image;
out vec4 normal, colour;
out vec3 magnified;
out float misplaced;    // texels
void main() {
    int tier;
    vec3 place = page_at(image, uv, lod, tier);
    normal = page_texel(page_normals, place);
    colour = page_colour(place);
    vec2 stored;
    place = page_at(image, uv, 0.0, tier);
    vec4 around[4];
    magnified = page_normal(place.xy, around);
    misplaced = page_stored(image, uv, stored) ? distance(stored, place.xy) : 0.0;
}
"""


def test_the_shader_matches_its_twin(gl_device: Device, baked: BakedObject, pages: VirtualTexture) -> None:
    """Random points of every image at random levels of detail, by transform feedback."""
    match_shader(gl_device, baked, pages)


def test_the_shader_reads_two_components_and_a_tint(
    gl_device: Device, baked: BakedObject, grids: LodGeometry, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in ("_OWN", (2,)), ("_RMS_ERROR", 255), ("_MAX_ERROR", 255):
        monkeypatch.setattr(colour_pca, name, value)
    pages = build_virtual_texture(baked, grids)
    assert (pages.colours.shape[2], pages.tints.shape[2]) == (2, 1) or not pages.colours.shape[2]
    match_shader(gl_device, baked, pages)


def match_shader(gl_device: Device, baked: BakedObject, pages: VirtualTexture) -> None:
    store, scope = AssetStore(gl_device, ShapeLibrary([None], [baked], kept=False)), gl_device.scope("test")
    store.parts.options = CookOptions(stepped=True)  # as the pages to compare with
    drawn = store.depth_object(store.parts.numbers(0)[0])
    preamble = "".join(f"#define {name} 1\n" for name in drawn.surface_defines)
    text = ShaderSource("common/virtual_texture.glsl", preamble).text + LOOK_UP
    program = gl_device.context.program(vertex_shader=text, varyings=("normal", "colour", "magnified", "misplaced"))
    texture = drawn.texture
    assert texture is not None
    for unit, picture in enumerate((texture.normals, texture.colours, texture.tints)):
        picture.use(unit)
    texture.page_table.use(3)
    units = {"page_normals": 0, "page_colours": 1, "page_tints": 2, "page_table": 3}
    drawn.block.bind_to_uniform_block(0)
    for name, value in units.items():
        if name in program:
            program[name] = value
    scope.framebuffer([scope.texture((4, 4), 4)]).use()  # a headless context has no framebuffer of its own
    for number, image in enumerate(baked.images):
        size = image.depth.shape[::-1]
        at = points(image)
        for lod in (0, 0.7, 2, 3.4, 7):
            asked = np.column_stack([at / size, np.full(len(at), lod)]).astype(np.float32)
            array = gl_device.context.vertex_array(program, [(scope.buffer(asked), "2f 1f", "uv", "lod")])
            out = scope.buffer(reserve=48 * len(at))
            program["image"] = number
            array.transform(out, moderngl.POINTS)
            returned = np.frombuffer(out.read(), np.float32).reshape(-1, 12)
            found, magnified, misplaced = np.split(returned, (8, 11), axis=1)
            array.release()
            expected, _ = page_texels(pages, number, asked[:, :2].astype(float) * size, lod, size)
            off = np.abs(found * 255 - expected).max(1)
            assert np.quantile(off, 0.99) < ROUNDING, (image.name, lod)  # rounding may choose another grain at an edge
            assert misplaced.max() < 1e-3
            off = np.abs(magnified - page_normals(pages, number, asked[:, :2].astype(float) * size, size)).max(1)
            assert np.quantile(off, 0.99) < 1e-3, image.name
    program.release()
    scope.release()
    store.release()
