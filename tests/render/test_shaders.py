"""The shaders themselves against their twins: vertices by transform feedback, pixels by pictures of known shapes."""

import re
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from depthwalk.bake.planar import bake_planar
from depthwalk.colour import linear_from_srgb, srgb_from_linear
from depthwalk.cook.lod_geometry import BORDER, EASE
from depthwalk.cook.texel_encoding import DEPTH_PERIOD
from depthwalk.geometry.bounding_hull import prism_corners
from depthwalk.gpu.device import Device
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.program import Program
from depthwalk.gpu.shader_source import ShaderSource
from depthwalk.ingest.image import PlanarImage
from depthwalk.reference.light import Surfaces, phong
from depthwalk.reference.warp import warp
from depthwalk.render.impostors.tile_records import WARP_RECORD
from depthwalk.render.impostors.warp_planes import Volumes, choose_planes
from depthwalk.render.resources.depth_image_object import DEPTH_OBJECT_BLOCK, depth_object_record
from depthwalk.render.view.view import View
from depthwalk.resources import shader_root
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.types import Array
from shapes import ShapeLibrary, box, joined, scene_of, sphere
from studio import Studio


def test_pass_one_matches_its_twin(gl_device: Device) -> None:
    """10,000 random samples of random objects through warp.vert."""
    rng = np.random.default_rng(5)
    count = 100
    one = np.ones(count)
    volumes = Volumes(
        radius=0.8 * one,
        bottom=-0.5 * one,
        top=1.5 * one,
        hull=np.tile(prism_corners(np.full(4, 0.8), -0.5, 1.5), (len(one), 1, 1)),
        has_side=one > 0,
    )
    direction = rng.normal(size=(count, 3))
    viewer = direction / np.linalg.norm(direction, axis=1, keepdims=True) * rng.uniform(3, 9, (count, 1))
    planes = choose_planes(viewer, volumes)
    records = np.zeros(count, WARP_RECORD)
    records["right"] = np.column_stack([planes.right, planes.epipole[:, 0]])
    records["up"] = np.column_stack([planes.up, planes.epipole[:, 1]])
    records["normal"] = np.column_stack([planes.normal, planes.offset])
    records["depths"][:, :2] = np.column_stack([planes.distance, one])
    homography = np.array([[0.1, 0.02, 0.3], [0.03, 0.2, 0.4], [0.01, 0.02, 1.0]])
    records["to_x"], records["to_y"], records["to_w"] = homography
    samples = rng.integers(0, 65536, (100, 4)).astype(np.uint16)
    samples[:, 3] = 0  # no flags
    low, size = np.array([-0.8, -0.5, -0.8]), np.array([1.6, 2.0, 1.6])

    scope = gl_device.scope("test")
    program = gl_device.context.program(
        vertex_shader=ShaderSource("warp/warp.vert", "").text, varyings=("gl_Position",)
    )
    members: Any = program
    members["DepthObject"].binding = DEPTH_OBJECT_BLOCK["DepthObject"]
    block = scope.buffer(depth_object_record(box_low=low, box_size=size))
    block.bind_to_uniform_block(DEPTH_OBJECT_BLOCK["DepthObject"])
    vertices, instances = scope.buffer(samples), scope.buffer(records)
    layout = "4f 4f 4f 3f 3f 3f 3f 32x/i"
    names = ["in_right", "in_up", "in_normal", "in_depths", "in_to_x", "in_to_y", "in_to_w"]
    array = gl_device.context.vertex_array(program, [(vertices, "4u2", "in_sample"), (instances, layout, *names)])
    out = scope.buffer(reserve=16 * count * 100)
    scope.framebuffer([scope.texture((4, 4), 4)]).use()  # a headless context has no framebuffer of its own
    array.transform(out, moderngl.POINTS, vertices=100, instances=count)
    found = np.frombuffer(out.read(), np.float32).reshape(count, 100, 4)
    array.release()
    program.release()
    scope.release()

    points = low + samples[:, :3] / 65535 * size
    for sample, point in enumerate(points):
        position, lam = warp(np.tile(point, (count, 1)), planes)
        x, y, w = homography @ np.column_stack([position, one]).T
        assert found[:, sample] == pytest.approx(np.stack([x, y, w - 2 * lam, w], -1), abs=2e-5)


def rays(view: View) -> Array:
    """Unit vectors (H, W, 3) from the viewer through every pixel, top row first."""
    width, height = view.size
    tan_x, tan_y = view.half_extent
    x = ((np.arange(width) + 0.5) / width * 2 - 1) * tan_x
    y = (1 - (np.arange(height) + 0.5) / height * 2) * tan_y
    local = np.stack(np.broadcast_arrays(x[None], y[:, None], 1.0), -1)
    vectors = local @ view.axes
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def ball_hits(view: View, centre: tuple[float, float, float], radius: float) -> tuple[Array, Array, Array]:
    """Distance along each pixel's ray to a ball, inf where it passes by, and the normal there."""
    direction = rays(view)
    offset = np.asarray(centre) - view.position
    along = direction @ offset
    missed = radius**2 - (offset @ offset - along**2)
    distance = np.where(missed > 0, along - np.sqrt(np.maximum(missed, 0)), np.inf)
    with np.errstate(invalid="ignore"):
        normal = (direction * distance[..., None] - offset) / radius
    return distance, normal, direction


@pytest.mark.parametrize("representation", [Representation.MESH, Representation.DPCI, Representation.DMESH])
@pytest.mark.parametrize(
    "position",
    [(0, 1.0, 4.0), (2.0, 3.5, 2.0), (0.1, 4.5, 0.2), (1.5, -1.5, 1.0)],
    ids=["side", "steep", "top", "below"],
)
def test_a_sphere_has_known_depth_and_colour(
    studio: Studio, position: tuple[float, float, float], representation: Representation
) -> None:
    scene = scene_of((0, (0, 0, 0), 0.7, 1.0), representation=representation)
    scene.render.lod.error = 0.0  # pixels
    library = ShapeLibrary([sphere()], resolution=128)
    camera = Camera(position, (0, 1.0, 0), 0.8)
    pixels, depth, _ = studio.measured(scene, library, camera, size=(240, 180), transparent=True)
    distance, normal, direction = ball_hits(View(camera, (240, 180)), (0, 1, 0), 1.0)
    solid, known = pixels[..., 3] > 0, np.isfinite(distance)
    assert (solid & known).sum() / (solid | known).sum() > 0.985
    both = solid & known
    inner = both & (np.einsum("hwi,hwi->hw", normal, -direction) > 0.3)  # where depth is well conditioned
    view = View(camera, (240, 180))
    error = np.abs(depth[inner] - distance[inner] * (direction[inner] @ view.axes[2]))
    assert np.median(error) < 1e-3 and np.quantile(error, 0.99) < 8e-3

    environment = scene.environment
    to_sun = -np.asarray(environment.sun.direction) / np.linalg.norm(environment.sun.direction)
    n = inner.sum()
    expected = phong(
        Surfaces(
            albedo=np.tile(linear_from_srgb(np.array([200, 120, 80]) / 255), (n, 1)),
            specular=np.full(n, 0.15),
            normal=normal[inner],
            shininess=np.full(n, 32.0),
        ),
        direction[inner],
        to_sun,
        linear_from_srgb(environment.sun.colour) * environment.sun.intensity,
        linear_from_srgb(environment.ambient.colour) * environment.ambient.intensity,
    )
    difference = np.abs(pixels[inner][:, :3] - srgb_from_linear(expected))
    assert difference.mean() < 0.006 and np.quantile(difference, 0.99) < 0.03


def test_depth_images_and_polygons_meet_in_one_depth_buffer(studio: Studio) -> None:
    """Two overlapping balls, one as depth image, one as mesh, against the nearer of two analytic balls."""
    scene = scene_of((0, (-0.5, 0, 0), 0.0, 1.0), (1, (0.5, 0, 0.3), 0.0, 1.0))
    scene.objects.representation[1] = Representation.MESH
    library = ShapeLibrary([sphere(colour=(220, 60, 60), specular=0), sphere(colour=(60, 60, 220), specular=0)])
    camera = Camera((0.3, 1.4, 5.0), (0, 1, 0), 0.7)
    pixels, depth, plan = studio.measured(scene, library, camera, size=(240, 180), transparent=True)
    assert plan.counts["dpci"] == 1 and plan.counts["mesh"] == 1
    view = View(camera, (240, 180))
    first, second = ball_hits(view, (-0.5, 1, 0), 1.0)[0], ball_hits(view, (0.5, 1, 0.3), 1.0)[0]
    both = np.isfinite(first) & np.isfinite(second)
    both[both] = np.abs(first[both] - second[both]) > 0.05
    red = pixels[..., 0] > pixels[..., 2]
    assert both.sum() > 500
    assert (red == (first < second))[both].mean() > 0.99
    assert np.isfinite(depth)[both].all()


def test_a_step_is_cut_not_bridged(studio: Studio) -> None:
    """A small box before a large one: seen aslant, the gap between them must stay open."""
    library = ShapeLibrary(
        [joined(box(0.6, 0.6, 0.1, (0, 0.5, 0.8)), box(1.6, 1.0, 0.1, (0, 0.5, -0.8)))], resolution=64
    )
    camera = Camera((3.2, 0.6, 0.25), (0, 0.5, 0.0), 0.6)
    pictures = []
    for representation in (Representation.DPCI, Representation.MESH):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=representation)
        pictures.append(studio.picture(scene, library, camera, size=(240, 180), transparent=True)[..., 3] > 0)
    imaged, meshed = pictures
    assert meshed.sum() > 500
    assert (imaged & ~meshed).sum() < 0.02 * meshed.sum()
    assert (imaged & meshed).sum() > 0.97 * meshed.sum()


@pytest.mark.parametrize(
    "position", [(0.3, 0.9, 0.2), (0.2, 2.3, 0.1), (0.0, 2.02, 0.6), (0.9, 1.0, 0.0), (0.0, 1.0, 0.0), (0.0, -0.3, 0.0)]
)
def test_near_and_inside_there_are_no_holes(studio: Studio, position: tuple[float, float, float]) -> None:
    """Around the viewer stands a ring-shaped room: every pixel must be covered as by its mesh."""
    walls = joined(
        *[box(0.05, 2.0, 2.0, (x, 1.0, 0.0)) for x in (-1, 1)], *[box(2.0, 2.0, 0.05, (0.0, 1.0, z)) for z in (-1, 1)]
    )
    library = ShapeLibrary([walls], resolution=64, layers=3)
    camera = Camera(position, (position[0] + 0.1, position[1] - 0.02, position[2] - 1), 1.0)
    masks = []
    for representation in (Representation.DPCI, Representation.MESH):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=representation)
        pixels = studio.picture(scene, library, camera, transparent=True)
        assert np.isfinite(pixels).all()
        masks.append(pixels[..., 3] > 0)
    union = (masks[0] | masks[1]).sum()
    assert union == 0 or (masks[0] & masks[1]).sum() > 0.95 * union


def test_a_planar_depth_image_stands_upright(studio: Studio) -> None:
    """A bowl pressed into a plate: its depth and the colours of its four quarters, seen from the front."""
    size = 128
    y, x = np.mgrid[0:size, 0:size] / (size - 1) * 2 - 1.0
    depth = (0.3 * np.sqrt(np.maximum(0, 0.64 - x**2 - y**2))).astype(np.float32)
    colour = np.zeros((size, size, 3), np.uint8)
    colour[: size // 2, :, 0], colour[size // 2 :, :, 1], colour[:, size // 2 :, 2] = 200, 200, 200
    normal = np.zeros((size, size, 3), np.float32)
    normal[..., 2] = 1
    baked = bake_planar(PlanarImage(depth=depth, colour=colour, normal=normal, size=(2.0, 2.0)), "plate")
    library = ShapeLibrary([None], [baked])
    camera = Camera((0, 1, 4), (0, 1, 0), 0.6)
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0))
    pixels, metres, _ = studio.measured(scene, library, camera, size=(180, 180), transparent=True)
    assert metres[90, 90] == pytest.approx(4 + 0.3 * 0.8, abs=5e-3)
    assert metres[90, 22] == pytest.approx(4.0, abs=5e-3)
    lower_left, upper_right = pixels[130, 50], pixels[50, 130]
    assert lower_left[0] > 0.3 and lower_left[2] < 0.1  # red below, blue to the right, green above
    assert upper_right[1] > 0.3 and upper_right[2] > 0.3 and upper_right[0] < 0.1
    behind = studio.picture(scene, library, Camera((0, 1, -4), (0, 1, 0), 0.6), transparent=True)
    assert behind[..., 3].max() == 0


def test_compiler_messages_name_file_and_line(
    gl_device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "broken"
    folder.mkdir()
    (folder / "a.vert").write_text('#include "broken/b.glsl"\nvoid main() { gl_Position = vec4(f()); }\n')
    (folder / "b.glsl").write_text("float f() {\n    return nothing;\n}\n")
    (folder / "c.frag").write_text("void main() {}\n")
    monkeypatch.setattr("depthwalk.gpu.shader_source.shader_root", lambda: tmp_path)
    scope = gl_device.scope("test")
    with pytest.raises(GpuError, match=r"shaders/broken/b\.glsl:2"):
        _ = Program(scope, "broken/a.vert", "broken/c.frag").gl
    scope.release()


def test_a_uniform_that_no_shader_has_is_an_error(gl_device: Device) -> None:
    scope = gl_device.scope("test")
    program = Program(scope, "common/fullscreen.vert", "resolve/add.frag")
    with pytest.raises(KeyError, match="lit_textur'"):
        program.set(lit_textur=0)
    scope.release()


def test_everything_made_is_released(gl_device: Device, studio: Studio) -> None:
    before = dict(+gl_device.live)
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), ground={"height": 0.0}, sky={})
    studio.picture(scene, ShapeLibrary([sphere(columns=32, rows=16)], resolution=64), Camera((0, 1, 4), (0, 1, 0), 0.8))
    assert dict(+gl_device.live) == before


def test_constants_of_python_reach_the_shaders(
    gl_device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Numbers by name or another one, enumerations by their members, records by where their fields begin."""
    folder = tmp_path / "some"
    folder.mkdir()
    (folder / "a.glsl").write_text(
        "#from depthwalk.cook.lod_geometry import BORDER, EASE as MOST_EASE   // by other names, too\n"
        "#from depthwalk.bake.images import Face\n"
        "#from depthwalk.render.draw.material_depth import SURFACE_RECORD\n"
        "#from depthwalk.cook.texel_encoding import DEPTH_PERIOD\n"
        "#from depthwalk.colour import LUMINANCE\n"
        "#from depthwalk.render.lighting.sky import RGB_FROM_XYZ\nfloat after;\n"
    )
    monkeypatch.setattr("depthwalk.gpu.shader_source.shader_root", lambda: tmp_path)
    lines = ShaderSource("some/a.glsl").text.splitlines()
    for expected in (
        f"#define BORDER {BORDER}",
        f"#define MOST_EASE {EASE}",
        "#define FACE_SIDE 1",
        "#define SURFACE_RECORD_TEXELS 3",
        "#define SURFACE_RECORD_ROTATION 1",
        f"#define DEPTH_PERIOD {DEPTH_PERIOD}",
        "#define LUMINANCE vec3(0.2126, 0.7152, 0.0722)",
        "#define RGB_FROM_XYZ mat3(3.2406, -0.9689, 0.0557, -1.5372, 1.8758, -0.204, -0.4986, 0.0415, 1.057)",
    ):
        assert expected in lines
    assert lines[lines.index("float after;") - 1] == "#line 7 0"


@pytest.mark.parametrize(
    "line",
    [
        "#from depthwalk.cook.lod_geometry import NO_SUCH",
        "#from depthwalk.render.no_such import BORDER",
        "#from depthwalk.cook.lod_geometry import GRID_LAYOUT",
    ],
)
def test_a_constant_that_python_has_not_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str) -> None:
    folder = tmp_path / "some"
    folder.mkdir()
    (folder / "a.glsl").write_text(f"// A comment.\n{line}\n")
    monkeypatch.setattr("depthwalk.gpu.shader_source.shader_root", lambda: tmp_path)
    with pytest.raises(GpuError, match=r"shaders/some/a\.glsl:2: "):
        ShaderSource("some/a.glsl")


def test_every_shader_says_what_it_does() -> None:
    files = [path for path in shader_root().rglob("*") if path.suffix in (".glsl", ".vert", ".frag")]
    assert len(files) > 70
    for path in files:
        assert re.match(r"// [A-Z]\w+s ", path.read_text(encoding="utf-8")), path


def test_nothing_is_written_that_some_compilers_refuse() -> None:
    """Mesa allows extensions after code, too; Khronos' compiler takes any `.length` for a method of arrays."""
    for path in shader_root().rglob("*.*"):
        text = re.sub(r"//.*", "", ShaderSource(path.relative_to(shader_root()).as_posix()).text)
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        code = next((number for number, line in enumerate(lines) if not line.startswith("#")), len(lines))
        assert not any(line.startswith("#extension") for line in lines[code:]), path
        assert not re.search(r"\.length\b(?!\()", text), path


def test_constants_that_shaders_name_exist_and_are_used() -> None:
    """`ShaderSource` raises GpuError for one that does not exist."""
    line = re.compile(r"^#from (\S+) import ([^/\n]+)", re.MULTILINE)
    for path in shader_root().rglob("*.*"):
        ShaderSource(path.relative_to(shader_root()).as_posix())
        text = path.read_text(encoding="utf-8")
        for _, items in line.findall(text):
            for item in items.split(","):
                name = item.split(" as ")[-1].strip()
                used = re.search(rf"\b{name.upper() if name == 'Face' else name}(_\w+)?\b", line.sub("", text))
                assert used, f"{path.name}: {name}"
