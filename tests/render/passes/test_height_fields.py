"""Every way to draw a height field shows the true displaced surface, each as well as it can."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from depthwalk.bake.planar import bake_planar
from depthwalk.gpu.device import Device
from depthwalk.reference.height_field import distance_hits, parallax_hits
from depthwalk.render.image import read_pixels
from depthwalk.render.passes import relief_texture
from depthwalk.render.resources.distance_volume import distance_volume
from depthwalk.render.resources.height_field import texel_triangles
from depthwalk.scene.arrays import HEIGHT_FIELDS, Representation
from depthwalk.types import Array
from fields import (
    HEIGHT,
    RANGE,
    SIDE,
    VIEWS,
    WIDTH,
    depths,
    drawn_distance,
    field_library,
    image_of,
    parts_off,
    picture_distance,
    surface_mesh,
    true_distance,
    twin_distance,
)
from shapes import ShapeLibrary, box, scene_of
from stage import OnScreen, set_all

RELIEF, DISTANCE, PARALLAX, BUMP, DISPLACEMENT, RELIEF_TEXTURE, BAR_TEXTURE = HEIGHT_FIELDS
PLACES = [(0, -0.5, 0.1, -0.4, 0.5, 0.5), (0, 0.3, 0.2, 0.1, -0.4, 0.4), (1, 0.4, 0.9, -0.6, -0.7, 0.6)]
PLACES += [(0, -0.6, 1.0, -0.2, 0.3, 0.3)]
SLICE = RANGE / 16  # of the volume of distances, metres


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("kind", ["cap", "ramp", "step", "wire"])
def test_rays_meet_the_mesh_of_the_surface(gl_device: Device, kind: str, view: str) -> None:
    """The reference that all are measured by: rays against triangles."""
    depth = depths(kind)
    mesh = drawn_distance(gl_device, depth, Representation.MESH, VIEWS[view])
    assert parts_off(true_distance(depth, VIEWS[view]), mesh, 0.002) < (0.002, 0.002)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize(
    ("representation", "kind", "within", "most"),
    [
        (RELIEF, "cap", 0.002, 0.001),
        (RELIEF, "ramp", 0.002, 0.001),
        (RELIEF, "step", 0.002, 0.03),  # a tenth of the way may pass the corner of the step
        (DISTANCE, "cap", 1.6 * SLICE, 0.05),
        (DISTANCE, "ramp", 1.6 * SLICE, 0.03),
        (DISTANCE, "step", 1.6 * SLICE, 0.01),
        (DISPLACEMENT, "cap", 0.002, 0.001),
        (DISPLACEMENT, "ramp", 0.002, 0.001),
        (DISPLACEMENT, "step", 0.002, 0.001),
        (DISPLACEMENT, "wire", 0.002, 0.001),
        (RELIEF_TEXTURE, "cap", 0.01, 0.02),  # silhouettes within half a texel, which is more than a pixel here
        (RELIEF_TEXTURE, "ramp", 0.003, 0.025),
        (RELIEF_TEXTURE, "step", 0.01, 0.03),
        (RELIEF_TEXTURE, "wire", 0.01, 0.025),
        (
            BAR_TEXTURE,
            "cap",
            WIDTH / SIDE,
            0.04,
        ),  # a texel is one bar, and the outermost reach half a texel beyond the picture
        (BAR_TEXTURE, "ramp", WIDTH / SIDE, 0.04),
        (BAR_TEXTURE, "step", WIDTH / SIDE, 0.04),
        (BAR_TEXTURE, "wire", WIDTH / SIDE, 0.04),
    ],
)
def test_the_surface_is_where_it_should_be(
    gl_device: Device, representation: Representation, kind: str, within: float, most: float, view: str
) -> None:
    """Within so many metres along the view axis, but for so large a part of the pixels; so are silhouettes."""
    depth = depths(kind)
    found = drawn_distance(gl_device, depth, representation, VIEWS[view])
    assert max(parts_off(found, true_distance(depth, VIEWS[view]), within)) < most


@pytest.mark.parametrize(("view", "steps"), [*((view, (10, 6)) for view in VIEWS), ("aside", (5, 1))])
def test_relief_mapping_searches_as_published(gl_device: Device, view: str, steps: tuple[int, int]) -> None:
    """The same points as the twin with the same steps, be they right or not."""
    depth, settings = depths("wire"), {"relief.linear_steps": steps[0], "relief.binary_steps": steps[1]}
    found = drawn_distance(gl_device, depth, RELIEF, VIEWS[view], settings)
    assert max(parts_off(found, true_distance(depth, VIEWS[view], steps), 1e-4)) < 0.001


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("kind", ["cap", "wire"])
def test_parallax_searches_as_its_twin(gl_device: Device, kind: str, view: str) -> None:
    depth, settings = depths(kind), {"parallax.min_steps": 4, "parallax.max_steps": 12}
    found = drawn_distance(gl_device, depth, PARALLAX, VIEWS[view], settings)
    twin = twin_distance(
        depth,
        VIEWS[view],
        lambda field, viewer, rays, size: parallax_hits(field, viewer, rays, size=size, min_steps=4, max_steps=12),
    )
    assert max(parts_off(found, twin, 1e-4)) < 0.002


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("kind", ["cap", "wire"])
def test_sphere_tracing_searches_as_its_twin(gl_device: Device, kind: str, view: str) -> None:
    depth, settings = depths(kind), {"distance.slices": 16, "distance.steps": 8}
    volume = distance_volume(bake_planar(image_of(depth), "field"), (SIDE, SIDE, 16))
    found = drawn_distance(gl_device, depth, DISTANCE, VIEWS[view], settings)
    twin = twin_distance(
        depth,
        VIEWS[view],
        lambda field, viewer, rays, size: distance_hits(field, volume, viewer, rays, size=size, steps=8),
    )
    assert max(parts_off(found, twin, 1e-3)) < 0.01  # drivers filter with 8 bits


def test_relief_mapping_misses_what_is_thin(gl_device: Device) -> None:
    """Of a picture with a wire before a plane, seen aside, 1.5 % show the plane in its place; with 3 steps 9 %."""
    depth, view = depths("wire"), VIEWS["aside"]
    missed = [
        parts_off(
            drawn_distance(gl_device, depth, RELIEF, view, {"relief.linear_steps": steps}),
            true_distance(depth, view),
            0.01,
        )[0]
        for steps in (3, 10, 100)
    ]
    assert 0.07 < missed[0] < 0.11 and 0.01 < missed[1] < 0.02 and missed[2] < 0.003


def test_more_slices_of_distances_are_more_exact(gl_device: Device) -> None:
    """The surface is between the last texel before it and the first behind it."""
    depth, view = depths("cap"), VIEWS["front"]
    off = [
        parts_off(
            drawn_distance(gl_device, depth, DISTANCE, view, {"distance.slices": slices, "distance.steps": 64}),
            true_distance(depth, view),
            SLICE,
        )[0]
        for slices in (16, 64)
    ]
    assert off[1] < 0.03 < 0.15 < off[0]


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("kind", ["cap", "ramp"])
def test_parallax_finds_the_surface_but_no_silhouette(gl_device: Device, kind: str, view: str) -> None:
    depth = depths(kind)
    found, true = drawn_distance(gl_device, depth, PARALLAX, VIEWS[view]), true_distance(depth, VIEWS[view])
    plane = true_distance(np.zeros_like(depth), VIEWS[view])
    assert (np.isfinite(found) != np.isfinite(plane)).mean() < 0.001
    either = np.isfinite(plane) & np.isfinite(true)
    assert (np.abs(found[either] - true[either]) > 0.002).mean() < 0.001


@pytest.mark.parametrize(
    ("view", "few", "many"),
    [("front", {"parallax.min_steps": 1}, {"parallax.min_steps": 50}), ("aside", {"parallax.max_steps": 8}, {})],
)
def test_parallax_takes_as_many_steps_as_are_set(
    gl_device: Device, view: str, few: dict[str, int], many: dict[str, int]
) -> None:
    """Those of rays at a right angle decide in front, those of flat rays at the side."""
    depth, true = depths("wire"), true_distance(depths("wire"), VIEWS[view])
    off = [
        parts_off(drawn_distance(gl_device, depth, PARALLAX, VIEWS[view], steps), true, 0.002)[0]
        for steps in (few, many)
    ]
    assert off[0] > 1.5 * off[1]


@pytest.mark.parametrize("view", VIEWS)
def test_bumps_are_on_the_plane(gl_device: Device, view: str) -> None:
    depth = depths("cap")
    found = drawn_distance(gl_device, depth, BUMP, VIEWS[view])
    assert max(parts_off(found, true_distance(np.zeros_like(depth), VIEWS[view]), 1e-4)) < 0.001


@pytest.mark.parametrize("representation", HEIGHT_FIELDS)
def test_meshes_hide_height_fields_and_are_hidden(gl_device: Device, representation: Representation) -> None:
    """The depth written is the true one: the nearer of a box and a field that it pierces is in front everywhere."""
    library = field_library(depths("cap"), box(0.5, 0.7, 0.5))
    places = (0, (0, 0, 0), 0.0, 1.0), (1, (0.3, 0, -0.25), 0.4, 1.0)
    kinds = [representation, Representation.MESH]
    alone = []
    for place, kind in zip(places, kinds, strict=True):
        with OnScreen(gl_device, scene_of(place, representation=kind), library) as stage:
            alone.append(picture_distance(stage, VIEWS["front"]))
    scene = scene_of(*places)
    scene.objects.representation[:] = kinds
    with OnScreen(gl_device, scene, library) as stage:
        both = picture_distance(stage, VIEWS["front"])
        counts, shares = stage.counts, stage.renderer.sample_shares().count()
    assert ((alone[0] < alone[1]) & np.isfinite(alone[1])).any() and (
        (alone[1] < alone[0]) & np.isfinite(alone[0])
    ).any()
    np.testing.assert_allclose(both, np.minimum(*alone), rtol=1e-4)
    assert (counts["height_fields"], counts["mesh"], counts["dpci"]) == (1, 1, 0)
    assert shares[2] > 0 and shares[3] > 0 and shares[0] == shares[1] == 0


def test_relief_textures_are_warped_for_each_object(gl_device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """All of a picture in one call or few at a time, each is seen as if it were alone."""
    places, view = [(asset, (x, y, z), turn, scale) for asset, x, y, z, turn, scale in PLACES], VIEWS["front"]
    pictures = depths("cap"), np.ascontiguousarray(depths("ramp")[:, ::3])
    baked = [bake_planar(image_of(depth), f"field {depth.shape}", cut=False) for depth in pictures]
    library = ShapeLibrary([surface_mesh(depth) for depth in pictures], baked)

    def drawn(*some: tuple[int, tuple[float, float, float], float, float]) -> Array:
        with OnScreen(gl_device, scene_of(*some, representation=RELIEF_TEXTURE), library) as stage:
            return picture_distance(stage, view)

    alone = np.minimum.reduce([drawn(place) for place in places])
    np.testing.assert_allclose(drawn(*places), alone, rtol=1e-4)
    assert np.isfinite(alone).any()
    monkeypatch.setattr(relief_texture, "_MOST_BYTES", 2 * 4 * (2 * SIDE) ** 2)
    np.testing.assert_allclose(drawn(*places), alone, rtol=1e-4)


@pytest.mark.parametrize("representation", HEIGHT_FIELDS)
def test_empty_texels_show_nothing(gl_device: Device, representation: Representation) -> None:
    """A hole shows what is behind, without walls; nothing is seen from behind either."""
    depth = depths("ramp")
    depth[30:60, 20:50] = np.inf
    view = VIEWS["front"]
    found = drawn_distance(gl_device, depth, representation, view)
    whole = drawn_distance(gl_device, depths("ramp"), representation, view)
    hole = np.isfinite(whole) & ~np.isfinite(found)
    rows, columns = np.nonzero(hole)
    assert 0.03 < hole.sum() / np.isfinite(whole).sum() < 0.15
    assert hole[rows.min() : rows.max(), columns.min() : columns.max()].mean() > 0.8
    behind = replace(view, camera=replace(view.camera, position=(0.2, 0.8, -1.6)))
    assert not np.isfinite(drawn_distance(gl_device, depth, representation, behind)).any()


@pytest.mark.parametrize("representation", HEIGHT_FIELDS)
def test_what_has_no_height_field_is_drawn_as_the_scene_says(gl_device: Device, representation: Representation) -> None:
    library = field_library(depths("cap"), box(0.5, 0.7, 0.5))
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), (1, (0.3, 0, -0.25), 0.4, 1.0))
    scene.objects.representation[1] = Representation.MESH
    with OnScreen(gl_device, scene, library) as stage:
        stage.renderer.world.representation = representation
        stage.draw(VIEWS["front"])
        assert (stage.counts["height_fields"], stage.counts["mesh"], stage.counts["dpci"]) == (1, 1, 0)


def test_distances_are_those_to_the_surface() -> None:
    """Before a plane, the depth that is left; behind it, 0."""
    depth = np.full((64, 64), 0.2, np.float32)
    depth[0, 0] = 0.3  # the back of the volume
    volume = distance_volume(bake_planar(image_of(depth), "plane", cut=False), (64, 64, 16))
    middle = volume[:, 40, 40]
    expected = np.maximum(0.2 - (np.arange(16) + 0.5) / 16 * 0.3, 0)
    np.testing.assert_allclose(middle, expected, atol=0.75 * max(WIDTH, HEIGHT) / 64)
    assert middle[-1] == 0


def test_triangles_face_the_viewer_and_leave_out_empty_texels() -> None:
    solid = np.ones((3, 4), bool)
    solid[0, 0] = False
    triangles = texel_triangles(solid)
    assert len(triangles) == 2 * 6 - 1 and not (triangles == 0).any()
    u, v = triangles % 4, triangles // 4
    a, b, c = (np.stack([u, v], -1)[:, k].astype(int) for k in range(3))
    first, second = (b - a).T, (c - a).T
    assert (first[0] * second[1] - first[1] * second[0] == -1).all()  # u × v points away from the viewer
    assert texel_triangles(np.zeros((3, 4), bool)).tolist() == [[0, 0, 0]]


@pytest.mark.parametrize(
    "mode", [{"aa": "msaa"}, {"aa": "gpaa"}, {"light.mode": "warp"}, {"light.mode": "forward", "shadows.enabled": True}]
)
def test_height_fields_are_lit_and_smoothed_as_the_rest(gl_device: Device, mode: dict[str, object]) -> None:
    """Drawn by most of them the picture is that of impostors; what was made is freed."""
    before, pictures = Counter(gl_device.live), []
    for kind in (Representation.DPCI, RELIEF, DISPLACEMENT, RELIEF_TEXTURE, DISTANCE, PARALLAX, BUMP):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=kind)
        set_all(scene.render, mode)
        with OnScreen(gl_device, scene, field_library(depths("cap"))) as stage:
            stage.draw(VIEWS["aside"])
            pictures.append(read_pixels(stage.screen)[..., :3].astype(float))
    off = [float(np.abs(picture - pictures[0]).mean()) for picture in pictures[1:]]
    assert max(off[:2]) < 0.5 < off[5] and off[2] < 0.8
    assert Counter(gl_device.live) == before  # zeros do not count
