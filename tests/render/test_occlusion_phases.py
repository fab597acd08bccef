"""Pictures of objects that hide one another, which must be those that drawing all objects gives."""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.ndimage import maximum_filter, minimum_filter

from depthwalk.gpu.device import Device
from depthwalk.render import occlusion_phases
from depthwalk.render.culling.object_occlusion import Occluders
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.image import read_pixels
from depthwalk.render.occlusion_phases import OcclusionPhases
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import CAPTURED, HEIGHT_FIELDS, Camera, Representation
from depthwalk.types import Rows
from modes import AaName
from shapes import ShapeLibrary, box, joined, scene_of, sphere

SIZE = (160, 120)


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    """A ball, a wall, and a frame that one can look through."""
    bars = [box(0.2, 2.0, 0.2, (x, 1.0, 0)) for x in (-0.9, 0.9)] + [box(2, 0.2, 0.2, (0, y, 0)) for y in (0.1, 1.9)]
    return ShapeLibrary([sphere(0.5, 48, 24), box(3.0, 2.0, 0.3, (0, 1, 0)), joined(*bars)], resolution=64)


class Both:
    """Two renderers of the same objects, which cull or do not."""

    def __init__(
        self,
        device: Device,
        library: ShapeLibrary,
        places: Sequence[tuple[int, Sequence[float], float, float]],
        representation: Representation | None = None,
        **warp: float,
    ) -> None:
        self.scope = device.scope("test")
        self.screen = self.scope.framebuffer([self.scope.texture(SIZE, 4)])
        scenes = [scene_of(*places), scene_of(*places)]
        for scene, occlusion in zip(scenes, (True, False), strict=True):
            scene.render.culling.occlusion = occlusion
            for name, value in warp.items():
                setattr(scene.render.warp, name, value)
        self.renderers = [Renderer(device, scene, library) for scene in scenes]
        for renderer in self.renderers:
            renderer.world.representation = representation
            renderer.remembers = "reuse_error" in warp

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: None) -> None:
        for renderer in self.renderers:
            renderer.release()
        self.scope.release()

    def set(self, group: str, name: str, value: bool) -> None:
        for renderer in self.renderers:
            setattr(getattr(renderer.settings, group), name, value)

    def pictures(
        self, camera: Camera, near: float | None = None, far: float | None = None
    ) -> tuple[list[Rows], list[FrameDrawLists]]:
        """Of both, int (H, W, 4), and the plans."""
        pixels, self.depths = [], []
        for renderer in self.renderers:
            renderer.render(View(camera, SIZE, near, far), self.screen, transparent=True)
            pixels.append(read_pixels(self.screen).astype(int))
            assert renderer.targets is not None
            depth = renderer.targets.depth.read(alignment=4)
            self.depths.append(np.frombuffer(depth, np.float32).reshape(SIZE[::-1])[::-1])
        return pixels, [renderer.plan for renderer in self.renderers if renderer.plan is not None]


def assert_same(pictures: Sequence[Rows], representation: Representation | None = Representation.DPCI) -> None:
    """Tiles lie elsewhere in the atlas where fewer are drawn, and so their edges are rounded otherwise.

    Clusters of objects that intersect come in another order, and so do meshes and captured views, which meshes replace
    near by; of two surfaces that are equally far the first is seen.
    """
    differ = (pictures[0] != pictures[1]).any(-1)
    images = representation in (None, Representation.AUTO, Representation.DPCI)
    allowed = 0.002 if images else 0
    allowed = 1e-4 if representation in (Representation.MESH_CLUSTERS, *CAPTURED) else allowed
    assert differ.mean() <= allowed


DRAWN = "dpci", "dmesh", "mesh", "captured"


def crowd(seed: int, count: int) -> tuple[list[tuple[int, list[float], float, float]], np.random.Generator]:
    """Balls, walls and frames at random over a square."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(-7, 7, (count, 3)) * (1, 0.05, 1)
    kind, yaw, scale = rng.choice(3, count, p=(0.6, 0.2, 0.2)), rng.uniform(0, 6, count), rng.uniform(0.3, 1.5, count)
    return list(zip(kind.tolist(), place.tolist(), yaw.tolist(), scale.tolist(), strict=True)), rng


@pytest.fixture
def small_phases(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(occlusion_phases, "FIRST_PHASE", 4)


@pytest.mark.parametrize(
    ("representation", "aa"),
    [*((each, "none") for each in (None, *Representation) if each not in HEIGHT_FIELDS), (None, "msaa")],
)
def test_a_crowd_looks_the_same(
    gl_device: Device, library: ShapeLibrary, small_phases: None, representation: Representation | None, aa: AaName
) -> None:
    """From inside objects, through frames, partly outside the picture, after a jump to elsewhere in every frame."""
    places, rng = crowd(1, 200)
    occluded = 0.0
    with Both(gl_device, library, places, representation) as both:
        for renderer in both.renderers:
            renderer.settings.aa = aa
            renderer.settings.octahedral.views, renderer.settings.octahedral.resolution = 4, 32
            renderer.settings.billboard.resolution = 32
        for _ in range(12):
            eye, aim = rng.uniform(-7, 7, (2, 3)) * (1, 0.1, 1) + (0, 0.8, 0)
            pictures, plans = both.pictures(Camera(tuple(eye), tuple(aim), rng.uniform(0.5, 1.5)))
            assert_same(pictures, representation)
            drawn, all_of_them = (sum(plan.counts[name] for name in DRAWN) for plan in plans)
            assert plans[0].counts["occluded"] >= all_of_them - drawn >= 0
            assert plans[1].counts["occluded"] == 0
            occluded += all_of_them - drawn
    assert occluded > 300


@pytest.mark.parametrize("representation", [None, Representation.DPCI, Representation.MESH, Representation.OCTAHEDRAL])
def test_a_crowd_that_leans_and_lies_looks_the_same(
    gl_device: Device, library: ShapeLibrary, small_phases: None, representation: Representation | None
) -> None:
    """Cylinders about objects that are turned about all axes hide no more than the objects do."""
    places, rng = crowd(7, 200)
    turns = rng.normal(size=(len(places), 4))
    occluded = 0.0
    with Both(gl_device, library, places, representation) as both:
        for renderer in both.renderers:
            renderer.scene.objects.rotation[:] = turns / np.linalg.norm(turns, axis=1, keepdims=True)
            renderer.world.moved()
            renderer.settings.octahedral.views, renderer.settings.octahedral.resolution = 4, 32
        for _ in range(8):
            eye, aim = rng.uniform(-7, 7, (2, 3)) * (1, 0.1, 1) + (0, 0.8, 0)
            pictures, plans = both.pictures(Camera(tuple(eye), tuple(aim), rng.uniform(0.5, 1.5)))
            assert_same(pictures, representation)
            occluded += plans[0].counts["occluded"]
    assert occluded > 50


def test_what_is_no_height_field_is_drawn_as_depth_images(
    gl_device: Device, library: ShapeLibrary, small_phases: None
) -> None:
    """To the bit, and with the same counts: so the crowd above stands for each of these ways to draw it."""
    places, _ = crowd(1, 200)
    with Both(gl_device, library, places, Representation.DPCI) as both:
        seen, counts = [], []
        for kind in (Representation.DPCI, *HEIGHT_FIELDS):
            for renderer in both.renderers:
                renderer.world.representation = kind
            pictures, plans = both.pictures(Camera((2.0, 1.0, 6.0), (0.0, 0.5, 0.0), 1.0))
            seen.append(pictures)
            counts.append([plan.counts for plan in plans])
    for found, counted in zip(seen, counts, strict=True):
        np.testing.assert_array_equal(found, seen[0])
        assert counted == counts[0] and counted[0]["dpci"] > 20


@pytest.mark.parametrize("representation", [Representation.MESH, Representation.DPCI])
def test_hidden_cells_are_left_out_whole(
    gl_device: Device,
    library: ShapeLibrary,
    small_phases: None,
    monkeypatch: pytest.MonkeyPatch,
    representation: Representation,
) -> None:
    monkeypatch.setattr(occlusion_phases, "FIRST_BATCH", 16)
    monkeypatch.setattr("depthwalk.render.world.spatial_cells._OBJECTS", 8)
    asked = []
    drop = occlusion_phases.OcclusionPhases._drop_cells

    def count(self: OcclusionPhases, pending: Any, drawn: Occluders) -> int:
        for cells in pending.batches:
            asked.append(drawn.hide_cylinders(self._world.cells().cylinders(cells)))
        return drop(self, pending, drawn)

    monkeypatch.setattr(occlusion_phases.OcclusionPhases, "_drop_cells", count)
    places, rng = crowd(1, 400)
    with Both(gl_device, library, places, representation) as both:
        for _ in range(12):
            eye, aim = rng.uniform(-7, 7, (2, 3)) * (1, 0.1, 1) + (0, 0.8, 0)
            # Cells about the viewer would bring the near plane too near to tell surfaces apart that all but touch.
            pictures, _ = both.pictures(Camera(tuple(eye), tuple(aim), rng.uniform(0.5, 1.5)), 0.05, 30.0)
            assert_same(pictures, representation)
    unseen = np.concatenate(asked)
    assert 50 < unseen.sum() < len(unseen) - 50


def test_far_objects_are_remembered_too(
    gl_device: Device, library: ShapeLibrary, small_phases: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the last frame showed, in whichever batch of cells, is drawn in one phase, and what else is in a second."""
    monkeypatch.setattr(occlusion_phases, "FIRST_BATCH", 16)
    monkeypatch.setattr("depthwalk.render.world.spatial_cells._OBJECTS", 8)
    phases: list[int] = []
    plan = occlusion_phases.OcclusionPhases._plan

    def count(self: OcclusionPhases, frame: Any, rows: Rows, *others: Any) -> FrameDrawLists:
        if self._settings.culling.occlusion:
            phases.append(len(rows))
            assert len(np.unique(rows)) == len(rows)
        return plan(self, frame, rows, *others)

    monkeypatch.setattr(occlusion_phases.OcclusionPhases, "_plan", count)
    places, _ = crowd(3, 400)
    with Both(gl_device, library, places, Representation.MESH, reuse_error=0.5) as both:
        for step in range(5):
            phases.clear()
            eye = (0.02 * step, 4.0, 9.0)
            pictures, plans = both.pictures(Camera(eye, (0, 0.5, 0), 1.0), 0.05, 30.0)
            assert_same(pictures, Representation.MESH)
            if step == 0:
                assert len(phases) > 3
            else:
                assert len(phases) <= 2 and phases[0] > 30
            assert sum(phases) == plans[0].counts["mesh"]
            assert sum(phases) + plans[0].counts["occluded"] <= len(places)


@pytest.mark.slow
@given(st.integers(0, 2**32), st.sampled_from([Representation.MESH, Representation.DMESH]), st.integers(1, 60))
@example(0, Representation.DMESH, 1)
@example(8445, Representation.MESH, 21)
@example(302333, Representation.DMESH, 40)
@settings(max_examples=12)
def test_any_crowd_looks_the_same(
    gl_device: Device, library: ShapeLibrary, small_phases: None, seed: int, representation: Representation, count: int
) -> None:
    places, rng = crowd(seed, count)
    with Both(gl_device, library, places, representation) as both:
        eye, aim = rng.uniform(-9, 9, (2, 3)) * (1, 0.2, 1) + (0, 0.8, 0)
        pictures, _ = both.pictures(Camera(tuple(eye), tuple(aim), 1.0), 0.05, 40.0)
        differ = (pictures[0] != pictures[1]).any(-1)
        # Of surfaces that cut each other just there the one drawn first is seen: pixels may differ, depths may not.
        assert differ.mean() < 0.001
        culled, whole = both.depths
        np.testing.assert_allclose(culled, whole, rtol=0, atol=2.0**-23)


@pytest.mark.parametrize("group", ["warp", "mesh"])
def test_what_shows_through_lines_is_drawn(
    gl_device: Device, library: ShapeLibrary, small_phases: None, group: str
) -> None:
    places, _ = crowd(2, 60)
    with Both(gl_device, library, places, Representation.MESH if group == "mesh" else Representation.DMESH) as both:
        both.set(group, "wireframe", True)
        pictures, _ = both.pictures(Camera((0, 1, 9), (0, 0.5, 0), 1.0))
        assert_same(pictures, Representation.MESH)


def test_a_frame_does_not_depend_on_those_before(gl_device: Device, library: ShapeLibrary, small_phases: None) -> None:
    places, _ = crowd(3, 150)
    here, there = Camera((0, 1, 9), (0, 0.5, 0), 1.0), Camera((9, 1, 0), (0, 0.5, 0), 1.0)
    with Both(gl_device, library, places) as walked, Both(gl_device, library, places) as fresh:
        walked.pictures(there)
        (before, _), (plan, _) = walked.pictures(here)
        (picture, _), (wanted, _) = fresh.pictures(here)
        np.testing.assert_array_equal(before, picture)
        assert plan.counts == wanted.counts and plan.counts["occluded"] > 20


@pytest.mark.parametrize("representation", [Representation.MESH, Representation.DMESH])
def test_who_remembers_sees_the_same_and_draws_less(
    gl_device: Device, library: ShapeLibrary, small_phases: None, representation: Representation
) -> None:
    """A walk with jumps; who stands draws what was in sight, in one round."""
    places, rng = crowd(6, 200)
    with Both(gl_device, library, places, representation) as both:
        both.renderers[0].remembers = True
        for _ in range(5):
            eye, aim = rng.uniform(-7, 7, (2, 3)) * (1, 0.1, 1) + (0, 0.8, 0)
            drawn = []
            for step in range(4):
                camera = Camera((eye[0] + 0.05 * min(step, 2), eye[1], eye[2]), tuple(aim), 1.0)
                pictures, plans = both.pictures(camera)
                assert_same(pictures, representation)
                drawn.append([sum(plan.counts[name] for name in ("dmesh", "mesh")) for plan in plans])
            assert drawn[3][0] <= drawn[0][0] and drawn[3][0] < 0.7 * drawn[3][1]


def test_tiles_are_kept_from_round_to_round(gl_device: Device, library: ShapeLibrary, small_phases: None) -> None:
    """Who stands warps nothing; who walks sees what all tiles, warped anew, would show."""
    places, rng = crowd(4, 150)
    warped = drawn = 0.0
    with Both(gl_device, library, places, reuse_error=1.0) as both:
        both.renderers[1].remembers = False
        eye = np.array([0.0, 1.0, 9.0])
        for _ in range(20):
            eye += rng.normal(size=3) * (0.03, 0.01, 0.03)
            (kept, fresh), (plan, _) = both.pictures(Camera(tuple(eye), (0, 0.5, 0), 1.0))
            warped, drawn = warped + plan.counts["warped"], drawn + plan.counts["dpci"]
            around = (5, 5, 1)
            least, most = minimum_filter(fresh, around), maximum_filter(fresh, around)
            assert ((kept < least - 12) | (kept > most + 12)).any(-1).mean() < 2e-3
        assert plan.counts["occluded"] > 20
        assert both.pictures(Camera(tuple(eye), (0, 0.5, 0), 1.0))[1][0].counts["warped"] == 0
    assert warped < 0.6 * drawn


def test_frozen_levels_stay_frozen(gl_device: Device, library: ShapeLibrary, small_phases: None) -> None:
    places, _ = crowd(5, 80)
    with Both(gl_device, library, places, Representation.DMESH) as both:
        both.set("lod", "freeze", True)
        for distance in (4.0, 12.0):
            assert_same(both.pictures(Camera((0, 1, distance), (0, 0.5, 0), 1.0))[0], Representation.DMESH)
