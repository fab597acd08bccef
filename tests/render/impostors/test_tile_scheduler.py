"""Intermediate images that are kept: the bound on their error, what invalidates them, and the pictures they make."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

from depthwalk.geometry.support_function import box_footprint
from depthwalk.reference.warp import warp
from depthwalk.render.draw.planner import Planner, PlanSettings
from depthwalk.render.impostors.reprojection_error import HARDEST, due, parallax
from depthwalk.render.impostors.tile_mapping import Tiles
from depthwalk.render.impostors.tile_records import tile_records
from depthwalk.render.impostors.warp_planes import Volumes, choose_planes, depths_behind
from depthwalk.render.renderer import Renderer, read_pixels
from depthwalk.render.view.bounds import object_bounds
from depthwalk.render.view.view import View
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import Camera
from depthwalk.scene.render_settings import LodParams, MeshLodParams, TileParams
from shapes import ShapeLibrary, box, joined, scene_of, sphere

FOCAL = 800.0


def angle_between(a, b):
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ni,ni->n", a, b))


def test_no_point_is_shown_farther_off_than_the_bound():
    """Random points in boxes, seen by random viewers from tiles that were warped for others."""
    rng = np.random.default_rng(2)
    count = 20000
    one = np.ones(count)
    half = rng.uniform(0.2, 0.7, (2, count))
    volumes = Volumes(
        radius=0.7 * one, bottom=-0.2 * one, top=1.9 * one, footprint=box_footprint(*half), has_side=one > 0
    )
    there = rng.normal(size=(count, 3))
    there *= (rng.uniform(2.4, 30, count) / np.linalg.norm(there, axis=1))[:, None]
    moved = rng.normal(size=(count, 3))
    moved *= (np.linalg.norm(there, axis=1) * 10 ** rng.uniform(-3, -0.3, count) / np.linalg.norm(moved, axis=1))[
        :, None
    ]
    here = there + moved
    planes = choose_planes(there, volumes)
    tiles = Tiles(
        texel=np.tile(np.eye(3), (count, 1, 1)), nearest=one, size=np.ones((count, 2), int), pixel=np.zeros((count, 2))
    )
    records = tile_records(there, planes, depths_behind(planes, volumes), tiles, np.zeros((count, 2), int))
    bound = parallax(records, here, FOCAL)

    angle, radius = rng.uniform(0, 2 * np.pi, count), 0.7 * np.sqrt(rng.uniform(0, 1, count))
    point = np.stack([radius * np.cos(angle), rng.uniform(-0.2, 1.9, count), radius * np.sin(angle)], -1)
    inside = (np.abs(point[:, 0]) <= half[0]) & (np.abs(point[:, 2]) <= half[1]) & np.isfinite(bound)
    position, _ = warp(point, planes)
    # What the texel shows is drawn at the middle λ of its object.
    middle = records["reach"][:, 2:].mean(1)
    axes = position[:, :1] * planes.right + position[:, 1:] * planes.up - planes.distance[:, None] * planes.normal
    drawn = there + axes / middle[:, None]
    off = FOCAL * angle_between(drawn - here, point - here)
    slack = 1e-3 + 1e-4 * bound
    assert inside.sum() > 5000
    assert (off <= bound + slack)[inside].all()
    assert np.quantile((off / bound)[inside], 0.99) > 0.3  # and not far from it


def test_tiles_wait_for_their_turn_but_not_for_ever():
    error = np.array([0.5, 3.0, 1.5, 5.0, 2.0, np.inf])
    triangles = np.full(6, 100)
    assert due(error, triangles, 1000).tolist() == [False, True, True, True, True, True]
    assert due(error, triangles, 300).tolist() == [False, True, False, True, False, True]
    assert due(error, triangles, 0).tolist() == [False, False, False, True, False, True]


class Walk:
    """The plans of successive frames over balls on a lattice, without GL."""

    def __init__(self, studio, count=6, **layout):
        self.library = ShapeLibrary([sphere(0.5, 32, 16)], resolution=64)
        places = [(0, (1.5 * i, 0, -1.5 * k), 0.0, 1.0) for i in range(-count // 2, count // 2) for k in range(count)]
        self.renderer = Renderer(studio.device, scene_of(*places), self.library)
        self.planner, self.layout, self.atlas = Planner(), TileParams(**{"reuse_error": 0.5} | layout), (1024, 1024)
        self.objects, self.table = self.renderer.world.objects(), self.renderer.world.table()

    def frame(self, position, target, size=(320, 240), objects=None):
        objects = objects or self.objects
        view = View(Camera(position, target, 0.9), size, 0.1, 100.0)
        bounds = object_bounds(objects, self.table.centre, self.table.bounding_radius)
        visible, _ = bounds.visible(view)
        settings = PlanSettings(lod=LodParams(), layout=self.layout, polygons=MeshLodParams(), atlas_size=self.atlas)
        scene = SceneArrays(objects=objects, bounds=bounds, table=self.table, clusters=self.renderer.world.clusters())
        return self.planner.plan(view, scene, visible, settings)


@pytest.fixture
def walk(studio):
    made = []

    def make(**layout):
        made.append(Walk(studio, **layout))
        return made[-1]

    yield make
    for each in made:
        each.renderer.release()


def test_a_camera_that_turns_warps_nothing_anew(walk):
    steps = walk()
    first = steps.frame((0, 1, 9), (0, 0.5, 0))
    assert first.counts["warped"] == first.counts["dpci"] > 20
    for degrees in range(1, 4):
        aside = 9 * np.tan(np.radians(degrees))
        assert steps.frame((0, 1, 9), (aside, 0.5, 0)).counts["warped"] <= 3  # only what comes into the picture
    assert steps.frame((0, 1, 9), (0, 0.5, 0)).counts["warped"] == 0


def test_only_what_is_near_is_warped_after_a_step(walk):
    steps = walk()
    steps.frame((0, 1, 9), (0, 0.5, 0))
    some = steps.frame((0.5, 1, 9), (0.5, 0.5, 0)).counts
    assert 0 < some["warped"] < some["dpci"]
    assert some["tile_error"] <= 1


def test_without_reuse_all_is_warped(walk):
    steps = walk(reuse_error=0)
    for _ in range(2):
        counts = steps.frame((0, 1, 9), (0, 0.5, 0)).counts
        assert counts["warped"] == counts["dpci"]


def test_a_teleport_warps_all(walk):
    steps = walk()
    steps.frame((0, 1, 9), (0, 0.5, 0))
    counts = steps.frame((12, 3, -4), (0, 0.5, -4)).counts
    assert counts["warped"] == counts["dpci"] and counts["tile_error"] == 0


def test_another_size_warps_all(walk):
    steps = walk()
    steps.frame((0, 1, 9), (0, 0.5, 0))
    counts = steps.frame((0, 1, 9), (0, 0.5, 0), size=(400, 300)).counts
    assert counts["warped"] == counts["dpci"]


def test_another_setting_warps_all(walk):
    steps = walk()
    steps.frame((0, 1, 9), (0, 0.5, 0))
    steps.layout.tile_scale = 2.0
    counts = steps.frame((0, 1, 9), (0, 0.5, 0)).counts
    assert counts["warped"] == counts["dpci"]


def test_only_the_object_that_turned_is_warped(walk):
    steps = walk()
    steps.frame((0, 1, 9), (0, 0.5, 0))
    rotation = steps.objects.rotation.copy()
    number = int(np.flatnonzero((steps.objects.position == (0, 0, 0)).all(1))[0])
    rotation[number] = 0, np.sin(0.2), 0, np.cos(0.2)
    turned = replace(steps.objects, rotation=rotation)
    assert steps.frame((0, 1, 9), (0, 0.5, 0), objects=turned).counts["warped"] == 1


def test_the_budget_holds_until_tiles_are_too_far_off(walk):
    steps = walk(budget=300)
    steps.frame((0, 1, 9), (0, 0.5, 0))
    worst = 0.0
    for k in range(1, 16):
        counts = steps.frame((0.03 * k, 1, 9), (0.03 * k, 0.5, 0)).counts
        worst = max(worst, counts["tile_error"])
        assert counts["warped_triangles"] <= 300
    assert 1 < worst <= HARDEST


def test_a_full_atlas_lowers_the_resolution_and_says_so(walk):
    steps = walk()
    steps.atlas = (256, 128)
    lowest = 1.0
    for k in range(20):
        plan = steps.frame((0.3 * k, 1, 7), (0.2 * k, 0.5, 0))
        tiles = plan.composite.records["tile"].astype(int)
        texels = np.zeros((128, 256), int)
        for x, y, width, height in tiles:
            texels[y : y + height, x : x + width] += 1
        assert texels.max() <= 1 and texels.sum() == (tiles[:, 2] * tiles[:, 3]).sum()
        lowest = min(lowest, plan.counts["tile_resolution"])
    assert lowest < 1


def test_what_was_hidden_gives_way(walk):
    """Two rounds of looking about, with room for everything and for a part of it."""
    roomy, tight = walk(count=8), walk(count=8)
    tight.atlas = (512, 720)  # so little that tiles must give way; in 700 it is luck whether the gaps fit
    warped = []
    for steps in (roomy, tight):
        rounds = [2 * np.pi * k / 16 for k in range(16)] * 2
        seen = [steps.frame((0, 6, -5), (3 * np.sin(a), 0, -5 + 3 * np.cos(a))).counts for a in rounds]
        assert all(counts["tile_resolution"] == 1 for counts in seen)
        warped.append(sum(counts["warped"] for counts in seen[16:]))
    assert 4 * warped[0] < warped[1]  # only what the edge of the picture cut off


SIZE = (240, 180)


@pytest.mark.parametrize(("steps", "aa"), [(0, "none"), (1, "none"), (1, "gpaa-edge"), (1, "msaa")])
def test_a_random_walk_shows_what_fresh_images_would(gl_device, steps, aa):
    """No pixel has a colour that the fresh picture lacks within the bound and a texel of it."""
    shape = joined(box(0.9, 0.4, 0.9, (0, 0.2, 0)), sphere(0.4, 48, 24))
    library = ShapeLibrary([shape, sphere(0.5, 48, 24)], resolution=128)
    places = [(k % 2, (1.4 * k - 2.8, 0, -0.5 * k), 0.3 * k, 1.0) for k in range(5)]
    kept, fresh = (scene_of(*places) for _ in range(2))
    kept.render.warp.reuse_error = 1.0
    kept.render.composite.parallax = steps
    kept.render.aa = fresh.render.aa = aa
    scope = gl_device.scope("test")
    screen = scope.framebuffer([scope.texture(SIZE, 4)])
    renderers = [Renderer(gl_device, scene, library) for scene in (kept, fresh)]
    renderers[0].remembers = True
    rng = np.random.default_rng(7)
    position, warped = np.array([0.0, 1.2, 4.5]), 0
    for _ in range(40):
        position += rng.normal(size=3) * [0.06, 0.02, 0.06]
        view = View(Camera(tuple(position), tuple(rng.normal(size=3) * 0.05 + [0, 0.6, 0]), 0.9), SIZE)
        pictures = []
        for renderer in renderers:
            renderer.render(view, screen)
            pictures.append(read_pixels(screen)[..., :3].astype(float))
        warped += renderers[0].plan.counts["warped"]
        around = (5, 5, 1)
        least, most = minimum_filter(pictures[1], around), maximum_filter(pictures[1], around)
        strange = ((pictures[0] < least - 12) | (pictures[0] > most + 12)).any(-1)
        assert strange.mean() < 5e-4
    for renderer in renderers:
        renderer.release()
    scope.release()
    assert 10 < warped < 40 * 5 / 2
