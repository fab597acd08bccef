"""Depth images lit in pass 1 (`light.mode: warp`): against light per pixel, known shapes, and what is kept."""

from typing import Any

import moderngl
import numpy as np
import pytest

from depthwalk.colour import linear_from_srgb
from depthwalk.gpu.device import Device
from depthwalk.gpu.shader_source import ShaderSource
from depthwalk.reference.light import Surfaces
from depthwalk.reference.tile_light import filtered_light, forward_light
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.impostors.tile_records import WARP_RECORD
from depthwalk.render.lighting.harmonics import polynomials
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.resources.depth_image_object import DEPTH_OBJECT_BLOCK, depth_object_record
from depthwalk.render.targets import Targets
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from modes import AaName
from shapes import ShapeLibrary, box, joined, scene_of, sphere
from stage import OnScreen, set_all

SIZE = (160, 120)
CAMERA = Camera((0.4, 1.3, 3.4), (0.0, 0.7, 0), 0.7)
PAPER = {"warp.tile_mapping": "plane", "warp.reuse_error": 0.0, "composite.parallax_steps": 0}
Picture = tuple[Array, Array]


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    """A ball, a box, and a ball of many small faces in two colours."""
    stripes = [
        box(0.8, 0.05, 0.8, (0, 0.025 + 0.05 * k, 0), colour=(230, 230, 230) if k % 2 else (30, 30, 30))
        for k in range(16)
    ]
    return ShapeLibrary([sphere(0.7, 128, 64), box(0.8, 0.8, 0.8, (0, 0.4, 0)), joined(*stripes)], resolution=64)


def picture(scene: Scene, library: ShapeLibrary, mode: str, camera: Camera = CAMERA, **settings: Any) -> Picture:
    """Linear RGB (H, W, 3), and the depth (H, W), metres."""
    set_all(scene.render, {"light.mode": mode, **{key.replace("__", "."): value for key, value in settings.items()}})
    with HeadlessRenderer(scene, library, SIZE) as headless:
        headless.draw(View(camera, SIZE), linear=True)
        image = headless.linear_image()
        return image.colour[..., :3].astype(float), image.distance


def both(scene: Scene, library: ShapeLibrary, camera: Camera = CAMERA, **settings: Any) -> tuple[Array, Array]:
    """What is lit in pass 1, and what is lit per pixel."""
    (tiles, depth), (pixels, same) = (picture(scene, library, mode, camera, **settings) for mode in ("warp", "forward"))
    assert np.array_equal(depth, same)
    return tiles, pixels


def test_vertices_carry_what_finds_their_point_again(gl_device: Device) -> None:
    """(λ·P, λ), linear over the plane, and the viewer, from warp.vert."""
    records = np.zeros(1, WARP_RECORD)
    records["right"], records["up"], records["normal"] = [1, 0, 0, 0.3], [0, 1, 0, -0.2], [0, 0, 1, 1.0]
    records["depths"], records["to_w"], records["rotation"] = [2.5, 1, 0], [0, 0, 1], [0, 0.6, 0, 0.8]
    samples = np.random.default_rng(2).integers(0, 65536, (50, 4)).astype(np.uint16)
    samples[:, 3] = 0  # no flags
    scope = gl_device.scope("test")
    varyings = ("surface_point", "seen_from", "rotation")
    program = gl_device.context.program(
        vertex_shader=ShaderSource("warp/warp.vert", "#define LIT\n").text, varyings=varyings
    )
    members: Any = program
    members["DepthObject"].binding = DEPTH_OBJECT_BLOCK["DepthObject"]
    block = scope.buffer(depth_object_record(box_low=-1, box_size=2))
    block.bind_to_uniform_block(DEPTH_OBJECT_BLOCK["DepthObject"])
    vertices, instances = scope.buffer(samples), scope.buffer(records)
    layout = "4f 4f 4f 3f 36x 16x 4f/i"
    names = ["in_right", "in_up", "in_normal", "in_depths", "in_rotation"]
    array = gl_device.context.vertex_array(program, [(vertices, "4u2", "in_sample"), (instances, layout, *names)])
    out = scope.buffer(reserve=44 * 50)
    scope.framebuffer([scope.texture((4, 4), 4)]).use()
    array.transform(out, moderngl.POINTS, vertices=50)
    found = np.frombuffer(out.read(), np.float32).reshape(50, 11)
    array.release()
    program.release()
    scope.release()
    point = samples[:, :3] / 65535 * 2.0 - 1
    lam = 2.5 / (2.5 + 1.0 - point[:, 2])
    assert found[:, :4] == pytest.approx(np.column_stack([lam[:, None] * point, lam]), abs=1e-5)
    assert found[:, 4:7] == pytest.approx(np.tile([0.3, -0.2, 3.5], (50, 1)), abs=1e-5)
    assert found[:, 7:] == pytest.approx(np.tile([0, 0.6, 0, 0.8], (50, 1)))


@pytest.mark.gl
@pytest.mark.parametrize("settings", [{}, PAPER], ids=["screen", "plane"])
def test_smooth_surfaces_look_as_if_lit_per_pixel(library: ShapeLibrary, settings: dict[str, Any]) -> None:
    """Where nothing changes from texel to texel, the filter changes nothing: two balls, turned and scaled."""
    scene = scene_of((0, (-0.7, 0, 0), 0.9, 1.0), (0, (0.7, 0.2, -0.3), 2.5, 0.8), sky={"light": True}, ground={})
    set_all(scene.render, settings)
    tiles, pixels = both(scene, library)
    difference = np.abs(tiles - pixels).max(-1)
    assert np.quantile(difference, 0.99) < 0.01 and (difference > 0.05).mean() < 0.002


@pytest.mark.gl
def test_a_ball_is_lit_as_its_twin_says() -> None:
    """Its highlight and its shade, in tiles on the plane, from the surface that the formula of a ball has."""
    scene = scene_of((0, (0, 0, 0), 0.7, 1.0))
    set_all(scene.render, {"light.mode": "warp", "lod.error": 0.0, **PAPER})
    camera, centre = Camera((1.0, 1.8, 3.6), (0, 1, 0), 0.6), np.array([0, 1.0, 0])
    with HeadlessRenderer(scene, ShapeLibrary([sphere()], resolution=64), SIZE) as headless:
        view = View(camera, SIZE)
        headless.draw(view, linear=True)
        shown = headless.linear_image()
    x, y = np.meshgrid((np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1, 1 - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2)
    ray = np.stack([x, y, np.ones_like(x)], -1) @ view.ray_from_screen.T
    known = np.isfinite(shown.distance)
    point = view.position + np.where(known, shown.distance, 0)[..., None] * ray
    normal, away = point - centre, ray / np.linalg.norm(ray, axis=-1, keepdims=True)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    inner = known & ((normal * -away).sum(-1) > 0.3)
    n, light = inner.sum(), lighting(scene.environment)
    expected = forward_light(
        Surfaces(
            albedo=np.tile(linear_from_srgb(np.array([200, 120, 80]) / 255), (n, 1)),
            specular=np.full(n, 0.15),
            normal=normal[inner],
            shininess=np.full(n, 32.0),
        ),
        away[inner],
        np.array([0, 0, 0, 1.0]),  # of a ball all turns are one
        light.to_sun,
        light.sun,
        polynomials(normal[inner]) @ light.ambient,
    )
    error = np.abs(shown.colour[inner][:, :3] - expected).max(-1)
    assert n > 2000 and np.median(error) < 0.01 and np.quantile(error, 0.98) < 0.03


@pytest.mark.gl
def test_detail_is_lost_that_is_finer_than_a_texel(library: ShapeLibrary) -> None:
    """Per pixel the stripes of the box are looked up as sharp as they are; in a coarse tile they blur into grey."""
    scene = scene_of((2, (0, 0.2, 0), 0.4, 1.0))
    set_all(scene.render, PAPER)
    camera = Camera((0.3, 0.7, 1.6), (0.0, 0.6, 0), 0.7)
    fine, coarse = (both(scene, library, camera, warp__tile_scale=scale) for scale in (1.0, 0.25))
    edges = [np.square(np.diff(image[30:90, 60:100].mean(-1), axis=0)).mean() for image in (*fine, *coarse)]
    assert edges[2] < 0.6 * edges[3] and edges[0] > 0.7 * edges[1] and edges[1] == pytest.approx(edges[3], rel=0.01)
    assert coarse[0].mean() == pytest.approx(coarse[1].mean(), rel=0.05)


@pytest.mark.gl
def test_pass_two_filters_as_its_twin(gl_device: Device, library: ShapeLibrary) -> None:
    """Each pixel of a ball against the texels of its tile, read back."""
    scene = scene_of((0, (0, 0, 0), 0.3, 1.0))
    set_all(scene.render, {"light.mode": "warp", "warp.tile_scale": 0.3, **PAPER})
    with OnScreen(gl_device, scene, library, SIZE) as stage:
        stage.draw(View(CAMERA, SIZE))
        targets, plan = stage.renderer.targets, stage.renderer.plan
        assert targets is not None and plan is not None
        record = plan.composite.records[0]
        width, height = targets.atlas_size
        light = np.frombuffer(targets.atlas_light.read(), np.float16).reshape(height, width, 4).astype(float)
        stored = np.frombuffer(targets.atlas_depth.read(), np.float32).reshape(height, width)
        shown = np.frombuffer(targets.tile_light.read(), np.float16).reshape(*SIZE[::-1], 4).astype(float)
        depth = np.frombuffer(targets.depth.read(), np.float32).reshape(*SIZE[::-1])
        view = stage.renderer.view
    assert view is not None
    i, j, tile_width, tile_height = record["tile"].astype(int)
    here = np.s_[j : j + tile_height, i : i + tile_width]
    rows, columns = np.nonzero(depth < 1)
    screen = np.column_stack([columns + 0.5, rows + 0.5]) / SIZE * 2 - 1
    ray = np.column_stack([screen, np.ones(len(rows))]) @ view.ray_from_screen.T
    x, y, z, w = record["rotation"]
    turn = np.array([[1 - 2 * (y * y), 0, 2 * w * y], [0, 1, 0], [-2 * w * y, 0, 1 - 2 * y * y]])
    assert abs(x) + abs(z) == 0  # upright
    local = ray @ turn  # into the object's frame
    along = -record["normal"][3] / (local @ record["normal"][:3])
    plane = np.column_stack([local @ record[axis][:3] * along for axis in ("right", "up")])  # from the epipole
    at = np.column_stack([plane, np.ones(len(rows))]) @ np.stack([record[name] for name in ("to_x", "to_y", "to_w")]).T
    expected = filtered_light(light[here][..., :3], stored[here] < 1, at[:, :2] / at[:, 2:])
    error = np.abs(shown[rows, columns, :3] - expected).max(-1)
    assert len(rows) > 1500 and np.quantile(error, 0.97) < 2e-3  # but for silhouettes


@pytest.mark.gl
@pytest.mark.parametrize("aa", ["none", "msaa", "coverage", "gpaa"])
def test_shadows_fall_on_what_pass_one_has_lit(aa: AaName, library: ShapeLibrary) -> None:
    """Two boxes partly in the shadow of a ball of polygons; sun and sky differ in colour."""
    places = (1, (-0.5, 0, 0), 0.0, 1.0), (1, (0.7, 0, 0), 0.0, 1.2), (0, (0.5, 0.3, 1.3), 0.0, 0.5)
    sun = {"direction": (-0.4, -0.25, -0.8), "colour": (1.0, 0.8, 0.5)}
    scene = scene_of(*places, ground={}, sun=sun, ambient={"colour": (0.5, 0.6, 1.0), "intensity": 0.4})
    scene.objects.representation[2] = Representation.MESH
    camera = Camera((-1, 1.4, 3.4), (0.1, 0.5, 0), 0.8)
    without = both(scene, library, camera, aa=aa)[0]
    tiles, pixels = both(scene, library, camera, aa=aa, shadows__enabled=True)
    difference = np.abs(tiles - pixels).max(-1)
    assert np.quantile(difference, 0.98) < 0.01
    assert ((without - tiles).max(-1) > 0.1).sum() > 300


@pytest.mark.gl
def test_what_has_no_tile_is_lit_per_pixel(library: ShapeLibrary) -> None:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), (1, (0.9, 0, -0.4), 0.4, 1.0))
    scene.objects.representation[:] = Representation.DMESH
    tiles, pixels = both(scene, library)
    assert np.array_equal(tiles, pixels) and tiles.max() > 0.3
    scene.objects.representation[0] = Representation.DPCI
    tiles, pixels = both(scene, library)
    assert np.quantile(np.abs(tiles - pixels), 0.99) < 0.01


@pytest.mark.gl
def test_members_of_far_clusters_are_lit_in_their_own_frames(library: ShapeLibrary) -> None:
    rng = np.random.default_rng(1)
    places = [(k % 2, (*rng.uniform(-6, 6, 2), -40.0 - k % 7), 6 * rng.random(), 1.0) for k in range(200)]
    scene = scene_of(*places)
    settings = {"warp__cluster_pixels": 64.0, "culling__occlusion": False}
    tiles, pixels = both(scene, library, Camera((0, 0.5, 0), (0, 0.5, -40), 0.5), **settings)
    assert np.quantile(np.abs(tiles - pixels), 0.99) < 0.01
    apart, _ = both(scene, library, Camera((0, 0.5, 0), (0, 0.5, -40), 0.5), warp__cluster_pixels=0.0)
    assert np.abs(tiles - apart).mean() < 0.01 < tiles.mean()


@pytest.mark.gl
def test_tiles_show_their_tints_when_asked(library: ShapeLibrary) -> None:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0))
    tiles, pixels = both(scene, library, composite__show_tiles=True)
    assert np.array_equal(tiles, pixels)


def test_tiles_are_kept_with_their_light_until_it_changes(gl_device: Device, library: ShapeLibrary) -> None:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0))
    scene.render.light.mode = "warp"
    view = View(CAMERA, SIZE)
    with OnScreen(gl_device, scene, library, SIZE) as stage:
        stage.renderer.remembers = True
        warped = [stage.draw(view)["warped"] for _ in range(2)]
        scene.environment.sun.intensity = 0.2
        warped += [stage.draw(view)["warped"] for _ in range(2)]
        scene.render.light.mode = "deferred"
        warped += [stage.draw(view)["warped"] for _ in range(2)]
        scene.environment.sun.intensity = 0.9
        warped += [stage.draw(view)["warped"]]
        scene.render.light.mode = "warp"
        warped += [stage.draw(view)["warped"]]
    assert warped == [1, 0, 1, 0, 1, 0, 0, 1]


def test_colours_have_room_in_the_atlas_only_where_they_are_lit(gl_device: Device, library: ShapeLibrary) -> None:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0))
    for mode in ("deferred", "forward", "warp", "forward"):
        set_all(scene.render, {"light.mode": mode})
        with OnScreen(gl_device, scene, library, SIZE) as stage:
            stage.draw(View(CAMERA, SIZE))
            targets = stage.renderer.targets
            assert targets is not None
            names = ("atlas_light", "tile_light", "lit_atlas", "lit_visibility", "one_lit_sample")
            assert {hasattr(targets, name) for name in names} == {mode == "warp"}


def test_targets_without_lit_tiles_have_no_texture_for_them(gl_device: Device) -> None:
    targets = Targets(gl_device, SIZE)
    assert targets.drawn.tile_light is None and not hasattr(targets, "tile_light")
    targets.release()
