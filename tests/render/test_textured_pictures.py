"""Colours are looked up by texture coordinates: the shader against its twin, and pictures against those of meshes."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.bake.baker import bake_object
from depthwalk.bake.images import COORDINATE_STEPS, HAS_COORDINATES, ONE_CHART, BakedObject, Cylinder, DepthImage, Face
from depthwalk.bake.params import BakeParams
from depthwalk.cook.simplified_lods import build_simplified_lods
from depthwalk.cook.texture_detail import Detail, at_detail
from depthwalk.cook.virtual_texture import build_virtual_texture
from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.ingest.mesh import Mesh, Part
from depthwalk.reference.texture_coordinates import coordinates_at, step_within
from depthwalk.render.image import read_pixels
from depthwalk.render.resources.depth_image_object import DEPTH_OBJECT_BLOCK, depth_object_record
from depthwalk.render.resources.surface_texture import upload_texture
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.types import Array
from shapes import ShapeLibrary, bake, checkers, globe, joined, scene_of
from stage import OnScreen

pytestmark = pytest.mark.gl
SIZE = 64, 48
CYLINDER = Cylinder(radius=1.5, bottom=-0.5, top=1.0, half_width=1.5, half_depth=1.5)
COORDINATES_SHADER = """#include "common/depth_images.glsl"
in vec2 uv;
uniform vec2 low;
uniform vec2 size;
uniform bool border;
layout(location = 0) out vec4 found;
layout(location = 1) out vec4 slopes;
void main() {
    vec2 place = low + uv * size, at;
    mat2 slope;
    bool has = coordinates_at(place, texels_around(place), border, at, slope);
    found = vec4(at, has ? 1.0 : 0.0, 0.0);
    slopes = vec4(slope[0], slope[1]);
}
"""
STEPS_SHADER = """#include "common/depth_images.glsl"
in vec2 uv;
uniform int face;
uniform vec3 normal;
uniform vec3 viewer;
uniform vec3 change;
layout(location = 0) out vec4 found;
layout(location = 1) out vec4 where;
void main() {
    vec3 p = vec3(uv * 2.0 - 1.0, 0.3);
    sight = p - viewer;
    found = vec4(step_within(p, face, normal, change), 0.0, 0.0);
    where = vec4(p, 1.0);
}
"""

Draw = Callable[..., tuple[Array, Array]]


@pytest.fixture
def draw(gl_device: Device, tmp_path: Path) -> Draw:
    """Draws a fragment shader over a picture; returns its two outputs, (h · w, 4) each, the lower row first."""

    def run(
        shader: str, codes: Array | None = None, record: NDArray[np.void] | None = None, **uniforms: object
    ) -> tuple[Array, Array]:
        (tmp_path / "test.frag").write_text(f"// Tests.\n{shader}")
        scope = gl_device.scope("test")
        try:
            defines = "COLOURED", "COORDINATES"
            blocks = DEPTH_OBJECT_BLOCK
            program = Program(scope, "common/fullscreen.vert", tmp_path / "test.frag", defines, blocks)
            held = scope.buffer(depth_object_record() if record is None else record)
            held.bind_to_uniform_block(blocks["DepthObject"])
            targets = [scope.texture(SIZE, 4, "f4") for _ in range(2)]
            if codes is not None:
                data = np.ascontiguousarray(codes).tobytes()
                scope.texture((codes.shape[1], codes.shape[0]), 2, "u2", data).use(0)
                program.set(page_coordinates=0)
            program.set(**uniforms)
            with scope.state(into=scope.framebuffer(targets)):
                program.fill()
            found, other = (np.frombuffer(target.read(), np.float32).reshape(-1, 4).copy() for target in targets)
            return found, other
        finally:
            scope.release()

    return run


def pixels() -> Array:
    """Where pixels of the test picture have their middles, (h · w, 2), 0 to 1."""
    row, column = np.mgrid[: SIZE[1], : SIZE[0]]
    return (np.stack([column, row], -1).reshape(-1, 2) + 0.5) / SIZE


def random_codes() -> NDArray[np.uint16]:
    """12 × 16 texels: three charts, one of which passes the texture's end; some texels without coordinates."""
    rows, columns = np.mgrid[:12, :16]
    chart = np.where(columns < 6, 0, np.where(rows < 7, 1, 2))
    u = np.choose(chart, [0.97 + 0.011 * columns, 0.2 + 0.02 * rows, 0.6 - 0.01 * columns + 0.0005 * columns * rows])
    v = np.choose(chart, [0.3 + 0.01 * rows, 0.9 - 0.015 * columns, 0.1 + 0.013 * rows])
    codes = np.round(np.stack([u, v], -1) % 1.0 * COORDINATE_STEPS).astype(np.int64).astype(np.uint16)
    codes &= np.uint16(0xFFFE)
    codes[..., 0] |= np.uint16(HAS_COORDINATES)
    missing = (rows > 8) & (columns > 11)
    whole = np.zeros(chart.shape, bool)
    corners = [np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, :-1], np.s_[1:, 1:]]
    whole[:-1, :-1] = np.all([(chart[c] == chart[:-1, :-1]) & ~missing[c] for c in corners], axis=0)
    codes[..., 1] |= whole.astype(np.uint16) * ONE_CHART
    codes[missing] = 0
    return codes


@pytest.mark.parametrize("border", [False, True])
def test_the_shader_finds_the_coordinates_of_its_twin(draw: Draw, border: bool) -> None:
    codes, low, size = random_codes(), np.array([1.6, 1.6]), np.array([12.7, 8.7])
    found, slopes = draw(COORDINATES_SHADER, codes, low=tuple(low), size=tuple(size), border=border)
    expected, slope, has = coordinates_at(codes, low + pixels() * size, border)
    assert 0.9 < has.mean() < 1
    np.testing.assert_array_equal(found[:, 2] > 0.5, has)
    off = (found[has, :2] - expected[has] + 0.5) % 1.0 - 0.5
    assert np.abs(off).max() < 1e-5
    np.testing.assert_allclose(slopes[has].reshape(-1, 2, 2).swapaxes(1, 2), slope[has], atol=1e-5)


def test_beside_what_has_a_texture_the_rest_keeps_its_colours() -> None:
    """The nearest texel decides: the others' coordinates are those of another surface."""
    _, _, has = coordinates_at(random_codes(), np.array([(11.8, 10.5), (12.2, 10.5), (13.0, 9.2), (13.0, 8.8)]), True)
    assert has.tolist() == [True, False, False, True]


@pytest.mark.parametrize("face", Face)
@pytest.mark.parametrize("normal", [(0.0, 0.6, 0.8), (1.0, 0.0, 0.0)])
def test_the_shader_steps_as_its_twin_does(draw: Draw, face: Face, normal: tuple[float, float, float]) -> None:
    viewer, change = np.array([0.4, 1.2, 4.0]), (0.01, 0.002, 0.003)
    found, where = draw(
        STEPS_SHADER,
        face=int(face),
        normal=normal,
        viewer=tuple(viewer),
        change=change,
        record=depth_object_record(
            cylinder=(CYLINDER.radius, CYLINDER.bottom, CYLINDER.half_width, CYLINDER.half_depth),
            cylinder_height=CYLINDER.height,
        ),
    )
    points = where[:, :3].astype(np.float64)
    expected = step_within(CYLINDER, face, points, np.array([normal]), points - viewer, np.array([change]))
    np.testing.assert_allclose(found[:, :2], expected, rtol=1e-3, atol=1e-6)


def test_a_step_is_the_way_to_the_next_pixel() -> None:
    """Of the twin: where the next pixel's ray meets the plane that touches the surface."""
    point, normal, viewer = np.array([0.3, 0.2, 1.0]), np.array([0.0, 0.28, 0.96]), np.array([0.5, 0.1, 3.0])
    change = np.array([0.0004, 0.0001, -0.0002])
    ray = point - viewer + change
    further = viewer + ray * ((point - viewer) @ normal) / (ray @ normal)
    for face in (Face.SIDE, Face.FRONT, Face.TOP):
        step = step_within(CYLINDER, face, point[None], normal[None], (point - viewer)[None], change[None])[0]
        expected = within(further, face) - within(point, face)
        np.testing.assert_allclose(step, expected, rtol=2e-3, atol=1e-9)


def within(point: Array, face: Face) -> Array:
    """Where an image of CYLINDER has a point, parts of its width and height."""
    x, y, z = point
    up = (y - CYLINDER.bottom) / CYLINDER.height
    if face is Face.SIDE:
        return np.array([np.arctan2(z, x) / (2 * np.pi), up])
    return np.array([x / 3 + 0.5, up if face is Face.FRONT else z / 3 + 0.5])


def pictures(device: Device, mesh: Mesh, baked: BakedObject, distance: float, side: int = 240) -> tuple[Array, Array]:
    """The mesh and its depth images, (side, side, 3), 0 to 1, from such a distance to the mesh's origin."""
    size = side, side
    view = View(Camera((0.3 * distance, 1 + 0.2 * distance, 0.93 * distance), (0.0, 1.0, 0.0), 0.7), size)
    shots = []
    for representation in (Representation.MESH, Representation.DPCI):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=representation, background=(0.5, 0.5, 0.5))
        with OnScreen(device, scene, ShapeLibrary([mesh], [baked]), size) as stage:
            stage.draw(view)
            shots.append(read_pixels(stage.screen)[..., :3] / 255)
    return shots[0], shots[1]


def psnr(one: Array, other: Array) -> float:
    return float(-10 * np.log10(np.square(one - other).mean()))


FINE = globe(checkers(256, 8), 128, 64)


@pytest.fixture(scope="module")
def plain() -> BakedObject:
    return bake_object(FINE, BakeParams(resolution=128, layers=1, coordinates="never"), "plain")


@pytest.mark.parametrize(("distance", "least"), [(2.0, 38.0), (4.0, 38.0), (8.0, 41.0)])
def test_pictures_are_as_sharp_as_the_texture(
    gl_device: Device, plain: BakedObject, distance: float, least: float
) -> None:
    """Magnified, at a texel a pixel, and minified, where meshes show mip-maps. Without any it is 27, 31 and 35 dB."""
    textured = bake(FINE, resolution=128, layers=1)
    assert psnr(*pictures(gl_device, FINE, textured, distance)) > least
    assert psnr(*pictures(gl_device, FINE, plain, distance)) < least - 6


def test_what_is_uploaded_is_what_is_counted(gl_device: Device, plain: BakedObject) -> None:
    textured = bake(FINE, resolution=128, layers=1)
    partly = replace(textured, images=tuple(without_one(image) for image in textured.images))
    for baked, level in ((plain, 0), (partly, 0), (textured, 2)):
        pages = build_virtual_texture(baked, build_simplified_lods(baked))
        assert pages.has_coordinates == (baked is not plain) and pages.colour_level == level
        scope = gl_device.scope("test")
        try:
            uploaded = upload_texture(scope, pages, Detail.FULL)
            with_mip_maps = [(uploaded.normals, 4), (uploaded.colours, 4)]
            size = sum(k * t.width * t.height * (21 / 16 if t.width > 200 else 1) for t, k in with_mip_maps)
            assert uploaded.colours.width == uploaded.normals.width >> level
            if uploaded.coordinates is not None and uploaded.base is not None:
                size += 4 * uploaded.coordinates.width * uploaded.coordinates.height
                size += 4 * uploaded.base.width * uploaded.base.height * 4 / 3
            assert uploaded.bytes - pages.table.nbytes == pytest.approx(size, rel=0.01)
        finally:
            scope.release()
        coarser = at_detail(pages, Detail.HALF)
        assert not coarser.has_coordinates and not coarser.texture.size and coarser.colour_level == 0


def without_one(image: DepthImage) -> DepthImage:
    """An image of which one texel has no coordinates, as where another material begins."""
    assert image.coordinates is not None
    coordinates = image.coordinates.copy()
    coordinates[tuple(np.argwhere(np.isfinite(image.depth))[0])] = 0
    return replace(image, coordinates=coordinates)


def test_far_away_stored_colours_serve(gl_device: Device, plain: BakedObject) -> None:
    """Where a pixel covers more texels than the finest mip tier is for."""
    textured = bake(FINE, resolution=128, layers=1)
    mesh, far = pictures(gl_device, FINE, textured, 8.0, 32)
    _, stored = pictures(gl_device, FINE, plain, 8.0, 32)
    assert psnr(mesh, far) > psnr(mesh, stored) - 1.0


def test_seams_show_no_colours_of_neither_side(gl_device: Device) -> None:
    """Two halves of a globe show distant parts of a texture; between them lies what interpolation would hit."""
    texture = np.full((64, 256, 4), (0, 160, 0, 255), np.uint8)
    texture[:, 117:139, :3] = (255, 0, 255)  # u from 0.457 to 0.543
    mesh = globe(texture, 64, 32)
    u = mesh.uv[:, 0]
    faces = mesh.faces[np.ptp(u[mesh.faces], axis=1) < 0.5]
    second = u[faces].mean(1) > 0.5
    shifted = mesh.uv.copy()
    shifted[:, 0] = 1.4 - 0.84 * u  # down to 0.56
    first = np.column_stack([0.44 - 0.84 * u, mesh.uv[:, 1]]).astype(np.float32)
    count = len(mesh.positions)
    split = replace(
        joined(mesh, mesh),
        uv=np.concatenate([first, shifted]),
        faces=np.concatenate([faces[~second], faces[second] + count]).astype(np.int32),
        parts=(Part(0, len(faces), 0),),
        materials=mesh.materials,
    )
    baked = bake_object(split, BakeParams(resolution=64, layers=1), "split")
    assert baked.texture is not None
    mesh_shot, shot = pictures(gl_device, split, baked, 2.2)
    middle = np.s_[40:200, 40:200]
    assert psnr(mesh_shot[middle], shot[middle]) > 40
    assert not (shot[middle][..., 0] > shot[middle][..., 1]).any()  # nothing is magenta


def test_what_has_no_coordinates_keeps_its_colours(gl_device: Device) -> None:
    """The right half is painted by its vertices: it looks as it does without any coordinates."""
    painted = replace(FINE, colours=FINE.colours.copy())
    painted.colours[FINE.positions[:, 0] > 0] = (180, 220, 120)
    partly = bake_object(painted, BakeParams(resolution=128, layers=1), "partly")
    never = bake_object(painted, BakeParams(resolution=128, layers=1, coordinates="never"), "partly")
    assert partly.texture is not None
    mesh, shot = pictures(gl_device, painted, partly, 2.4)
    _, stored = pictures(gl_device, painted, never, 2.4)
    right, left = np.s_[:, 160:], np.s_[:, :80]
    np.testing.assert_array_equal(shot[right], stored[right])
    assert psnr(mesh[left], shot[left]) > psnr(mesh[left], stored[left]) + 5
