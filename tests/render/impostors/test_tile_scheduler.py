"""Impostor tiles that are reused: what invalidates them, and the pictures that they make."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

from depthwalk.gpu.device import Device
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.draw.plan_settings import PlanSettings
from depthwalk.render.draw.planner import Planner
from depthwalk.render.image import read_pixels
from depthwalk.render.impostors.reprojection_error import HARDEST
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.bounds import object_bounds
from depthwalk.render.view.view import View
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import Camera, Objects
from depthwalk.scene.object_settings import LodParams, MeshLodParams, TileParams
from modes import AaName
from shapes import ShapeLibrary, box, joined, scene_of, sphere
from studio import Studio


class Walk:
    """The plans of successive frames over balls on a lattice, without GL."""

    def __init__(self, studio: Studio, count: int = 6, **layout: int) -> None:
        self.library = ShapeLibrary([sphere(0.5, 32, 16)], resolution=64)
        places = [(0, (1.5 * i, 0, -1.5 * k), 0.0, 1.0) for i in range(-count // 2, count // 2) for k in range(count)]
        self.renderer = Renderer(studio.device, scene_of(*places), self.library)
        self.planner, self.layout, self.atlas = (
            Planner(),
            TileParams.model_validate({**{"reuse_error": 0.5} | layout}),
            (1024, 1024),
        )
        self.objects, self.table = self.renderer.world.objects(), self.renderer.world.table()

    def frame(
        self,
        position: tuple[float, float, float],
        target: tuple[float, float, float],
        size: tuple[int, int] = (320, 240),
        objects: Objects | None = None,
        warp_limit: int | None = None,
        scale: float = 1.0,
    ) -> FrameDrawLists:
        objects = objects or self.objects
        view = View(Camera(position, target, 0.9), size, 0.1, 100.0, scale=scale)
        bounds = object_bounds(objects, self.table.centre, self.table.bounding_radius)
        visible, _ = bounds.visible(view)
        settings = PlanSettings(
            lod=LodParams(),
            layout=self.layout,
            polygons=MeshLodParams(),
            atlas_size=self.atlas,
            warp_limit=warp_limit,
        )
        scene = SceneArrays(objects=objects, bounds=bounds, table=self.table)
        return self.planner.plan(view, scene, visible, settings)


@pytest.fixture
def walk(studio: Studio) -> Iterator[Callable[..., Any]]:
    made = []

    def make(**layout: int) -> Walk:
        made.append(Walk(studio, **layout))
        return made[-1]

    yield make
    for each in made:
        each.renderer.release()


def test_a_camera_that_turns_warps_nothing_anew(walk: Callable[..., Any]) -> None:
    steps = walk()
    first = steps.frame((0, 1, 9), (0, 0.5, 0))
    assert first.counts["warped"] == first.counts["dpci"] > 20
    for degrees in range(1, 4):
        aside = 9 * np.tan(np.radians(degrees))
        assert steps.frame((0, 1, 9), (aside, 0.5, 0)).counts["warped"] <= 3  # only what comes into the picture
    assert steps.frame((0, 1, 9), (0, 0.5, 0)).counts["warped"] == 0


def test_only_what_is_near_is_warped_after_a_step(walk: Callable[..., Any]) -> None:
    steps = walk()
    steps.frame((0, 1, 9), (0, 0.5, 0))
    some = steps.frame((0.5, 1, 9), (0.5, 0.5, 0)).counts
    assert 0 < some["warped"] < some["dpci"]
    assert some["tile_error"] <= 1


def test_without_reuse_all_is_warped(walk: Callable[..., Any]) -> None:
    steps = walk(reuse_error=0)
    for _ in range(2):
        counts = steps.frame((0, 1, 9), (0, 0.5, 0)).counts
        assert counts["warped"] == counts["dpci"]


def test_a_teleport_warps_all(walk: Callable[..., Any]) -> None:
    steps = walk()
    steps.frame((0, 1, 9), (0, 0.5, 0))
    counts = steps.frame((12, 3, -4), (0, 0.5, -4)).counts
    assert counts["warped"] == counts["dpci"] and counts["tile_error"] == 0


def test_another_size_warps_all(walk: Callable[..., Any]) -> None:
    steps = walk()
    steps.frame((0, 1, 9), (0, 0.5, 0))
    counts = steps.frame((0, 1, 9), (0, 0.5, 0), size=(400, 300)).counts
    assert counts["warped"] == counts["dpci"]


def test_fewer_pixels_of_the_same_picture_warp_nothing(walk: Callable[..., Any]) -> None:
    steps = walk()
    before = steps.frame((0, 1, 9), (0, 0.5, 0))
    reduced = steps.frame((0, 1, 9), (0, 0.5, 0), size=(240, 180), scale=0.75)
    assert reduced.counts["warped"] == 0 and reduced.counts["dpci"] == before.counts["dpci"]
    fresh = walk().frame((0, 1, 9), (0, 0.5, 0), size=(240, 180), scale=0.75).counts
    assert fresh["warped_triangles"] == before.counts["warped_triangles"]
    assert fresh["atlas_used"] == pytest.approx(before.counts["atlas_used"], rel=0.1)


def test_what_has_too_many_triangles_is_coarser_at_first(walk: Callable[..., Any]) -> None:
    steps = walk()
    whole = walk().frame((0, 1, 9), (0, 0.5, 0)).counts
    limit = whole["warped_triangles"] // 2
    interactive = steps.frame((0, 1, 9), (0, 0.5, 0), warp_limit=limit).counts
    assert interactive["warped"] == interactive["dpci"] == whole["dpci"]
    assert 0 < interactive["warped_triangles"] <= limit and interactive["provisional"] > 20
    later = steps.frame((0, 1, 9), (0, 0.5, 0)).counts
    assert later["warped"] == interactive["provisional"] and later["provisional"] == 0
    levels = [{name: n for name, n in counts.items() if name.startswith("level_")} for counts in (later, whole)]
    assert levels[0] == levels[1]


def test_what_is_provisional_waits_for_the_budget(walk: Callable[..., Any]) -> None:
    steps = walk(triangle_budget=8000)
    interactive = steps.frame((0, 1, 9), (0, 0.5, 0), warp_limit=20_000).counts["provisional"]
    left = [steps.frame((0, 1, 9), (0, 0.5, 0), warp_limit=20_000).counts["provisional"] for _ in range(3)]
    assert interactive > left[0] > left[1] > left[2] > 0


def test_what_is_provisional_is_warped_at_once_where_nobody_waits(walk: Callable[..., Any]) -> None:
    steps = walk(triangle_budget=8000)
    assert steps.frame((0, 1, 9), (0, 0.5, 0), warp_limit=20_000).counts["provisional"] > 0
    assert steps.frame((0, 1, 9), (0, 0.5, 0)).counts["provisional"] == 0


def test_another_setting_warps_all(walk: Callable[..., Any]) -> None:
    steps = walk()
    steps.frame((0, 1, 9), (0, 0.5, 0))
    steps.layout.tile_scale = 2.0
    counts = steps.frame((0, 1, 9), (0, 0.5, 0)).counts
    assert counts["warped"] == counts["dpci"]


def test_only_the_object_that_turned_is_warped(walk: Callable[..., Any]) -> None:
    steps = walk()
    steps.frame((0, 1, 9), (0, 0.5, 0))
    rotation = steps.objects.rotation.copy()
    number = int(np.flatnonzero((steps.objects.position == (0, 0, 0)).all(1))[0])
    rotation[number] = 0, np.sin(0.2), 0, np.cos(0.2)
    turned = replace(steps.objects, rotation=rotation)
    assert steps.frame((0, 1, 9), (0, 0.5, 0), objects=turned).counts["warped"] == 1


def test_the_budget_holds_until_tiles_are_too_far_off(walk: Callable[..., Any]) -> None:
    steps = walk(triangle_budget=300)
    steps.frame((0, 1, 9), (0, 0.5, 0))
    worst = 0.0
    for k in range(1, 16):
        counts = steps.frame((0.03 * k, 1, 9), (0.03 * k, 0.5, 0)).counts
        worst = max(worst, counts["tile_error"])
        assert counts["warped_triangles"] <= 300
    assert 1 < worst <= HARDEST


def test_no_budget_lets_a_tile_be_more_than_four_times_as_far_off_as_allowed(walk: Callable[..., Any]) -> None:
    """Else the objects beside a viewer who walks on lag behind the others, by ever more pixels."""
    steps = walk(triangle_budget=0)
    worst = [steps.frame((0.05 * k, 1, 9), (0.05 * k, 0.5, 0)).counts["tile_error"] for k in range(30)]
    assert 3 < max(worst) <= 4


def test_a_full_atlas_lowers_the_resolution_and_says_so(walk: Callable[..., Any]) -> None:
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


def test_what_was_hidden_gives_way(walk: Callable[..., Any]) -> None:
    """Two rounds of looking about, with room for everything and for a part of it."""
    roomy, tight = walk(count=8), walk(count=8)
    tight.atlas = (512, 368)  # so little that tiles must give way; 384 rows hold all, and 352 leave them fewer texels
    warped = []
    for steps in (roomy, tight):
        rounds = [2 * np.pi * k / 16 for k in range(16)] * 2
        seen = [steps.frame((0, 6, -5), (3 * np.sin(a), 0, -5 + 3 * np.cos(a))).counts for a in rounds]
        assert all(counts["tile_resolution"] == 1 for counts in seen)
        warped.append(sum(counts["warped"] for counts in seen[16:]))
    assert 4 * warped[0] < warped[1]  # only what the edge of the picture cut off


SIZE = (240, 180)


@pytest.mark.parametrize(("steps", "aa"), [(0, "none"), (1, "none"), (1, "gpaa-edge"), (1, "msaa")])
def test_a_random_walk_shows_what_fresh_images_would(gl_device: Device, steps: int, aa: AaName) -> None:
    """No pixel has a colour that the fresh picture lacks within the bound and a texel of it."""
    shape = joined(box(0.9, 0.4, 0.9, (0, 0.2, 0)), sphere(0.4, 48, 24))
    library = ShapeLibrary([shape, sphere(0.5, 48, 24)], resolution=64)
    places = [(k % 2, (1.4 * k - 2.8, 0, -0.5 * k), 0.3 * k, 1.0) for k in range(5)]
    kept, fresh = (scene_of(*places) for _ in range(2))
    kept.render.warp.reuse_error = 1.0
    kept.render.composite.parallax_steps = steps
    kept.render.aa = fresh.render.aa = aa
    scope = gl_device.scope("test")
    screen = scope.framebuffer([scope.texture(SIZE, 4)])
    renderers = [Renderer(gl_device, scene, library) for scene in (kept, fresh)]
    renderers[0].remembers = True
    rng = np.random.default_rng(7)
    position, warped = np.array([0.0, 1.2, 4.5]), 0.0
    for _ in range(40):
        position += rng.normal(size=3) * [0.06, 0.02, 0.06]
        view = View(Camera(tuple(position), tuple(rng.normal(size=3) * 0.05 + [0, 0.6, 0]), 0.9), SIZE)
        pictures = []
        for renderer in renderers:
            renderer.render(view, screen)
            pictures.append(read_pixels(screen)[..., :3].astype(float))
        plan = renderers[0].plan
        assert plan is not None
        warped += plan.counts["warped"]
        around = (5, 5, 1)
        least, most = minimum_filter(pictures[1], around), maximum_filter(pictures[1], around)
        strange = ((pictures[0] < least - 12) | (pictures[0] > most + 12)).any(-1)
        assert strange.mean() < 5e-4
    for renderer in renderers:
        renderer.release()
    scope.release()
    assert 10 < warped < 40 * 5 / 2
